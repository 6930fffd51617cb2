"""Tiles partition space, and scenes are split into a file for each: nothing is lost, and read twice at most."""

from dataclasses import asdict

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glsk_o3d import FileFormatError, InvalidCloudError
from glsk_o3d.apps.batch import tiles as module
from glsk_o3d.apps.batch.ledger import file_hash
from glsk_o3d.apps.batch.tiles import Cut, Grid, add_to_parts, divide, known_split, tile_name, tile_of
from glsk_o3d.io import streaming
from glsk_o3d.io.scan import Scan
from glsk_o3d.io.scans import read_blocks, read_scan

TILES = dict(tiles=2.0, overlap=0.25)


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
    assert [(axis, round(place, 4)) for axis, place in grid.seams((0, 0, 0))] == [(0, round(10 / 3 - 0.125, 4))]
    assert tile_of(tile_name((3, 0, 12))) == (3, 0, 12)


@pytest.fixture
def table(tmp_path):
    """Write points as a table; gives its path."""

    def write(points):
        np.savetxt(tmp_path / "scene.xyz", points, fmt="%.17g")
        return tmp_path / "scene.xyz"

    return write


@pytest.fixture
def scene(table):
    """Points far away."""
    return table(np.random.default_rng(0).random((900, 3)) * [5, 3, 1] + 1e6 / 3)


@pytest.fixture
def passes(monkeypatch):
    """How often a file has been read; in small blocks."""
    count = []

    def read(path, **options):
        count.append(path)
        return read_blocks(path, rows=70, **options)

    for reader in (module, streaming):
        monkeypatch.setattr(reader, "read_blocks", read)
    return count


@pytest.fixture
def split(tmp_path):
    """Split a scene into the folder ``parts``, unless it is there."""

    def call(scene, **options):
        cut, folder = Cut(**options), tmp_path / "parts"
        of = [str(scene), file_hash(scene), asdict(cut)]
        return known_split(folder, of) or divide(scene, folder, cut, of)

    return call


def test_a_file_per_tile_in_two_passes(scene, passes, split, tmp_path):
    actual = split(scene, **TILES, where="x > 333334")
    assert len(passes) == 2  # one for the box
    positions = read_scan(scene, "x > 333334").positions
    assert (actual.grid.counts, actual.points, actual.dropped) == ((3, 2, 1), len(positions), 0)
    rows = dict(actual.grid.parted(positions))
    assert {tile_of(label) for label in actual.labels} == set(rows)
    for label in actual.labels:
        part = read_scan(tmp_path / "parts" / f"{label}.ply").positions
        np.testing.assert_array_equal(part, positions[rows[tile_of(label)]])
    assert split(scene, **TILES, where="x > 333334") == actual
    assert len(passes) == 2  # known
    assert len(split(scene, tiles=5.0, overlap=0.25).labels) == 1  # another cut
    assert not (tmp_path / "parts" / "2-1-0.ply").exists()
    scene.write_text(scene.read_text() + "333340 333333 333333\n")
    assert len(split(scene, tiles=5.0, overlap=0.25).labels) == 2  # another scene
    kept = tmp_path / "parts" / "parts.json"
    for damaged in (b"[]", b'{"of": 1}', b"\xff"):
        kept.write_bytes(damaged)
        assert len(split(scene, tiles=5.0, overlap=0.25).labels) == 2


def test_what_breaks_off_or_cannot_be_read_leaves_nothing(scene, split, tmp_path, monkeypatch):
    (tmp_path / "bad.ply").write_text("no")
    with pytest.raises(FileFormatError):
        split(tmp_path / "bad.ply", **TILES)

    def broken(path, where=None):
        yield next(read_blocks(path, rows=100))
        raise OSError("the disk is gone")

    monkeypatch.setattr(module, "read_blocks", broken)
    with pytest.raises(OSError, match="the disk is gone"):
        split(scene, **TILES)
    assert not (tmp_path / "parts").exists()


def test_normals_and_colours_stay(tmp_path):
    rng = np.random.default_rng(1)
    scan = Scan(rng.random((10, 3)), colors=rng.integers(0, 256, (10, 3)) / 255, normals=rng.normal(size=(10, 3)))
    counts = module.Counter()
    add_to_parts(tmp_path, scan, {"a": np.arange(6)}, counts)
    add_to_parts(tmp_path, scan, {"a": np.arange(6, 10), "b": np.arange(3)}, counts)
    again = read_scan(tmp_path / "a.ply")
    np.testing.assert_array_equal(again.positions, scan.positions)
    np.testing.assert_allclose(again.colors, scan.colors, atol=1e-7)
    np.testing.assert_allclose(again.normals, scan.normals, atol=1e-6)
    assert len(read_scan(tmp_path / "b.ply")) == 3


def test_points_that_are_not_finite(table, passes, split):
    points = np.random.default_rng(0).random((300, 3)) * 4
    points[[100, 101, 250]] = np.inf
    scene = table(points)
    with pytest.raises(InvalidCloudError, match=r"^3 of 300 points have NaN .* first at index 100: drop them"):
        split(scene, **TILES)
    assert len(passes) == 1
    actual = split(scene, **TILES, drop_invalid=True)
    assert (actual.points, actual.dropped) == (300, 3)
