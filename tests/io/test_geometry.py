"""Skeletons as line sets, in colours, as tubes: closed, outward, as thick as they should be; and as voxels."""

from dataclasses import replace

import numpy as np
import pytest

from glsk_o3d import InvalidParameterError, Skeleton, samples, to_line_set, to_tubes, to_voxels
from glsk_o3d.analysis import branch_table
from glsk_o3d.io.colors import COLOR_NAMES, UNKNOWN_GREY, shades
from glsk_o3d.io.geometry import sweep

BRANCH, VERTICES = np.array([0, 1, -1]), np.array([0, 5, -1])


def graph(vertices, edges, radii):
    return Skeleton(vertices, edges, radii, (), (), ())


def axis_of(sample):
    return graph(sample.nodes, sample.edges, sample.radii)


# ----------------------------------------------------------------------------------------------- line sets and colours


def test_a_line_set_has_its_own_copy_of_the_graph(skeleton):
    lines, before = skeleton.to_line_set((0, 0.5, 1)), skeleton.vertices.copy()
    np.testing.assert_array_equal(np.asarray(lines.points), skeleton.vertices)
    np.testing.assert_array_equal(np.asarray(lines.lines).reshape(-1, 2), skeleton.edges)
    np.testing.assert_array_equal(np.asarray(lines.colors), np.tile([0, 0.5, 1], (len(skeleton.edges), 1)))
    lines.translate((1, 1, 1))
    np.testing.assert_array_equal(skeleton.vertices, before)


@pytest.mark.parametrize("count", [0, 1])
@pytest.mark.parametrize("color", [*COLOR_NAMES, (0.1, 0.2, 0.3)])
def test_colours_without_edges(count, color):
    detached = Skeleton(np.zeros((count, 3)), (), np.ones(count), (), (), (), confidence=np.ones(count))
    lines = to_line_set(detached, color)
    assert (len(lines.points), len(lines.lines), len(lines.colors)) == (count, 0, 0)
    assert len(to_tubes(detached, color).vertex_colors) == len(to_tubes(detached, color).vertices)


@pytest.mark.parametrize("color", COLOR_NAMES)
def test_no_branch_and_unknown_values_are_grey(tree, color):
    shown = shades(tree, color, BRANCH, VERTICES)
    assert shown.shape == (3, 3)
    np.testing.assert_array_equal(shown[2], UNKNOWN_GREY)
    assert ((shown >= 0) & (shown <= 1)).all()
    unknown = replace(tree, radii=np.full(6, np.nan), confidence=np.full(6, np.nan), support=np.full(6, np.nan))
    if color not in ("branch", "order"):
        assert (shades(unknown, color, BRANCH, VERTICES) == UNKNOWN_GREY).all()


def test_branches_differ_orders_go_up_and_values_are_means_over_vertices(tree):
    assert len(np.unique(shades(tree, "branch", np.arange(18), np.zeros(18, int)), axis=0)) == 18
    pairs = np.array([[0, 0], [5, 5]])
    by_radius = [shades(tree, "radius", BRANCH[:2], vertices) for vertices in (pairs, VERTICES[:2])]
    np.testing.assert_array_equal(*by_radius)
    order = branch_table(tree).order
    shown = shades(tree, "order", np.arange(len(order)), np.zeros(len(order), int))
    dark, light = (np.unique(shown[order == level], axis=0) for level in (0, 1))
    assert len(dark) == len(light) == 1
    assert dark.sum() < light.sum()


def test_one_colour_for_all_and_what_is_none(tree):
    np.testing.assert_array_equal(shades(tree, (0, 0.5, 1), BRANCH, VERTICES), [[0, 0.5, 1]] * 3)
    for wrong in ("size", (1, 0), (0, 0, 2), ("a", 0, 0), np.nan):
        with pytest.raises(InvalidParameterError, match=r"color = .*'radius'"):
            shades(tree, wrong, BRANCH, VERTICES)


# --------------------------------------------------------------------------------------------------------------- tubes


def prism(sides):
    """Area of a regular polygon over that of its circle."""
    return sides / 2 / np.pi * np.sin(2 * np.pi / sides)


@pytest.mark.parametrize("direction", [[0, 0, 1], [0, 0, -1], [1, 0, 0], [1, -2, 3]])
def test_a_capsule(direction):
    axis = np.array(direction) / np.linalg.norm(direction)
    mesh = to_tubes(graph(np.outer([0, 0.4, 1], axis) + 5, [(0, 1), (1, 2)], [0.1] * 3), sides=64)
    assert mesh.is_watertight()
    caps, length = 4 / 3 * np.pi * 0.1**3, np.pi * 0.1**2
    assert mesh.get_volume() == pytest.approx(prism(64) * (length + caps), rel=1e-3)
    points = np.asarray(mesh.vertices) - 5
    along = points @ axis
    assert (along.min(), along.max()) == pytest.approx((-0.1, 1.1))
    distance = np.linalg.norm(points - np.outer(np.clip(along, 0, 1), axis), axis=1)
    np.testing.assert_allclose(distance, 0.1, rtol=1e-9)
    assert np.asarray(mesh.vertex_normals).shape == points.shape


