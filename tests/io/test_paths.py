import os

import pytest

from glsk_o3d.errors import FileFormatError
from glsk_o3d.io.scans import read_cloud
from glsk_o3d.io.skeletons import read_skeleton


@pytest.mark.parametrize("read", [read_skeleton, read_cloud])
def test_what_is_not_a_file(tmp_path, read):
    with pytest.raises(FileNotFoundError, match=r"none\.ply"):
        read(tmp_path / "none.ply")
    (tmp_path / "folder.ply").mkdir()
    with pytest.raises(FileFormatError, match=r"folder\.ply.* is a folder"):
        read(str(tmp_path / "folder.ply"))


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no named pipes")
@pytest.mark.parametrize("read", [read_skeleton, read_cloud])
def test_a_pipe_is_not_waited_for(tmp_path, read):
    os.mkfifo(tmp_path / "pipe.ply")
    with pytest.raises(FileFormatError, match=r"pipe\.ply: is a pipe or a device"):
        read(tmp_path / "pipe.ply")
