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
from glsk_o3d.io.clouds.blocks import read_blocks
from glsk_o3d.io.clouds.scanned import Scan
from glsk_o3d.io.scans import read_scan


@pytest.fixture
def scene(tmp_path):
    """Points with everything, in three dimensions."""
    rng = np.random.default_rng(0)
    table = np.column_stack([rng.random((900, 3)) * [5, 3, 1] + 1e6 / 3, rng.integers(0, 4, 900) * 1.0])
    rows = np.rec.fromarrays(table.T, dtype=[(name, "<f8") for name in ("x", "y", "z", "tree")])
    header = "".join(f"property double {name}\n" for name in rows.dtype.names)
    path = tmp_path / "scene.ply"
    path.write_bytes(
        f"ply\nformat binary_little_endian 1.0\nelement vertex 900\n{header}end_header\n".encode() + rows.tobytes()
    )
    return path


@pytest.fixture
def passes(monkeypatch):
    """How often a file has been read; in small blocks."""
    count = []

    def read(path, where=None):
        count.append(path)
        return read_blocks(path, rows=70, where=where)

    monkeypatch.setattr(splitting, "read_blocks", read)
    return count


def splitter(tmp_path, write=True, **cut):
    return Splitter(tmp_path / "out", Cut(**cut), file_hash, write)


def test_a_file_per_label_in_one_pass(scene, passes, tmp_path):
    at = splitter(tmp_path, by="tree", where="x > 333334")
    split = at.split("scene", scene)
    assert split.parts == {str(i): f"where tree == {i}.0" for i in range(4)}
    assert len(passes) == 1
    scan = read_scan(scene, "x > 333334")
    assert (split.points, split.dropped, split.input_hash) == (len(scan), 0, file_hash(scene))
    for label in split.parts:
        of_label = scan.positions[scan.attributes["tree"] == float(label)]
        np.testing.assert_array_equal(read_scan(at.file("scene", label)).positions, of_label)
    assert at.split("scene", scene) == split
    assert len(passes) == 1  # known


def test_a_file_per_tile_in_two_passes(scene, passes, tmp_path):
    at = splitter(tmp_path, tiles=2.0, overlap=0.25)
    split = at.split("scene", scene)
    assert len(passes) == 2  # one for the box
    assert split.grid.counts == (3, 2, 1)
    positions = read_scan(scene).positions
    found = dict(split.grid.parted(positions))
    assert {tile_of(label) for label in split.parts} == set(found)
    for label in split.parts:
        np.testing.assert_array_equal(read_scan(at.file("scene", label)).positions, positions[found[tile_of(label)]])


def test_looking_writes_nothing(scene, passes, tmp_path):
    looked = splitter(tmp_path, write=False, tiles=2.0, overlap=0.25).split("scene", scene)
    assert not (tmp_path / "out").exists()
    assert looked == splitter(tmp_path, tiles=2.0, overlap=0.25).split("scene", scene)


def test_another_scene_or_another_cut_is_taken_apart_anew(scene, passes, tmp_path):
    splitter(tmp_path, by="tree").split("scene", scene)
    assert set(splitter(tmp_path, by="tree", where="tree > 1").split("scene", scene).parts) == {"2", "3"}
    assert not (tmp_path / "out" / ".parts" / "scene" / "0.ply").exists()
    data = scene.read_bytes()
    scene.write_bytes(data[:-8] + np.array(9.0).tobytes())
    assert "9" in splitter(tmp_path, by="tree", where="tree > 1").split("scene", scene).parts
    assert len(passes) == 3


@pytest.mark.parametrize("harm", [b"", b"[]", b"{}", b'{"version": 1}', b"\xff"])
def test_a_list_of_parts_that_is_damaged_is_made_anew(scene, passes, tmp_path, harm):
    split = splitter(tmp_path, tiles=2.0, overlap=0.25).split("scene", scene)
    told = tmp_path / "out" / ".parts" / "scene.json"
    whole = told.read_bytes()
    told.write_bytes(harm or whole[:-20])
    assert splitter(tmp_path, tiles=2.0, overlap=0.25).split("scene", scene) == split
    assert told.read_bytes() == whole


