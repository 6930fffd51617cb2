import pytest

from glsk_o3d.errors import FileFormatError
from glsk_o3d.io.skeletons import read_skeleton


def test_polylines_have_a_line_per_branch(tree, forest, tmp_path):
    tree.save(tmp_path / "s.cgal")
    lines = (tmp_path / "s.cgal").read_text().splitlines()
    assert sorted(int(line.split()[0]) for line in lines) == [2, 3, 3]
    forest.save(tmp_path / "s.polylines.txt")
    lines = (tmp_path / "s.polylines.txt").read_text().splitlines()
    assert sorted(int(line.split()[0]) for line in lines) == [1, 2, 3]


@pytest.mark.parametrize(
    "text",
    [
        "2 0 0 0 1 1\n",
        "0\n",
        "1.5 0 0 0 1 1\n",
    ],
)
def test_damaged_files(tmp_path, text):
    (tmp_path / "s.cgal").write_text(text, encoding="latin-1")
    with pytest.raises(FileFormatError, match=r"s\.cgal"):
        read_skeleton(tmp_path / "s.cgal")
