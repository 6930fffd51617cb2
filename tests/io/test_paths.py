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