def test_a_cone_and_a_ball():
    cone = to_tubes(graph([[0, 0, 0], [2, 0, 0]], [(0, 1)], [0.3, 0.1]), sides=96)
    frustum, caps = np.pi * 2 / 3 * (0.09 + 0.03 + 0.01), 2 / 3 * np.pi * (0.3**3 + 0.1**3)
    assert cone.get_volume() == pytest.approx(prism(96) * (frustum + caps), rel=1e-3)
    ball = to_tubes(graph([[1, 1, 1]], [], [0.5]), sides=96)
    assert ball.is_watertight()
    assert ball.get_volume() == pytest.approx(np.pi / 6, rel=3e-3)


@pytest.mark.parametrize("sample", [samples.sauropod(64), samples.two_rings(64)], ids=str)
def test_every_branch_is_one_closed_outward_surface(sample):
    skeleton = axis_of(sample)
    mesh = to_tubes(skeleton, sides=9)
    assert mesh.is_edge_manifold(allow_boundary_edges=False)
    assert mesh.is_orientable()
    assert mesh.euler_poincare_characteristic() == 2 * len(skeleton.branches)
    corners = np.asarray(mesh.vertices)[np.asarray(mesh.triangles)]
    assert np.einsum("ni,ni->n", np.cross(corners[:, 0], corners[:, 1]), corners[:, 2]).sum() > 0
    _, counts = np.unique(np.asarray(mesh.vertex_colors), axis=0, return_counts=True)
    with_caps = [9 * (len(path) + 2) + 2 for path in skeleton.branches]  # two more circles, two poles
    assert sorted(counts) == sorted(with_caps)


def test_a_helix_of_wire_has_its_volume_and_does_not_twist():
    spring = axis_of(samples.helix(64))
    wire, caps = np.pi * 0.06**2 * spring.length, 4 / 3 * np.pi * 0.06**3
    assert to_tubes(spring, sides=48).get_volume() == pytest.approx(wire + caps, rel=0.01)
    points, _, row = sweep(spring.vertices, spring.radii, spring.branches, 8)
    ring = points[np.isin(row, np.arange(1, len(spring.vertices) - 1))].reshape(-1, 8, 3)
    across = (ring - ring.mean(axis=1, keepdims=True))[:, 0] / 0.06
    step = np.linalg.norm(np.diff(across, axis=0), axis=1)
    turned = np.linalg.norm(np.diff(spring.vertices[1:-1], axis=0), axis=1) / 0.3
    assert (step < 1.1 * turned).all()


def test_sharp_turns_and_coincident_vertices():
    zigzag = [[0, 0, 0], [1, 0, 0], [0, 0, 0], [0, 0, 0], [1, 1, 1]]
    mesh = to_tubes(graph(zigzag, [(0, 1), (1, 2), (2, 3), (3, 4)], [0.1] * 5))
    assert np.isfinite(np.asarray(mesh.vertices)).all()
    assert mesh.is_edge_manifold(allow_boundary_edges=False)


def test_radius_and_refusals():
    bare = replace(axis_of(samples.y_junction(64)), radii=np.full(4, np.nan))
    with pytest.raises(InvalidParameterError, match="4 of 4 vertices have no radius"):
        to_tubes(bare)
    thin = np.asarray(to_tubes(bare, radius=0.01).vertices)
    assert np.abs(thin[:, 1]).max() == pytest.approx(0.01, rel=0.1)
    for wrong in (dict(radius=0), dict(radius=np.nan), dict(sides=2), dict(sides=8.0), dict(color="red", radius=1)):
        with pytest.raises(InvalidParameterError, match=next(iter(wrong))):
            to_tubes(bare, **wrong)


# -------------------------------------------------------------------------------------------------------------- voxels


@pytest.mark.parametrize("place", [0.0, 1e5])
def test_voxels_fill_a_tube_with_round_ends(place):
    tube = graph(np.array([[0, 0, 0], [2, 0, 0]]) + place, [(0, 1)], [0.5, 0.5])
    grid = to_voxels(tube, 0.05)
    index = np.array([voxel.grid_index for voxel in grid.get_voxels()])
    assert len(index) * 0.05**3 == pytest.approx(np.pi * 0.25 * (2 + 2 / 3), rel=0.01)
    assert (index.min(axis=0).tolist(), index.max(axis=0).tolist()) == ([0, 0, 0], [59, 19, 19])
    np.testing.assert_allclose(grid.origin, np.array([-0.5, -0.5, -0.5]) + place)
    asked = np.array([[1, 0.48, 0], [1, 0.52, 0], [-0.48, 0, 0], [-0.45, 0.45, 0]]) + place
    inside = grid.check_if_included(to_line_set(graph(asked, (), np.ones(4)), (0, 0, 0)).points)
    assert inside == [True, False, True, False]


def test_what_has_no_voxels():
    ball = graph([[0, 0, 0]], (), [1.0])
    assert len(to_voxels(ball, 0.1).get_voxels()) * 0.1**3 == pytest.approx(4 / 3 * np.pi, rel=0.02)
    for wrong, size, cause in (
        (ball, 0, "size = 0"),
        (ball, 1e-3, r"8e\+09 voxels"),
        (graph([[0, 0, 0]], (), [np.nan]), 0.1, "lacks some"),
        (graph((), (), ()), 0.1, "empty"),
    ):
        with pytest.raises(InvalidParameterError, match=cause):
            to_voxels(wrong, size)
