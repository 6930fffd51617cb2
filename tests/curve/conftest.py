"""Skeletons made by hand."""

import warnings
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial import cKDTree

from glsk_o3d import Refiner, Skeleton, SkeletonWarning
from glsk_o3d.curve.curve import Curve
from glsk_o3d.curve.surface import Evidence, Surface

NOTHING = dict(handle=0, air=0, bridge=0, limb=0, spacing=0, recentre=0)


@pytest.fixture(scope="session")
def refine():
    """The Refiner with none of its steps but those that are asked for, and without what it warns of."""

    def run(skeleton, **steps):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SkeletonWarning)
            return Refiner(**(NOTHING | steps))(skeleton)

    return run


@pytest.fixture(scope="session")
def placed():
    """A skeleton turned, in another unit of length, and elsewhere; and the turn."""

    def make(skeleton, scale=1.0, shift=0.0):
        turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
        vertices, points = (scale * places @ turn + shift for places in (skeleton.vertices, skeleton.points))
        lengths = {name: scale * getattr(skeleton, name) for name in ("radii", "half_width", "half_thickness")}
        return replace(skeleton, vertices=vertices, points=points, normals=skeleton.normals @ turn, **lengths), turn

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


def line(start, stop, step):
    """Vertices of a straight line, evenly."""
    n = max(round(np.linalg.norm(stop - start) / step), 1)
    return start + np.linspace(0, 1, n + 1)[:, None] * (stop - start)


def pipe(path, radius, spacing, side, seed):
    """Points anywhere on an open tube around a polyline, and their outward normals; of one side, if it is given.

    `spacing` is the root of the area of a point.
    """
    rng, steps = np.random.default_rng(seed), np.diff(path, axis=0)
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


@pytest.fixture(scope="session")
def piped():
    """A skeleton of lines, its vertices at one place once, and tubes around them or around other lines.

    Normals have either sign. Of a tube what is inside of another is left out.
    """

    def make(lines, around=None, radius=0.1, step=0.05, spacing=0.03, side=None):
        paths = [
            np.concatenate([corners[:1], *(line(a, b, step)[1:] for a, b in pairwise(corners))])
            for corners in (np.asarray(corners, float) for corners in lines)
        ]
        axes = paths if around is None else [np.asarray(corners, float) for corners in around]
        vertices, which = np.unique(np.concatenate(paths).round(9), axis=0, return_inverse=True)
        edges, first = set(), 0
        for path in paths:
            names = which.ravel()[first : first + len(path)].tolist()
            edges |= {(min(a, b), max(a, b)) for a, b in pairwise(names)}
            first += len(path)
        points, normals = [], []
        for k, axis in enumerate(axes):
            surface, outward = pipe(axis, radius, spacing, side, seed=k)
            others = [off_axis(surface, other) > 0.99 * radius for other in axes if other is not axis]
            free = np.all([np.full(len(surface), True), *others], axis=0)
            points.append(surface[free])
            normals.append(outward[free])
        points, normals = np.concatenate(points), np.concatenate(normals)
        normals *= np.random.default_rng(0).choice([-1.0, 1.0], (len(points), 1))
        owner = cKDTree(vertices).query(points)[1]
        return Skeleton(vertices, sorted(edges), np.full(len(vertices), radius), owner, points, normals)

    return make


@pytest.fixture(scope="session")
def strands(piped):
    """A tube with two strands in it that meet at both ends."""

    def make(gap, length, **options):
        a, b = length / 2, length / 2 - 0.05
        middle = [[(-a, 0, 0), (-b, y, 0), (b, y, 0), (a, 0, 0)] for y in (-gap / 2, gap / 2)]
        ends = [[(-1, 0, 0), (-a, 0, 0)], [(a, 0, 0), (1, 0, 0)]]
        return piped([*middle, *ends], around=[[(-1, 0, 0), (1, 0, 0)]], **options)

    return make


@pytest.fixture(scope="session")
def evidence():
    """What the surface of a skeleton says about its curve."""

    def of(skeleton):
        curve = Curve.of(skeleton)
        return Evidence(curve, Surface.of(curve).oriented(curve))

    return of


@pytest.fixture(scope="session")
def assert_unchanged():
    def check(skeleton, raw):
        np.testing.assert_allclose(skeleton.vertices, raw.vertices, atol=1e-12)
        np.testing.assert_array_equal(skeleton.edges, raw.edges)
        np.testing.assert_array_equal(skeleton.vertex_of_point, raw.vertex_of_point)

    return check
