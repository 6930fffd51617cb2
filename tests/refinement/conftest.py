"""Skeletons made by hand."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial import cKDTree

from glsk_o3d import Skeleton


@pytest.fixture(scope="session")
def ringed():
    """A skeleton each of whose vertices owns `per` points at exactly the distance `radius`, normals outward."""

    def make(vertices, edges, radius=0.1, per=12, seed=0):
        vertices = np.asarray(vertices, float)
        m = len(vertices)
        radius, owner = np.broadcast_to(radius, m), np.repeat(np.arange(m), per)
        normals = np.random.default_rng(seed).normal(size=(len(owner), 3))
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        edges = sorted({(min(a, b), max(a, b)) for a, b in edges})
        points = vertices[owner] + radius[owner, None] * normals
        return Skeleton(vertices, edges, radius, owner, points, normals)

    return make


@pytest.fixture(scope="session")
def around():
    """A skeleton whose points belong to their nearest vertex."""

    def make(vertices, edges, points, normals, radius=0.1):
        owner = cKDTree(vertices).query(points)[1]
        return Skeleton(vertices, edges, np.full(len(vertices), radius), owner, points, normals)

    return make


@pytest.fixture(scope="session")
def placed():
    """A skeleton turned, in another unit of length, and elsewhere."""

    def make(skeleton, turn=1, scale=1.0, shift=0.0):
        turn = np.linalg.qr(np.random.default_rng(turn).normal(size=(3, 3)))[0] if np.ndim(turn) == 0 else turn
        vertices, points = (scale * places @ turn + shift for places in (skeleton.vertices, skeleton.points))
        radii = scale * skeleton.radii
        return replace(skeleton, vertices=vertices, points=points, normals=skeleton.normals @ turn, radii=radii), turn

    return make


@pytest.fixture(scope="session")
def renumbered():
    """A skeleton whose vertex v is called name[v], with its points in another order."""

    def make(skeleton, name, order=None):
        old = np.argsort(name)
        order = np.arange(len(skeleton.points)) if order is None else order
        return replace(
            skeleton,
            vertices=skeleton.vertices[old],
            radii=skeleton.radii[old],
            confidence=skeleton.confidence[old],
            edges=np.unique(np.sort(name[skeleton.edges], axis=1), axis=0),
            points=skeleton.points[order],
            normals=skeleton.normals[order],
            vertex_of_point=name[skeleton.vertex_of_point[order]],
        )

    return make


@pytest.fixture(scope="session")
def random_skeleton():
    """A random geometric graph with uneven support; some points have no vertex, some vertices perhaps no point."""

    def make(seed, m=12, reach=0.5, n=40, every=True):
        rng = np.random.default_rng(seed)
        vertices = rng.uniform(size=(m, 3))
        edges = [(a, b) for a in range(m) for b in range(a + 1, m) if np.linalg.norm(vertices[a] - vertices[b]) < reach]
        owner = rng.integers(-1, m, n)
        owner[:m] = np.arange(m) if every else owner[:m]
        points, normals = rng.uniform(size=(n, 3)), rng.normal(size=(n, 3))
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        return Skeleton(vertices, edges, rng.uniform(0.05, 0.2, m), owner, points, normals)

    return make


def pipe(path, radius=0.1, spacing=0.03, side=None, seed=0):
    """Points of an open tube around a polyline, anywhere on it, and their outward normals; of one side, if it is given.

    `spacing` is the root of the area of a point.
    """
    path, rng = np.asarray(path, float), np.random.default_rng(seed)
    steps = np.diff(path, axis=0)
    length = np.linalg.norm(steps, axis=1)
    n = round(2 * np.pi * radius * length.sum() / spacing**2)
    place = rng.uniform(0, length.sum(), n)
    edge = np.minimum(np.searchsorted(np.cumsum(length), place), len(length) - 1)
    share = (place - np.concatenate([[0], np.cumsum(length)])[edge]) / length[edge]
    along = steps[edge] / length[edge, None]
    out = rng.normal(size=(n, 3))
    out -= np.einsum("ij,ij->i", out, along)[:, None] * along
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    points = path[edge] + share[:, None] * steps[edge] + radius * out
    seen = out @ side > 0 if side is not None else np.full(n, True)
    return points[seen], out[seen]


def off_axis(points, path):
    """Distance of points from a polyline."""
    start, step = path[:-1], np.diff(path, axis=0)
    t = np.einsum("pei,ei->pe", points[:, None] - start, step) / np.einsum("ei,ei->e", step, step)
    foot = start + np.clip(t, 0, 1)[:, :, None] * step
    return np.linalg.norm(points[:, None] - foot, axis=2).min(axis=1)


def _array(path):
    return np.asarray(path, float)


def line(start, stop, step=0.05):
    """Vertices of a straight line, evenly."""
    n = max(round(np.linalg.norm(stop - start) / step), 1)
    return start + np.linspace(0, 1, n + 1)[:, None] * (stop - start)


@pytest.fixture(scope="session")
def piped():
    """A skeleton in the axes of tubes: the vertices of the lines, those at one place once, and tubes around some lines.

    Normals have either sign. Of a tube what is inside of another is left out.
    """

    def make(lines, tubes=None, radius=0.1, confidence=0.95, step=0.05, **options):
        lines = [
            np.concatenate([it[:1], *(line(a, b, step)[1:] for a, b in pairwise(it))]) for it in map(_array, lines)
        ]
        tubes = range(len(lines)) if tubes is None else tubes
        vertices, which = np.unique(np.concatenate(lines).round(9), axis=0, return_inverse=True)
        edges, first = set(), 0
        for it in lines:
            names = which.ravel()[first : first + len(it)].tolist()
            edges |= {(min(a, b), max(a, b)) for a, b in pairwise(names)}
            first += len(it)
        points, normals = [], []
        for k in tubes:
            p, n = pipe(lines[k], radius, seed=k, **options)
            free = np.all([off_axis(p, lines[other]) > 0.99 * radius for other in tubes if other != k], axis=0)
            points.append(p[free] if len(tubes) > 1 else p)
            normals.append(n[free] if len(tubes) > 1 else n)
        points, normals = np.concatenate(points), np.concatenate(normals)
        normals *= np.random.default_rng(0).choice([-1.0, 1.0], (len(points), 1))
        owner = cKDTree(vertices).query(points)[1]
        m = len(vertices)
        return Skeleton(
            vertices, sorted(edges), np.full(m, radius), owner, points, normals, confidence=np.full(m, confidence)
        )

    return make
