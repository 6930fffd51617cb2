"""Ends go on along their limbs and stop where these do."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from glsk_o3d import Skeleton, skeletonize
from glsk_o3d.numerics.polylines import arc_lengths
from glsk_o3d.numerics.vectors import norm
from glsk_o3d.refinement.ends import _End, regrow_ends
from glsk_o3d.samples import sauropod

R = 0.1
LENGTH = 1.2
STEP = R / 3


def turned(n, rng):
    """Unit vectors around the x axis, (n, 3)."""
    angle = rng.uniform(0, 2 * np.pi, n)
    return np.column_stack([np.zeros(n), np.cos(angle), np.sin(angle)])


def limb(cap, taper=0.0, per=3000, seed=0):
    """A tube along x from 0 to LENGTH, of radius R at 0, and the cap that closes it there; normals have either sign."""
    rng = np.random.default_rng(seed)
    thin = 1 - taper * rng.uniform(0, 1, 4 * per)
    thin = thin[rng.uniform(size=len(thin)) < thin][:per]  # as many on an area wherever the tube is thinner
    x = (1 - thin) / taper * LENGTH if taper else rng.uniform(0, LENGTH, per)
    out = turned(len(x), rng)
    points = np.column_stack([x, np.zeros((len(x), 2))]) + R * (1 - taper * x / LENGTH)[:, None] * out
    normals = out + [taper * R / LENGTH, 0, 0]
    density = len(x) / (2 * np.pi * R * LENGTH * (1 - taper / 2))
    if cap == "flat":
        out = turned(round(density * np.pi * R**2), rng)
        points = np.concatenate([points, [LENGTH, 0, 0] + R * np.sqrt(rng.uniform(size=(len(out), 1))) * out])
        normals = np.concatenate([normals, np.tile([1, 0, 0], (len(out), 1))])
    if cap == "round":
        out = turned(round(density * 2 * np.pi * R**2), rng)
        height = rng.uniform(size=(len(out), 1))
        out = height * [1, 0, 0] + np.sqrt(1 - height**2) * out
        points, normals = np.concatenate([points, [LENGTH, 0, 0] + R * out]), np.concatenate([normals, out])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return points, normals * rng.choice([-1, 1], (len(points), 1))


def fork(points, normals, stop, hook=0.0):
    """A path along x from 0 to `stop` that turns aside over the last radius; at 0 it meets two bare ones."""
    x = np.linspace(0, stop, round(stop / STEP) + 1)
    aside = hook * np.maximum(x - stop + R, 0)
    path = np.column_stack([x, aside, np.zeros(len(x))])
    vertices = np.concatenate([path, [[0, 5, 0], [0, -5, 0]]])
    m = len(path)
    edges = [[0, m], [0, m + 1], *([i, i + 1] for i in range(m - 1))]
    owner = cKDTree(path).query(points)[1]
    ones = np.ones(m + 2)
    return Skeleton(vertices, sorted(edges), R * ones, owner, points, normals, confidence=0.9 * ones)


def tip(skeleton):
    """The end of the path along x."""
    return skeleton.vertices[skeleton.leaves][np.argmax(skeleton.vertices[skeleton.leaves, 0])]


@pytest.mark.parametrize("hook", [0, 1, -1])
@pytest.mark.parametrize("stop", [LENGTH, LENGTH - R, LENGTH - 3 * R])
@pytest.mark.parametrize(("cap", "where"), [("flat", -0.5), ("open", -0.5), ("round", 0)])
def test_an_end_stops_where_its_limb_does(cap, where, stop, hook):
    """Wherever contraction left it: half a radius inside a face, and at the centre of a round cap."""
    found = tip(regrow_ends(fork(*limb(cap), stop, hook)))
    np.testing.assert_allclose(found, [LENGTH + where * R, 0, 0], atol=0.15 * R)


def test_a_cone_ends_in_its_point():
    found = tip(regrow_ends(fork(*limb("open", taper=1.0), LENGTH - 3 * R)))
    assert LENGTH - 1.5 * R < found[0] < LENGTH
    assert np.linalg.norm(found[1:]) < 0.05 * R


@pytest.mark.parametrize("cap", ["flat", "round"])
def test_half_a_limb_is_enough(cap):
    """Seen from one side."""
    points, normals = limb(cap)
    seen = points[:, 1] > 0
    found = tip(regrow_ends(fork(points[seen], normals[seen], LENGTH, 1)))
    np.testing.assert_allclose(found, [LENGTH - (cap == "flat") * R / 2, 0, 0], atol=0.2 * R)


@pytest.mark.parametrize("cap", ["flat", "round"])
def test_noise_moves_an_end_little(cap):
    """A tenth of the radius, and normals thirty degrees off."""
    points, normals = limb(cap)
    rng = np.random.default_rng(1)
    points = points + rng.normal(0, 0.1 * R, points.shape)
    normals = normals + rng.normal(0, 0.3, normals.shape)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    found = tip(regrow_ends(fork(points, normals, LENGTH, 1)))
    np.testing.assert_allclose(found, [LENGTH - (cap == "flat") * R / 2, 0, 0], atol=0.35 * R)


@pytest.mark.parametrize(("radii", "off"), [(6, 0.35), (3, 0.65)])
def test_a_bent_limb_stays_bent(radii, off):
    """Around a circle of some radii, two short: straight on it would be 1.2 and 2.0 off."""
    points, normals = limb("flat", per=6000)
    big = radii * R

    def bent(p):
        angle, radius = p[:, 0] / big, big + p[:, 1]
        return np.column_stack([radius * np.sin(angle), radius * np.cos(angle) - big, p[:, 2]])

    flat = fork(points, normals, LENGTH - 2 * R)
    angle = points[:, 0] / big
    x, y, z = normals.T
    normals = np.column_stack([x * np.cos(angle) + y * np.sin(angle), y * np.cos(angle) - x * np.sin(angle), z])
    curved = replace(flat, vertices=bent(flat.vertices), points=bent(points), normals=normals)
    grown = regrow_ends(curved)
    end = grown.vertices[grown.leaves]
    stop = bent(np.array([[LENGTH - R / 2, 0, 0]]))
    assert np.linalg.norm(end - stop, axis=1).min() < off * R


@pytest.mark.parametrize(("n", "seed"), [(4096, 1), (8192, 0), (16384, 2)])
def test_a_head_that_hangs_from_its_neck_has_an_axis(n, seed):
    """Three radii long, turned by 70 degrees: an end that goes on along the neck leaves through its skin."""
    body = sauropod(n, seed=seed)
    skeleton = skeletonize(body.points)
    nose = body.nodes[np.argmax(body.nodes[:, 0])]
    ends = skeleton.vertices[skeleton.leaves]
    end = ends[np.argmin(norm(ends - nose))]
    assert norm(end - nose) < 0.035  # .75 radii there


@pytest.mark.parametrize("bend", [0.0, 1.0])
def test_lengths_along_an_end_are_those_of_its_curve(bend):
    """Of a parabola, in closed form: y = k x^2 / 2 has the length (u sqrt(1 + u^2) + asinh u) / 2 k with u = k x."""
    rng = np.random.default_rng(0)
    x, angle = rng.uniform(0, 0.5, 2000), rng.uniform(0, 2 * np.pi, 2000)
    slope = bend * x
    across = np.column_stack([-slope, np.ones(2000), np.zeros(2000)]) / np.hypot(1, slope)[:, None]
    out = np.cos(angle)[:, None] * across + np.sin(angle)[:, None] * [0, 0, 1]
    points = np.column_stack([x, bend * x**2 / 2, np.zeros(2000)]) + 0.05 * out
    end = _End.of(points, out, np.array([1.0, 0, 0]), 0.05)
    exact = (slope * np.sqrt(1 + slope**2) + np.arcsinh(slope)) / (2 * bend) if bend else x
    np.testing.assert_allclose(end.length, exact, atol=0.02)
    np.testing.assert_allclose(arc_lengths(end.curve(np.linspace(0, 0.5, 400)))[-1], 0.5, rtol=1e-3)


def test_new_vertices_are_like_those_behind():
    """As far apart, as thick, as sure; every point of a vertex that was cut has the nearest one of the end."""
    raw = fork(*limb("flat"), LENGTH, 1)
    found = regrow_ends(raw)
    along = np.sort(found.vertices[np.abs(found.vertices[:, 1]) < R, 0])
    np.testing.assert_allclose(np.diff(along), STEP, rtol=0.25)
    np.testing.assert_allclose(found.radii, R)
    np.testing.assert_allclose(found.confidence, 0.9)
    assert (np.diff(found.edges, axis=1) > 0).all()
    assert found.n_components == 1
    assert len(found.leaves) == 3
    assert np.bincount(found.vertex_of_point, minlength=len(found.vertices))[found.leaves].max() > 0
    apart = np.linalg.norm(found.points - found.vertices[found.vertex_of_point], axis=1)
    assert apart.max() < 1.5 * R


def test_both_ends_of_a_stub_grow():
    """A tube three radii long keeps its direction."""
    points, normals = limb("flat")
    near = points[:, 0] > LENGTH - 3 * R
    x = np.linspace(LENGTH - 3 * R, LENGTH, 10)
    path = np.column_stack([x, np.maximum(x - LENGTH + 0.5 * R, 0), 0 * x])
    edges = np.column_stack([np.arange(9), np.arange(1, 10)])
    owner = cKDTree(path).query(points[near])[1]
    found = regrow_ends(Skeleton(path, edges, np.full(10, R), owner, points[near], normals[near]))
    ends = found.vertices[found.leaves]
    np.testing.assert_allclose(np.sort(ends[:, 0]), [LENGTH - 2.5 * R, LENGTH - R / 2], atol=0.25 * R)
    np.testing.assert_allclose(ends[:, 1:], 0, atol=0.2 * R)


@pytest.mark.parametrize("cap", ["flat", "round"])
def test_it_does_not_matter_where_and_how_large_things_are(cap, placed):
    raw = fork(*limb(cap), LENGTH, 1)
    for size in (1e-3, 1e3):
        moved, turn = placed(raw, 3, size, size)
        found, expected = regrow_ends(moved), regrow_ends(raw)
        np.testing.assert_array_equal(found.edges, expected.edges)
        np.testing.assert_allclose(found.vertices / size - 1, expected.vertices @ turn, atol=1e-6)
        np.testing.assert_array_equal(found.vertex_of_point, expected.vertex_of_point)


def test_loops_and_lone_vertices_stay(ringed):
    """Nothing ends there."""
    angle = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    vertices = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    raw = ringed([*vertices, [5, 5, 5]], [(i, (i + 1) % 12) for i in range(12)])
    assert regrow_ends(raw) is raw


def test_ends_without_points_stay(ringed):
    """Nor do those without normals, or in one place."""
    raw = ringed([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [(0, 1), (1, 2)])
    nobody = replace(raw, vertex_of_point=np.full(len(raw.points), -1))
    assert regrow_ends(nobody) is nobody
    blind = replace(raw, normals=np.full_like(raw.normals, np.nan))
    assert regrow_ends(blind) is blind
    heap = replace(raw, vertices=np.zeros((3, 3)))
    assert regrow_ends(heap) is heap


@pytest.mark.parametrize("seed", range(20))
def test_whatever_the_graph_it_stays_whole(random_skeleton, seed):
    """As many parts, loops and leaves as before, and no vertex out of place."""
    raw = random_skeleton(seed, n=300)
    found = regrow_ends(raw)
    for name in ("n_components", "n_loops"):
        assert getattr(found, name) == getattr(raw, name)
    assert len(found.leaves) == len(raw.leaves)
    assert np.isfinite(found.vertices).all()
    assert found.vertex_of_point.max() < len(found.vertices)
    np.testing.assert_array_equal(found.vertex_of_point < 0, raw.vertex_of_point < 0)