@pytest.mark.parametrize("cut", [dict(tiles=2.0, overlap=0.25), dict(by="tree")])
@pytest.mark.parametrize("label", ["../../../keep", "/keep", "a", "1-2", "1-0-0\n", "01-0-0", "1e400", "nan", "1e0"])
def test_a_list_with_labels_that_are_none_is_not_believed(scene, passes, tmp_path, cut, label):
    split = splitter(tmp_path, **cut).split("scene", scene)
    path = tmp_path / "out" / ".parts" / "scene.json"
    told = json.loads(path.read_text())
    told["split"]["parts"] = {label: "some points", **told["split"]["parts"]}
    path.write_text(json.dumps(told))
    assert splitter(tmp_path, **cut).split("scene", scene) == split


def test_what_breaks_off_is_not_believed(scene, monkeypatch, tmp_path):
    def broken(path, where=None):
        yield next(read_blocks(path, rows=100))
        raise OSError("the disk is gone")

    monkeypatch.setattr(splitting, "read_blocks", broken)
    with pytest.raises(OSError, match="the disk is gone"):
        splitter(tmp_path, by="tree").split("scene", scene)
    assert not (tmp_path / "out" / ".parts" / "scene.json").exists()


def test_what_cannot_be_read_leaves_nothing_but_the_parts_of_others(scene, tmp_path):
    (tmp_path / "bad.ply").write_text("no")
    (tmp_path / "out").mkdir()
    for name in ("bad", "in/bad"):
        with pytest.raises(FileFormatError):
            splitter(tmp_path, tiles=2.0, overlap=0.25).split(name, tmp_path / "bad.ply")
        assert not list((tmp_path / "out").iterdir())
    split = splitter(tmp_path, by="tree").split("in/scene", scene)
    with pytest.raises(FileFormatError):
        splitter(tmp_path, by="tree").split("in/bad", tmp_path / "bad.ply")
    assert splitter(tmp_path, by="tree").file("in/scene", "0").is_file()
    assert splitter(tmp_path, by="tree").split("in/scene", scene) == split


@pytest.mark.parametrize("linked", ["", "scene"])
def test_parts_do_not_go_through_a_link(scene, passes, tmp_path, linked):
    mine = tmp_path / "mine" / "scene" / "notes"
    mine.parent.mkdir(parents=True)
    mine.write_text("mine")
    link = tmp_path / "out" / ".parts" / linked
    link.parent.mkdir(parents=True)
    (tmp_path / "mine" / "scene.json").touch()
    if linked:
        link.with_suffix(".json").touch()
    link.symlink_to(tmp_path / "mine", target_is_directory=True)
    with pytest.raises(BatchError, match=r"scene: is not of a batch, .*: move it away, or give"):
        splitter(tmp_path, by="tree").split("scene", scene)
    assert (mine.read_text(), passes) == ("mine", [])
    assert not list((tmp_path / "mine").rglob("*.ply"))


def test_a_folder_of_somebody_else_stays(scene, passes, tmp_path):
    notes = tmp_path / "out" / ".parts" / "scene" / "notes"
    notes.parent.mkdir(parents=True)
    notes.touch()
    with pytest.raises(BatchError, match="is not of a batch"):
        splitter(tmp_path, by="tree").split("scene", scene)
    assert notes.exists()
    assert not passes


def test_the_output_folder_may_be_a_link(scene, tmp_path):
    (tmp_path / "far").mkdir()
    (tmp_path / "out").symlink_to(tmp_path / "far", target_is_directory=True)
    assert len(splitter(tmp_path, by="tree").split("scene", scene).parts) == 4


