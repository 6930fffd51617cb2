import os

import pytest

from glsk_o3d.errors import FileFormatError
from glsk_o3d.io.formats.text_tables import holds_points
from glsk_o3d.io.scans import read_cloud
from glsk_o3d.io.skeletons import read_skeleton, read_truth


@pytest.mark.parametrize("read", [read_skeleton, read_cloud])
def test_what_is_not_a_file(tmp_path, read):
    with pytest.raises(FileNotFoundError, match=r"none\.ply"):
        read(tmp_path / "none.ply")
    (tmp_path / "folder.ply").mkdir()
    with pytest.raises(FileFormatError, match=r"folder\.ply.* is a folder"):
        read(str(tmp_path / "folder.ply"))


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no named pipes")
@pytest.mark.parametrize(
    ("read", "ending"),
    [(read_skeleton, "ply"), (read_cloud, "ply"), *((read_skeleton, ending) for ending in ("json", "npz", "swc"))]
    + [(read_truth, "npz")],
)
def test_what_may_never_end_is_not_waited_for(tmp_path, read, ending):
    path = tmp_path / f"pipe.{ending}"
    os.mkfifo(path)
    with pytest.raises(FileFormatError, match=rf"pipe\.{ending}: is a pipe or a device"):
        read(path)
    path.unlink()
    path.symlink_to("/dev/zero")
    with pytest.raises(FileFormatError, match=rf"pipe\.{ending}: is a pipe or a device"):
        read(path)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no named pipes")
def test_a_pipe_is_not_asked_for_points(tmp_path):
    os.mkfifo(tmp_path / "pipe.txt")
    assert not holds_points(tmp_path / "pipe.txt")
