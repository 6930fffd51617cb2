"""Skeletons of tiles joined: analytic curves seen by tiles that differ a little, and clouds through the pipeline."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glsk_o3d import Skeleton, samples
from glsk_o3d.analysis.curves import along, pieces
from glsk_o3d.apps.batch.joining import Strands, join_tiles
from glsk_o3d.apps.batch.tiles import Grid

NONE = np.empty((0, 3))


def axis_of(sample, step=0.02):
    """The axis of a sample as a skeleton whose edges are as short as those that the refiner leaves."""
    return refined(curve(sample.nodes, sample.edges, sample.radii), step)


def refined(axis, step):
    row, part = pieces(axis.vertices, axis.edges, step)
    inner = along(axis.edges, row, part, np.column_stack([axis.vertices, axis.radii]))
    n, first = len(axis.vertices), np.searchsorted(row, np.arange(len(axis.edges)))
    at = n + np.arange(len(row))
    start = np.where(np.isin(np.arange(len(row)), first), axis.edges[row, 0], at - 1)
    last = np.append(first[1:], len(row)) - 1
    edges = np.concatenate([np.stack([start, at], axis=1), np.stack([at[last], axis.edges[:, 1]], axis=1)])
    values = np.concatenate([np.column_stack([axis.vertices, axis.radii]), inner])
    return curve(values[:, :3], np.sort(edges, axis=1), values[:, 3])


def curve(vertices, edges, radii):
    vertices, radii = np.asarray(vertices, float), np.broadcast_to(radii, len(vertices))
    confidence = np.linspace(0, 1, len(vertices))
    return Skeleton(vertices, edges, radii, np.empty(0), NONE, NONE, confidence=confidence)


def rod(start, stop, radius=0.05):
    return refined(curve([start, stop], [[0, 1]], radius), radius / 2)


def together(*curves):
    first = np.cumsum([0, *(len(item.vertices) for item in curves)])
    return curve(
        np.concatenate([item.vertices for item in curves]),
        np.concatenate([item.edges + at for item, at in zip(curves, first, strict=False)]),
        np.concatenate([item.radii for item in curves]),
    )


def seen(axis, grid, stray=0.0, seed=0):
    """What every tile would make of a curve: what lies in it and its overlap, each with an error of its own."""
    rng, actual = np.random.default_rng(seed), {}
    for tile in np.ndindex(*grid.counts):
        part = Strands.of(axis).within(*grid.box(tile, grid.overlap))
        if len(part.values):
            moved = part.values[:, :3] + rng.normal(size=3) * stray
            moved += rng.uniform(-0.1, 0.1, moved.shape) * stray
            actual[tile] = replace(curve(moved, part.edges, part.values[:, 3]), confidence=part.values[:, 4])
    return actual


def structure(skeleton):
    return skeleton.n_components, skeleton.n_loops, len(skeleton.leaves)


AXES = {
    "tree": axis_of(samples.tree(8, forks=3, length=0.9, radius=0.05)),
    "sauropod": axis_of(samples.sauropod(8, cameras=None)),
    "rings": axis_of(samples.two_rings(8)),
    "fork": axis_of(samples.y_junction(8)),
    "helix": axis_of(samples.helix(8)),
}


@settings(max_examples=40)
@given(st.sampled_from(sorted(AXES)), st.tuples(*[st.floats(0, 1)] * 3), st.integers(0, 1000))
def test_wherever_the_seams_are_the_graph_is_that_of_the_whole(name, offset, seed):
    axis = AXES[name]
    size, overlap = 1.0, 0.25
    low = axis.vertices.min(axis=0) - np.array(offset) * size
    grid = Grid.over(low, axis.vertices.max(axis=0), size, overlap)
    stray = 0.05 * axis.radii.min()
    joined, seams = join_tiles(seen(axis, grid, stray, seed), grid)
    assert structure(joined) == structure(axis)
    assert seams.unmatched == 0
    assert joined.length == pytest.approx(axis.length, rel=0.02)  # a jog of the stray at every seam


def three_tiles(overlap=0.2):
    return Grid((0, -1, -1), (1, 2, 2), (3, 1, 1), overlap)


@pytest.mark.parametrize("shift", [-0.05, 0.0, 1e-12, 0.02, 0.05, 0.075])
def test_a_curve_along_a_seam_is_kept_once(shift):
    grid = Grid((-1, -1, -1), (1, 1, 2), (2, 2, 1), 0.2)
    axis = together(rod([shift, shift, -0.9], [shift, shift, 0.9]), rod([-0.9, 0.5, 0], [0.9, 0.5, 0]))
    for seed in range(3):
        joined, seams = join_tiles(seen(axis, grid, 0.005, seed), grid)
        assert structure(joined) == (2, 0, 4)
        assert joined.length == pytest.approx(axis.length, rel=0.02)
        assert seams.unmatched == 0


@pytest.mark.parametrize("shift", [0.0, 0.03, 0.045, 0.05, 0.055])
def test_limbs_that_leave_a_trunk_in_a_seam_stay_with_it(shift):
    trunk, grid = (
        np.array([[shift, 0, z] for z in np.linspace(-0.9, 0.9, 7)]),
        Grid((-1, -1, -1), (1, 2, 2), (2, 1, 1), 0.2),
    )
    limbs = [[side * 0.9, 0.1 * side, z] for side, z in zip((-1, 1, -1, 1, -1), trunk[1:6, 2], strict=True)]
    edges = [[i, i + 1] for i in range(6)] + [[i + 1, 7 + i] for i in range(5)]
    axis = refined(curve([*trunk, *limbs], edges, 0.04), 0.02)
    for seed in range(10):
        joined, seams = join_tiles(seen(axis, grid, 0.004, seed), grid)
        assert structure(joined) == (1, 0, 7)
        assert seams.unmatched == 0


def test_rods_side_by_side_are_not_swapped():
    grid, radius, lean = three_tiles(), 0.05, 0.3
    gap = 2.2 * radius
    rods = [rod([0.1, side * gap / 2 - lean, 0], [2.9, side * gap / 2 + lean, 0], radius) for side in (-1, 1)]
    for seed in range(10):
        joined, seams = join_tiles(seen(together(*rods), grid, 0.2 * radius, seed), grid)
        assert structure(joined) == (2, 0, 4)
        assert (seams.joined, seams.unmatched) == (4, 0)
        offset = joined.vertices[:, 1] - lean * (joined.vertices[:, 0] - 1.5) / 1.4
        for piece in range(2):
            assert len(set(np.sign(offset[joined.component_of_vertex == piece]))) == 1


def test_a_curve_without_errors_is_unchanged():
    axis, grid = rod([0.1, 0, 0], [2.9, 0.3, 0]), three_tiles()
    flat = {tile: replace(part, half_width=3 * part.radii) for tile, part in seen(axis, grid).items()}
    joined, seams = join_tiles(flat, grid)
    assert (seams.joined, seams.unmatched, seams.messages(grid)) == (2, 0, [])
    assert structure(joined) == (1, 0, 2)
    assert joined.length == pytest.approx(axis.length, rel=1e-12)
    np.testing.assert_allclose(joined.half_width, 3 * joined.radii)
    np.testing.assert_allclose(joined.half_thickness, joined.radii)
    cut = joined.vertices[~np.isin(joined.vertices[:, 0], axis.vertices[:, 0])]
    assert sorted(cut[:, 0]) == pytest.approx([1.05, 2.05])  # a quarter of the overlap beyond the faces


def test_the_order_of_tiles_does_not_matter():
    grid = Grid((-1, -1, -1), (1, 1, 2), (2, 2, 1), 0.2)
    actual = seen(AXES["sauropod"], grid, 0.002)
    one, other = (join_tiles(dict(items), grid)[0] for items in (actual.items(), reversed(actual.items())))
    for name in ("vertices", "edges", "radii", "confidence"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_a_part_that_one_tile_lost_is_reported_and_kept():
    grid = three_tiles()
    actual = seen(rod([0.1, 0, 0], [2.9, 0, 0]), grid)
    del actual[1, 0, 0]
    joined, seams = join_tiles(actual, grid)
    assert structure(joined) == (2, 0, 4)
    assert (seams.joined, seams.unmatched) == (0, 2)
    (message,) = seams.messages(grid)
    assert message.startswith("2 of 2 cuts at seams have nothing to meet on the other side")


def test_an_end_of_the_object_at_a_seam_is_no_cut():
    for stop in (1.02, 1.05, 1.06, 1.2):
        joined, seams = join_tiles(seen(rod([0.1, 0, 0], [stop, 0, 0]), three_tiles(), 0.01), three_tiles())
        assert structure(joined) == (1, 0, 2)
        assert seams.unmatched == 0


def test_parts_too_thick_for_the_overlap_are_reported():
    grid = three_tiles(0.1)
    _, seams = join_tiles(seen(rod([0.1, 0, 0], [2.9, 0, 0], 0.06), grid), grid)
    assert seams.messages(grid) == [
        "at seams there are parts thicker than the overlap of 0.1 allows, radius up to 0.06: give 0.16 or more"
    ]
    grid = three_tiles(0.02)
    actual = {(i, 0, 0): rod([i + 0.1, 0, 0], [i + 0.9, 0, 0], 0.08) for i in range(3)}
    joined, seams = join_tiles(actual, grid)
    assert (structure(joined), seams.joined, seams.unmatched) == ((3, 0, 6), 0, 0)
    (message,) = seams.messages(grid)
    assert message.startswith("at seams there are parts thicker than the overlap of 0.02 allows")
    thin = {tile: replace(item, radii=item.radii / 2) for tile, item in actual.items()}
    assert join_tiles(thin, grid)[1].messages(grid) == []


def test_a_limb_that_one_tile_lost_at_a_trunk_is_tied_to_it():
    grid = Grid((-1, -1, -1), (1, 2, 2), (2, 1, 1), 0.2)
    tree = curve([[0, 0, -0.9], [0, 0, 0], [0, 0, 0.9], [0.9, 0, 0]], [[0, 1], [1, 2], [1, 3]], 0.09)
    actual = {(0, 0, 0): rod([0, 0, -0.9], [0, 0, 0.9], 0.09), (1, 0, 0): refined(tree, 0.02)}
    joined, seams = join_tiles(actual, grid)
    assert structure(joined) == (1, 0, 3)
    assert (seams.joined, seams.unmatched) == (1, 0)


def test_nothing_at_all():
    joined, seams = join_tiles({}, three_tiles())
    assert (len(joined.vertices), seams.joined) == (0, 0)
    empty = curve(NONE, np.empty((0, 2)), np.empty(0))
    joined, _ = join_tiles({(0, 0, 0): empty, **seen(rod([1.2, 0, 0], [1.8, 0, 0]), three_tiles())}, three_tiles())
    assert structure(joined) == (1, 0, 2)


def test_vertices_without_edges_are_kept_once():
    axis = curve([[0.5, 0, 0], [1.0, 0, 0], [1.04, 0.5, 0]], np.empty((0, 2)), 0.05)
    joined, _ = join_tiles(seen(axis, three_tiles(), 0.002), three_tiles())
    assert structure(joined) == (3, 0, 0)


# ---------------------------------------------------------------------------------------------- through the pipeline
