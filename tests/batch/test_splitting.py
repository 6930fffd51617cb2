"""Scenes taken apart into files: nothing is lost, and nothing is read more often than it must be."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest

from glsk_o3d import BatchError, FileFormatError, InvalidCloudError, InvalidParameterError
from glsk_o3d.batch import splitting
from glsk_o3d.batch.grid import tile_of
from glsk_o3d.batch.ledger import file_hash
from glsk_o3d.batch.splitting import Cut, PartFiles, Splitter
from glsk_o3d.io.scan import Scan
from glsk_o3d.io.scans import read_blocks, read_scan

TILES, LABELS = dict(tiles=2.0, overlap=0.25), dict(by="tree")


@pytest.fixture
def table(tmp_path):
    """Write points with labels, ``tree``, as a table; gives its path."""

    def write(points, labels, name="scene.csv"):
        columns = np.column_stack([points, labels])
        np.savetxt(tmp_path / name, columns, delimiter=",", header="x,y,z,tree", comments="", fmt="%.17g")
        return tmp_path / name

    return write


@pytest.fixture
def scene(table):
    """Points with labels, far away."""
    rng = np.random.default_rng(0)
    return table(rng.random((900, 3)) * [5, 3, 1] + 1e6 / 3, rng.integers(0, 4, 900))


@pytest.fixture
def passes(monkeypatch):
    """How often a file has been read; in small blocks."""
    count = []

    def read(path, where=None):
        count.append(path)
        return read_blocks(path, rows=70, where=where)

    monkeypatch.setattr(splitting, "read_blocks", read)
    return count


@pytest.fixture
def splitter(tmp_path):
    return lambda write=True, **cut: Splitter(tmp_path / "out", Cut(**cut), file_hash, write)


def test_a_file_per_label_in_one_pass(scene, passes, splitter):
    at = splitter(**LABELS, where="x > 333334")
    split = at.split("scene", scene)
    assert list(split.parts) == ["0", "1", "2", "3"]
    assert len(passes) == 1
    scan = read_scan(scene, "x > 333334")
    assert (split.points, split.dropped, split.input_hash) == (len(scan), 0, file_hash(scene))
    for label in split.parts:
        of_label = scan.positions[scan.attributes["tree"] == float(label)]
        np.testing.assert_array_equal(read_scan(at.file("scene", label)).positions, of_label)
    assert at.split("scene", scene) == split
    assert len(passes) == 1  # known
    assert set(splitter(**LABELS, where="tree > 1").split("scene", scene).parts) == {"2", "3"}  # another cut
    assert not at.file("scene", "0").exists()
    scene.write_text(scene.read_text() + "1,2,3,9\n")
    assert "9" in splitter(**LABELS, where="tree > 1").split("scene", scene).parts  # another scene
    assert len(passes) == 3


def test_a_file_per_tile_in_two_passes(scene, passes, splitter, tmp_path):
    looked = splitter(write=False, **TILES).split("scene", scene)
    assert not (tmp_path / "out").exists()
    passes.clear()
    at = splitter(**TILES)
    split = at.split("scene", scene)
    assert split == looked
    assert len(passes) == 2  # one for the box
    assert split.grid.counts == (3, 2, 1)
    positions = read_scan(scene).positions
    found = dict(split.grid.parted(positions))
    assert {tile_of(label) for label in split.parts} == set(found)
    for label in split.parts:
        np.testing.assert_array_equal(read_scan(at.file("scene", label)).positions, positions[found[tile_of(label)]])


@pytest.mark.parametrize("harm", [b"", b"[]", b"{}", b'{"version": 1}', b"\xff"])
def test_a_list_of_parts_that_is_damaged_is_made_anew(scene, splitter, tmp_path, harm):
    split = splitter(**TILES).split("scene", scene)
    kept = tmp_path / "out" / ".parts" / "scene.json"
    whole = kept.read_bytes()
    kept.write_bytes(harm or whole[:-20])
    assert splitter(**TILES).split("scene", scene) == split
    assert kept.read_bytes() == whole


@pytest.mark.parametrize("cut", [TILES, LABELS])
@pytest.mark.parametrize("label", ["../../../keep", "/keep", "a", "1-2", "1-0-0\n", "01-0-0", "1e400", "nan", "1e0"])
def test_a_list_with_labels_that_are_none_is_not_believed(scene, splitter, tmp_path, cut, label):
    split = splitter(**cut).split("scene", scene)
    path = tmp_path / "out" / ".parts" / "scene.json"
    kept = json.loads(path.read_text())
    kept["split"]["parts"] = {label: "some points", **kept["split"]["parts"]}
    path.write_text(json.dumps(kept))
    assert splitter(**cut).split("scene", scene) == split


def test_what_breaks_off_or_cannot_be_read_leaves_nothing_but_the_parts_of_others(
    scene, splitter, tmp_path, monkeypatch
):
    (tmp_path / "bad.ply").write_text("no")
    (tmp_path / "out").mkdir()
    with pytest.raises(FileFormatError):
        splitter(**TILES).split("in/bad", tmp_path / "bad.ply")
    assert not list((tmp_path / "out").iterdir())
    split = splitter(**LABELS).split("in/scene", scene)

    def broken(path, where=None):
        yield next(read_blocks(path, rows=100))
        raise OSError("the disk is gone")

    monkeypatch.setattr(splitting, "read_blocks", broken)
    with pytest.raises(OSError, match="the disk is gone"):
        splitter(**LABELS).split("in/bad", scene)
    assert not (tmp_path / "out" / ".parts" / "in" / "bad.json").exists()
    assert splitter(**LABELS).file("in/scene", "0").is_file()
    assert splitter(**LABELS).split("in/scene", scene) == split


@pytest.mark.parametrize("linked", ["", "scene", None])
def test_a_folder_of_somebody_else_stays_also_behind_a_link(scene, passes, splitter, tmp_path, linked):
    mine = tmp_path / "mine" / "scene" / "notes"
    mine.parent.mkdir(parents=True)
    mine.write_text("mine")
    parts = tmp_path / "out" / ".parts"
    if linked is None:
        parts.parent.mkdir()
        (tmp_path / "mine").rename(parts)
        mine = parts / "scene" / "notes"
    else:
        (tmp_path / "mine" / "scene.json").touch()
        (parts / linked).parent.mkdir(parents=True)
        (parts / linked).symlink_to(tmp_path / "mine", target_is_directory=True)
        (parts / "scene.json").touch()
    with pytest.raises(BatchError, match=r"scene: was not made by a batch, .*: move it away, or give"):
        splitter(**LABELS).split("scene", scene)
    assert (mine.read_text(), passes) == ("mine", [])
    assert not list(tmp_path.rglob("*.ply"))


def test_the_output_folder_may_be_a_link(scene, splitter, tmp_path):
    (tmp_path / "far").mkdir()
    (tmp_path / "out").symlink_to(tmp_path / "far", target_is_directory=True)
    assert len(splitter(**LABELS).split("scene", scene).parts) == 4


def test_a_splitting_that_is_killed_is_begun_anew(scene, splitter, tmp_path):
    code = (
        "import os, sys; from pathlib import Path; from glsk_o3d.batch import splitting as s\n"
        "s.PartFiles.close = lambda self: os._exit(9)\n"
        "out, scene = map(Path, sys.argv[1:])\n"
        "s.Splitter(out, s.Cut(by='tree'), lambda path: '', True).split('scene', scene)"
    )
    run = subprocess.run([sys.executable, "-c", code, str(tmp_path / "out"), str(scene)])
    assert run.returncode == 9
    assert splitter(**LABELS).file("scene", "0").exists()
    assert len(splitter(**LABELS).split("scene", scene).parts) == 4


def test_normals_and_colours_stay(tmp_path):
    rng = np.random.default_rng(1)
    scan = Scan(rng.random((10, 3)), colors=rng.integers(0, 256, (10, 3)) / 255, normals=rng.normal(size=(10, 3)))
    files = PartFiles(tmp_path)
    files.add(scan, {"a": np.arange(6)})
    files.add(scan, {"a": np.arange(6, 10), "b": np.arange(3)})
    files.close()
    again = read_scan(tmp_path / "a.ply")
    np.testing.assert_array_equal(again.positions, scan.positions)
    np.testing.assert_allclose(again.colors, scan.colors, atol=1e-7)
    np.testing.assert_allclose(again.normals, scan.normals, atol=1e-6)
    assert len(read_scan(tmp_path / "b.ply")) == 3


def test_points_that_are_not_finite_belong_to_no_tile(passes, splitter, table):
    points = np.random.default_rng(0).random((300, 3)) * 4
    points[[100, 101, 250]] = np.inf
    scene = table(points, np.zeros(300))
    with pytest.raises(InvalidCloudError, match=r"^3 of 300 points have NaN .* first at index 100: drop them"):
        splitter(**TILES).split("scene", scene)
    assert len(passes) == 1
    split = splitter(**TILES, drop_invalid=True).split("scene", scene)
    assert (split.points, split.dropped) == (300, 3)


def test_labels(splitter, table):
    corners = np.eye(3).repeat(4, axis=0)
    split = splitter(**LABELS).split("a", table(corners, [1.5] * 6 + [np.nan] * 3 + [np.inf, np.inf, -np.inf]))
    assert (list(split.parts), split.points, split.dropped) == (["1.5"], 12, 6)
    split = splitter(**LABELS).split("a", table(corners, [1.0, 1e18, -2.2250738585072014e-308] * 4))
    assert list(split.parts) == ["-2.2250738585072014e-308", "1", "1000000000000000000"]
    with pytest.raises(
        InvalidParameterError, match=r"tree: 1e\+300 is no label: it has too many digits for a file name"
    ):
        splitter(**LABELS).split("a", table(corners, [1.0, 1e300] * 6))


def test_tiles_without_number_are_refused(scene, splitter, monkeypatch):
    monkeypatch.setattr(splitting, "MOST_PARTS", 100)
    with pytest.raises(InvalidParameterError, match=r"has \d+ parts or more: give larger tiles"):
        splitter(tiles=0.2, overlap=0.025).split("scene", scene)


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no full disk here")
def test_a_full_disk_is_no_fault_of_the_scene(tmp_path):
    files = PartFiles(tmp_path)
    (tmp_path / "0.ply").symlink_to("/dev/full")
    with pytest.raises(BatchError, match="the parts of a scene cannot be written there: No space left"):
        files.add(Scan(np.zeros((9, 3))), {"0": np.arange(9)})
