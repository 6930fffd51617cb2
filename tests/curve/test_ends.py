"""Ends go on along their limbs and stop where these do."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from glsk_o3d import Skeleton, skeletonize

R = 0.1
LENGTH = 1.2
STEP = R / 3


def turned(n, rng):
    """Unit vectors around the x axis, (n, 3)."""
    angle = rng.uniform(0, 2 * np.pi, n)
    return np.column_stack([np.zeros(n), np.cos(angle), np.sin(angle)])


def limb(cap, n=3000):
    """A tube of radius R along x from 0 to LENGTH, and the cap that closes it there; normals have either sign."""
    rng = np.random.default_rng(0)
    normals = turned(n, rng)
    points = R * normals + rng.uniform(0, LENGTH, (n, 1)) * [1, 0, 0]
    density = n / (2 * np.pi * R * LENGTH)
    if cap == "flat":
        out = turned(round(density * np.pi * R**2), rng)
        disc = [LENGTH, 0, 0] + R * np.sqrt(rng.uniform(size=(len(out), 1))) * out
        points, normals = np.concatenate([points, disc]), np.concatenate([normals, np.tile([1, 0, 0], (len(out), 1))])
    if cap == "round":
        out = turned(round(density * 2 * np.pi * R**2), rng)
        height = rng.uniform(size=(len(out), 1))
        out = height * [1, 0, 0] + np.sqrt(1 - height**2) * out
        points, normals = np.concatenate([points, [LENGTH, 0, 0] + R * out]), np.concatenate([normals, out])
    return points, normals * rng.choice([-1, 1], (len(points), 1))


def fork(points, normals, stop, hook=0.0):
    """A path along x from 0 to `stop` that turns aside over the last radius; at 0 it meets two bare ones."""
    x = np.linspace(0, stop, round(stop / STEP) + 1)
    path = np.column_stack([x, hook * np.maximum(x - stop + R, 0), 0 * x])
    m = len(path)
    edges = [[0, m], [0, m + 1], *([i, i + 1] for i in range(m - 1))]
    owner = cKDTree(path).query(points)[1]
    vertices = np.concatenate([path, [[0, 5, 0], [0, -5, 0]]])
    return Skeleton(vertices, sorted(edges), np.full(m + 2, R), owner, points, normals)


def tip(skeleton):
    """The end of the path along x."""
    return skeleton.vertices[skeleton.leaves][np.argmax(skeleton.vertices[skeleton.leaves, 0])]


@pytest.mark.parametrize("hook", [0, 1])
@pytest.mark.parametrize("stop", [LENGTH, LENGTH - 3 * R])
@pytest.mark.parametrize(("cap", "where"), [("flat", -0.5), ("open", -0.5), ("round", 0)])
def test_an_end_stops_where_its_limb_does(refine, cap, where, stop, hook):
    """Wherever contraction left it: half a radius inside a face, and at the centre of a round cap."""
    skeleton = tip(refine(fork(*limb(cap), stop, hook), recentre=3))
    np.testing.assert_allclose(skeleton, [LENGTH + where * R, 0, 0], atol=0.15 * R)


def bottle(thin, long, n=6000):
    """A tube of radius R with a neck of that radius and length, and faces at its shoulder and at the end."""
    rng = np.random.default_rng(0)
    out, area = turned(n, rng), np.array([R * LENGTH, thin * long, R**2 / 2])
    part, u = rng.choice(3, (n, 1), p=area / area.sum()), rng.uniform(size=(n, 1))
    disc = R * np.sqrt(u)
    radius = np.choose(part, [R, thin, disc])
    x = np.choose(part, [LENGTH * u, LENGTH + long * u, LENGTH + long * (disc < thin)])
    normals = np.where(part == 2, [1, 0, 0], out)
    return radius * out + x * [1, 0, 0], normals * rng.choice([-1, 1], (n, 1))


@pytest.mark.parametrize("stop", [-1, 0, 1])
@pytest.mark.parametrize(("thin", "long"), [(0.3, 1), (0.4, 1.5)])
def test_a_neck_goes_on_beyond_its_shoulder(refine, thin, long, stop):
    """Even one no longer than its limb is thick: the curve ends half its radius inside its face, and as thin as it."""
    skeleton = refine(fork(*bottle(thin * R, long * R), LENGTH + stop * R), recentre=3)
    end = np.flatnonzero((skeleton.vertices == tip(skeleton)).all(axis=1))
    np.testing.assert_allclose(tip(skeleton), [LENGTH + (long - thin / 2) * R, 0, 0], atol=0.1 * R)
    np.testing.assert_allclose(skeleton.radii[end], thin * R, rtol=0.1)


def test_new_vertices_of_an_end_are_like_those_behind(refine):
    """As far apart and as thick; every point of a vertex that was cut has the nearest one of the end."""
    skeleton = refine(fork(*limb("flat"), LENGTH, 1), recentre=3)
    along = np.sort(skeleton.vertices[np.abs(skeleton.vertices[:, 1]) < R, 0])
    np.testing.assert_allclose(np.diff(along), STEP, rtol=0.25)
    np.testing.assert_allclose(skeleton.radii[1 : len(along) - 2], R, rtol=0.05)
    assert (skeleton.n_components, len(skeleton.leaves)) == (1, 3)
    distance = np.linalg.norm(skeleton.points - skeleton.vertices[skeleton.vertex_of_point], axis=1)
    assert distance.max() < 1.5 * R


def pan(slope, n=4000):
    """A disc with a wall that leans outwards, by `slope` for each unit of its height of 0.07, and a bar along -x."""
    rng = np.random.default_rng(0)
    low, high, thick = 0.2, 0.2 + 0.07 * slope, 0.025
    area = np.array([np.pi * low**2, np.pi * (low + high) * np.hypot(high - low, 0.07), 2 * np.pi * thick * 0.45])
    part, u, out = rng.choice(3, (n, 1), p=area / area.sum()), rng.uniform(size=(n, 1)), turned(n, rng)
    radius = np.choose(part, [low * np.sqrt(u), low + (high - low) * u, 0])
    body = radius * out[:, [1, 2, 0]] + 0.07 * (part == 1) * u * [0, 0, 1]
    bar = thick * out + [0, 0, 0.05] - (high + 0.45 * u) * [1, 0, 0]
    return np.where(part == 2, bar, body)


@pytest.mark.filterwarnings("ignore:weakly supported", "ignore:sheet-like")  # a pan is no tube
@pytest.mark.parametrize("slope", [0.5, 1, 2])
def test_an_end_stays_between_walls_that_slope(slope):
    """Their normals meet in front of the mouth of a pan, half its width away."""
    skeleton = skeletonize(pan(slope))
    assert (skeleton.n_loops, len(skeleton.leaves)) == (0, 2)
    assert skeleton.vertices[:, 2].min() > 0
    assert skeleton.vertices[:, 2].max() < 0.07 + 0.02
