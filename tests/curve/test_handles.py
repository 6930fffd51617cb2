"""Handles: their curves keep to their axes up to the wall of the body, and go straight on to its middle."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from glsk_o3d import skeletonize
from glsk_o3d.curve.curve import Curve
from glsk_o3d.curve.shape.handles import Handles
from glsk_o3d.samples.capsules import union_sample

pytestmark = pytest.mark.filterwarnings("ignore::glsk_o3d.SkeletonWarning")
BODY, HANDLE, REACH = 0.4, 0.06, 0.28
TURN = np.linspace(-np.pi / 2, np.pi / 2, 17)


def bow(side=1):
    """The axis of a handle, from one place to another inside a body along z."""
    return np.column_stack([side * (0.38 + REACH * np.cos(TURN)), 0 * TURN, REACH * np.sin(TURN)])


def joined(*parts, n=4096, seed=0):
    """Points of parts, each an axis and a radius."""
    nodes, edges, radii = [], [], []
    for axis, radius in parts:
        k = sum(map(len, nodes)) + np.arange(len(axis))
        nodes.append(axis)
        edges.append(np.column_stack([k[:-1], k[1:]]))
        radii.append(np.full(len(k), radius))
    graph = (np.concatenate(each) for each in (nodes, edges, radii))
    return union_sample("parts", *graph, n, 0.0, seed).points


def curve_of(skeleton):
    """Places all along the edges."""
    a, b = skeleton.vertices[skeleton.edges].transpose(1, 0, 2)
    share = np.linspace(0, 1, 40)[:, None, None]
    return ((1 - share) * a + share * b).reshape(-1, 3)


@pytest.mark.parametrize("sides", [(1,), (1, -1)])
def test_handles_keep_to_their_axes_up_to_the_wall_and_end_in_the_middle_of_the_body(sides):
    """The body, as thick as it is long, has no ends then; its points belong to the middle, with its radius."""
    body = np.array([[0, 0, -0.35], [0, 0, 0.35]])
    skeleton = skeletonize(joined((body, BODY), *((bow(side), HANDLE) for side in sides)), limb=0.95)
    assert (skeleton.n_components, skeleton.n_loops, len(skeleton.leaves)) == (1, len(sides), 0)
    assert skeleton.edge_lengths.min() > 0.05 * HANDLE  # no vertex is where another one is
    axes = np.concatenate([bow(side) for side in sides])
    outside = np.abs(axes[:, 0]) > BODY + HANDLE
    assert cKDTree(curve_of(skeleton)).query(axes[outside])[0].max() < 0.5 * HANDLE
    if len(sides) == 1:  # without a junction there
        middle = np.linalg.norm(skeleton.vertices, axis=1).argmin()
        assert np.linalg.norm(skeleton.vertices[middle]) < 0.2 * BODY
        assert skeleton.degree[middle] == 2
        assert 0.8 * BODY < skeleton.radii[middle] < 1.2 * BODY
        inside = np.linalg.norm(skeleton.vertices[:, :2], axis=1) < BODY
        assert inside[skeleton.vertex_of_point[skeleton.points[:, 0] < 0]].mean() > 0.99


def cup(seed, lid):
    """Points of a cylinder, without the top or with it, and half a torus that meets its wall at right angles."""
    random = np.random.default_rng(seed)
    turn, high = random.uniform(-np.pi, np.pi, 40000), random.uniform(-0.5, 0.5, 40000)
    wall = np.column_stack([BODY * np.cos(turn), BODY * np.sin(turn), high])
    flat = np.column_stack([random.uniform(-BODY, BODY, (40000, 2)), np.full(40000, -0.5)])
    flat = flat[np.hypot(*flat[:, :2].T) < BODY][: int(40000 * BODY / 2)]
    flats = [flat, -flat] if lid else [flat]
    around, along = random.uniform(-np.pi, np.pi, 40000), random.uniform(-np.pi / 2, np.pi / 2, 40000)
    out = 0.3 + HANDLE * np.cos(around)
    handle = np.column_stack([0.38 + out * np.cos(along), HANDLE * np.sin(around), out * np.sin(along)])
    handle = handle[random.uniform(0, 0.3 + HANDLE, 40000) < out][: int(40000 * 0.3 * np.pi * HANDLE / BODY)]
    points = np.concatenate([wall, *flats, handle[np.hypot(*handle[:, :2].T) > BODY]])
    return points[random.permutation(len(points))[:4096]]


@pytest.mark.parametrize(("seed", "lid"), [(0, False), (1, False), (2, True)])
def test_the_curve_of_a_cup_leaves_its_body_in_the_handle_only(seed, lid):
    skeleton = skeletonize(cup(seed, lid))
    assert (skeleton.n_components, skeleton.n_loops, len(skeleton.leaves)) == (1, 1, 0)
    x, y, z = curve_of(skeleton).T
    assert np.abs(z).max() < 0.5
    outside = np.hypot(x, y) > BODY
    off = np.hypot(np.hypot(x - 0.38, z) - 0.3, y)[outside] / HANDLE
    assert off.max() < 0.8
    assert off.mean() < 0.2
    if not lid:  # from the wall it leads to the middle, from which all points are far
        gaps = np.array(skeleton.report.joined)
        assert gaps.shape == (2, 2, 3)
        np.testing.assert_allclose(gaps[0, 0], gaps[1, 0])
        assert np.hypot(*gaps[0, 0, :2]) < 0.2
        np.testing.assert_allclose(np.hypot(*gaps[:, 1, :2].T), BODY, atol=0.1)


def ring(radii, beads=(), seed=0):
    """Points of a ring of radius 1, as thick as this at 64 places, with balls on it: pairs of an angle and a radius."""
    turn = np.append(np.linspace(0, 2 * np.pi, 64, endpoint=False), [angle for angle, _ in beads])
    nodes = np.column_stack([np.cos(turn), np.sin(turn), 0 * turn])
    edges = np.column_stack([np.arange(64), np.roll(np.arange(64), -1)])
    radii = np.append(np.broadcast_to(radii, 64), [radius for _, radius in beads])
    return union_sample("ring", nodes, edges, radii, 4096, 0.0, seed).points


CLASP = np.interp(np.abs(np.linspace(-np.pi, np.pi, 64, endpoint=False)), [0.4, 0.8, np.pi], [0.05, 0.22, 0.28])


@pytest.mark.parametrize(
    ("cloud", "bodies"),
    [(ring(0.06, [(0, 0.1)]), 0), (ring(0.06, [(0, 0.4)]), 1), (ring(CLASP), 0)],
    ids=["a bead", "a ball", "a thick ring with a thin clasp, whose middle is in the hole"],
)
def test_only_a_thick_body_on_a_ring_has_handles(cloud, bodies):
    skeleton = skeletonize(cloud)
    assert skeleton.n_loops == 1
    assert len(Handles(Curve.of(skeleton)).bodies) == bodies
    assert np.abs(np.linalg.norm(skeleton.vertices, axis=1) - 1).max() < 0.15


def test_junctions_are_in_the_middle_of_balls():
    """Of a frame of thin bars between balls, all of which are handles of these."""
    corner = np.array(list(np.ndindex(2, 2, 2)), float)
    edges = np.array([(i, j) for i in range(8) for j in range(i) if np.abs(corner[i] - corner[j]).sum() == 1])
    nodes, radii = np.concatenate([corner, corner]), np.repeat([0.05, 0.2], 8)
    skeleton = skeletonize(union_sample("frame", nodes, edges, radii, 8000, 0.0, 0).points)
    assert (len(skeleton.junctions), skeleton.n_loops) == (8, 5)
    assert cKDTree(corner).query(skeleton.vertices[skeleton.junctions])[0].max() < 0.06
