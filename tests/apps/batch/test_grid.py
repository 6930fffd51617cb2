"""Tiles: they partition space, and each takes what is near it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glsk_o3d import InvalidParameterError
from glsk_o3d.apps.batch.tiles import Grid, checked_sizes, tile_name, tile_of


@given(
    st.integers(0, 10_000), st.tuples(*[st.floats(0.1, 6)] * 3), st.floats(0.7, 3), st.floats(0.01, 0.25), st.booleans()
)
def test_every_point_goes_to_all_tiles_that_are_near_and_to_no_other(seed, extent, size, share, far):
    points = np.random.default_rng(seed).random((200, 3)) * extent + 1e5 * far
    grid = Grid.over(points.min(axis=0), points.max(axis=0), size, share * size)
    parts = dict(grid.parted(points))
    own = np.zeros(len(points), int)
    for tile in np.ndindex(*grid.counts):
        low, high = grid.box(tile, grid.overlap)
        slack = 1e-9  # on the border itself roundings decide
        sure = ((points > low + slack) & (points < high - slack)).all(axis=1)
        perhaps = ((points > low - slack) & (points < high + slack)).all(axis=1)
        rows = parts.get(tile, np.empty(0, int))
        assert set(np.flatnonzero(sure)) <= set(rows) <= set(np.flatnonzero(perhaps))
        assert (np.diff(rows) > 0).all()
        low, high = grid.box(tile)
        own += ((points >= low) & (points < high)).all(axis=1)
    assert (own == 1).all()
    assert (np.array(grid.cell) <= size + 1e-9).all()


def test_an_axis_is_cut_only_where_it_is_longer_than_a_tile():
    grid = Grid.over(np.zeros(3), np.array([10.0, 4.0, 3.0]), 4, 0.5)
    assert grid.counts == (3, 1, 1)
    assert grid.cell[0] == pytest.approx(10 / 3)
    assert grid.box((1, 0, 0))[0].tolist() == [pytest.approx(10 / 3), -np.inf, -np.inf]
    assert [(axis, round(at, 4)) for axis, at in grid.seams((0, 0, 0))] == [(0, round(10 / 3 - 0.125, 4))]
    assert tile_of(tile_name((3, 0, 12))) == (3, 0, 12)


@pytest.mark.parametrize(
    ("sizes", "message"),
    [
        ((0, None), "tiles = 0: must be above 0"),
        (("abc", None), "tiles = 'abc': must be a number"),
        ((4, "1"), r"overlap .* = '1': must be a number"),
        ((4, 1.1), r"overlap .at most a quarter of tiles. = 1\.1: must be at most 1\.0"),
    ],
)
def test_sizes(sizes, message):
    with pytest.raises(InvalidParameterError, match=message):
        checked_sizes(*sizes)
    assert checked_sizes(4, None) == (4, 0.5)  # an eighth
    assert checked_sizes(np.float32(4), np.int64(1)) == (4.0, 1.0)