def test_a_splitting_that_is_killed_is_begun_anew(scene, tmp_path):
    code = (
        "import os, sys; from pathlib import Path; from glsk_o3d.batch import splitting as s\n"
        "s.PartFiles.close = lambda self: os._exit(9)\n"
        "out, scene = map(Path, sys.argv[1:])\n"
        "s.Splitter(out, s.Cut(by='tree'), lambda path: '', True).split('scene', scene)"
    )
    run = subprocess.run([sys.executable, "-c", code, str(tmp_path / "out"), str(scene)])
    assert run.returncode == 9
    assert splitter(tmp_path, by="tree").file("scene", "0").exists()
    assert len(splitter(tmp_path, by="tree").split("scene", scene).parts) == 4


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


def test_points_that_are_not_finite_belong_to_no_tile(tmp_path):
    points = np.random.default_rng(0).random((50, 3)) * 4
    points[7] = np.nan
    np.savetxt(tmp_path / "scene.xyz", points)
    with pytest.raises(InvalidCloudError, match="1 of 50 points have NaN"):
        splitter(tmp_path, tiles=2.0, overlap=0.25).split("scene", tmp_path / "scene.xyz")
    split = splitter(tmp_path, tiles=2.0, overlap=0.25, drop_invalid=True).split("scene", tmp_path / "scene.xyz")
    assert (split.points, split.dropped) == (50, 1)


def test_points_that_are_not_finite_are_counted_over_all_blocks(passes, tmp_path, write_points):
    points = np.random.default_rng(0).random((300, 3)) * 4
    points[[100, 101, 250]] = np.inf
    scene = write_points(tmp_path / "scene.ply", points)
    with pytest.raises(InvalidCloudError, match=r"^3 of 300 points have NaN .* first at index 100: drop them"):
        splitter(tmp_path, tiles=2.0, overlap=0.25).split("scene", scene)
    assert len(passes) == 1


def test_points_without_a_label_are_told(tmp_path):
    table = np.column_stack([np.eye(3).repeat(4, axis=0), [1.5] * 6 + [np.nan] * 3 + [np.inf, np.inf, -np.inf]])
    np.savetxt(tmp_path / "a.csv", table, delimiter=",", header="x,y,z,tree", comments="")
    split = splitter(tmp_path, by="tree").split("a", tmp_path / "a.csv")
    assert (list(split.parts), split.points, split.dropped) == (["1.5"], 12, 6)


def test_a_label_that_no_name_can_hold_is_refused(tmp_path):
    table = np.column_stack([np.eye(3).repeat(4, axis=0), [1.0, 1e18, -2.2250738585072014e-308, 1e300] * 3])
    for rows, refused in ((table, True), (table[table[:, 3] < 1e300], False)):
        np.savetxt(tmp_path / "a.csv", rows, delimiter=",", header="x,y,z,tree", comments="", fmt="%.17g")
        if refused:
            with pytest.raises(InvalidParameterError, match=r"tree: 1e\+300 is no label"):
                splitter(tmp_path, by="tree").split("a", tmp_path / "a.csv")
        else:
            labels = splitter(tmp_path, by="tree").split("a", tmp_path / "a.csv").parts
            assert list(labels) == ["-2.2250738585072014e-308", "1", "1000000000000000000"]


def test_tiles_without_number_are_refused(scene, tmp_path, monkeypatch):
    monkeypatch.setattr(splitting, "MOST_PARTS", 100)
    with pytest.raises(InvalidParameterError, match=r"has \d+ parts or more: give larger tiles"):
        splitter(tmp_path, tiles=0.2, overlap=0.025).split("scene", scene)


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no full disk here")
def test_a_full_disk_is_no_fault_of_the_scene(scene, tmp_path):
    folder = tmp_path / "out" / ".parts" / "scene"
    folder.mkdir(parents=True)
    files = PartFiles(folder)
    (folder / "0.ply").symlink_to("/dev/full")
    with pytest.raises(BatchError, match="the parts of a scene cannot be written there: No space left"):
        files.add(Scan(np.zeros((9, 3))), {"0": np.arange(9)})
