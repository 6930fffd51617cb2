"""Scenes taken apart into files: nothing is lost, and nothing is read more often than it must be."""

import subprocess
import sys
from collections import Counter
from dataclasses import asdict

import numpy as np
import pytest

from glsk_o3d import FileFormatError, InvalidCloudError
from glsk_o3d.apps.batch import tiles as batch_tiles
from glsk_o3d.apps.batch.ledger import file_hash
from glsk_o3d.apps.batch.tiles import Cut, add_to_parts, divide, known_split, tile_of
from glsk_o3d.io import streaming
from glsk_o3d.io.scan import Scan
from glsk_o3d.io.scans import read_blocks, read_scan

TILES = dict(tiles=2.0, overlap=0.25)


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

    for module in (batch_tiles, streaming):
        monkeypatch.setattr(module, "read_blocks", read)
    return count


@pytest.fixture
def split(tmp_path):
    """Take a scene apart into the folder ``parts``, unless it is there."""

    def call(scene, **options):
        cut, folder = Cut(**options), tmp_path / "parts"
        of = [str(scene), file_hash(scene), asdict(cut)]
        return known_split(folder, of) or divide(scene, folder, cut, of)

    return call


def test_a_file_per_tile_in_two_passes(scene, passes, split, tmp_path):
    found = split(scene, **TILES, where="x > 333334")
    assert len(passes) == 2  # one for the box
    positions = read_scan(scene, "x > 333334").positions
    assert (found.grid.counts, found.points, found.dropped) == ((3, 2, 1), len(positions), 0)
    rows = dict(found.grid.parted(positions))
    assert {tile_of(label) for label in found.labels} == set(rows)
    for label in found.labels:
        part = read_scan(tmp_path / "parts" / f"{label}.ply").positions
        np.testing.assert_array_equal(part, positions[rows[tile_of(label)]])
    assert split(scene, **TILES, where="x > 333334") == found
    assert len(passes) == 2  # known
    assert len(split(scene, tiles=5.0, overlap=0.25).labels) == 1  # another cut
    assert not (tmp_path / "parts" / "2-1-0.ply").exists()
    scene.write_text(scene.read_text() + "333340 333333 333333\n")
    assert len(split(scene, tiles=5.0, overlap=0.25).labels) == 2  # another scene
    assert len(passes) == 6


@pytest.mark.parametrize("harm", [b"[]", b"{}", b'{"of": 1}', b"\xff"])
def test_what_is_known_of_parts_and_damaged_is_found_out_again(scene, split, tmp_path, harm):
    found = split(scene, **TILES)
    kept = tmp_path / "parts" / "parts.json"
    whole = kept.read_bytes()
    kept.write_bytes(harm)
    assert split(scene, **TILES) == found
    assert kept.read_bytes() == whole


def test_what_breaks_off_or_cannot_be_read_leaves_nothing(scene, split, tmp_path, monkeypatch):
    (tmp_path / "bad.ply").write_text("no")
    with pytest.raises(FileFormatError):
        split(tmp_path / "bad.ply", **TILES)

    def broken(path, where=None):
        yield next(read_blocks(path, rows=100))
        raise OSError("the disk is gone")

    monkeypatch.setattr(batch_tiles, "read_blocks", broken)
    with pytest.raises(OSError, match="the disk is gone"):
        split(scene, **TILES)
    assert not (tmp_path / "parts").exists()


def test_a_splitting_that_is_killed_is_begun_anew(scene, split, tmp_path):
    code = (
        "import os, sys; from pathlib import Path; from glsk_o3d.apps.batch import tiles as s\n"
        "s.write_json = lambda path, data: os._exit(9)\n"
        "s.divide(Path(sys.argv[1]), Path(sys.argv[2]), s.Cut(2.0, 0.25), [])"
    )
    run = subprocess.run([sys.executable, "-c", code, str(scene), str(tmp_path / "parts")])
    assert run.returncode == 9
    assert (tmp_path / "parts" / "0-0-0.ply").exists()
    assert len(split(scene, **TILES).labels) == 6


def test_normals_and_colours_stay(tmp_path):
    rng = np.random.default_rng(1)
    scan = Scan(rng.random((10, 3)), colors=rng.integers(0, 256, (10, 3)) / 255, normals=rng.normal(size=(10, 3)))
    counts = Counter()
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
    found = split(scene, **TILES, drop_invalid=True)
    assert (found.points, found.dropped) == (300, 3)
