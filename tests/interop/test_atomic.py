"""Files appear complete or not at all."""

import os
import stat

import pytest

from glsk_o3d.errors import FileFormatError
from glsk_o3d.interop.atomic import check_ending, remove_unfinished, write_atomically, write_json


def test_interrupted_write_leaves_the_old_file(tmp_path):
    def interrupt(temporary):
        temporary.write_text("half")
        assert (temporary.parent, temporary.suffix) == (tmp_path, ".png")
        raise KeyboardInterrupt

    (tmp_path / "p.png").write_text("old")
    with pytest.raises(KeyboardInterrupt):
        write_atomically(tmp_path / "p.png", interrupt)
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("p.png", "old")]


def test_written_files_look_like_ordinary_ones(tmp_path):
    (tmp_path / "plain").write_text("")
    write_atomically(tmp_path / "new", lambda temporary: temporary.write_text("x"))
    assert (tmp_path / "new").stat().st_mode == (tmp_path / "plain").stat().st_mode
    (tmp_path / "new").chmod(0o600)
    write_atomically(tmp_path / "new", lambda temporary: temporary.write_text("y"))
    assert stat.S_IMODE((tmp_path / "new").stat().st_mode) == 0o600
    (tmp_path / "link").symlink_to("new")
    write_atomically(tmp_path / "link", lambda temporary: temporary.write_text("z"))
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "new").read_text() == "z"
    long = tmp_path / ("n" * 250)
    write_atomically(long, lambda temporary: temporary.write_text("x"))
    assert long.exists()


@pytest.mark.parametrize("name", ["folder.ply", os.devnull])
def test_folders_and_devices_are_not_replaced(tmp_path, name):
    (tmp_path / "folder.ply").mkdir()
    with pytest.raises(OSError, match="not a file"):
        write_json(tmp_path / name, {})


def test_json_that_cannot_be_written_leaves_nothing(tmp_path):
    with pytest.raises(FileNotFoundError, match="no such folder"):
        write_json(tmp_path / "missing" / "s.json", {})
    with pytest.raises(ValueError):
        write_json(tmp_path / "s.json", {"x": float("nan")})
    assert not list(tmp_path.iterdir())


def test_endings_of_files_to_be_written():
    check_ending("p.PNG", "preview is a picture", ".png", ".svg")
    with pytest.raises(FileFormatError, match=r"p\.jpg: .*\.png or \.svg"):
        check_ending("p.jpg", "preview is a picture", ".png", ".svg")


def test_temporary_files_of_killed_processes_alone_are_removed(tmp_path):
    others = [tmp_path / ".hidden", tmp_path / "a" / f"{'0' * 32}.ply", tmp_path / ".ledger.lock"]
    temporary = [tmp_path / f".{'0f' * 16}.ply", tmp_path / "a" / f".{'12' * 16}"]
    (tmp_path / "a").mkdir()
    for path in (*others, *temporary):
        path.touch()
    remove_unfinished(tmp_path)
    assert {path for path in tmp_path.rglob("*") if path.is_file()} == {*others}
