import numpy as np
import pytest

from glsk_o3d import Skeleton
from glsk_o3d.errors import FileFormatError
from glsk_o3d.io.skeletons import read_skeleton


def test_swc_as_others_write_it(tmp_path):
    (tmp_path / "s.swc").write_text("# x\n\n 30 3 1 1 1 0.5 7\n7 1 0 0 0 2 -1\n9 3 2 0 0 .5 30 extra\n")
    back = read_skeleton(tmp_path / "s.swc")
    np.testing.assert_array_equal(back.edges, [[0, 1], [0, 2]])
    np.testing.assert_array_equal(back.radii, [0.5, 2, 0.5])


def test_swc_refuses_loops_or_cuts_the_longest_edges(loop, tmp_path):
    with pytest.raises(FileFormatError, match=r"2 loop.*cut_loops=True"):
        loop.save(tmp_path / "s.swc")
    assert not list(tmp_path.iterdir())
    loop.save(tmp_path / "s.swc", cut_loops=True)
    tree = read_skeleton(tmp_path / "s.swc")
    assert len(tree.edges) == len(loop.edges) - loop.n_loops
    assert (tree.n_loops, tree.n_components) == (0, 1)
    # Of two loops sharing the chord both the chord and one more edge go: the chord is the longest.
    lengths = np.sort(loop.edge_lengths)
    assert tree.length == pytest.approx(lengths[:5].sum())
    assert tree.edge_lengths.max() < lengths[-1]


def test_swc_keeps_edges_of_no_length(make, tmp_path):
    make(np.zeros((3, 3)), [[0, 1], [1, 2]]).save(tmp_path / "s.swc")
    assert len(read_skeleton(tmp_path / "s.swc").edges) == 2


def test_coordinates_of_a_map_are_shifted_along_the_axes_that_need_it(tmp_path, caplog):
    vertices = np.array([[5e5, 5.4e6, -0.05], [5e5 + 0.25, 5.4e6 + 0.125, 10.0]])
    far = Skeleton(vertices, [[0, 1]], [0.01, 0.01], (), (), ())
    far.save(tmp_path / "s.swc")
    assert "# global_shift: 500000.0 5400000.0 0.0" in (tmp_path / "s.swc").read_text()
    assert "global shift of (500000.00, 5400000.00, 0)" in caplog.text
    np.testing.assert_array_equal(read_skeleton(tmp_path / "s.swc").vertices, vertices)


def test_comments_of_other_alphabets(tmp_path):
    (tmp_path / "s.swc").write_bytes("# Bäume aus Köln\n1 0 0 0 0 1 -1\n".encode("latin-1"))
    assert len(read_skeleton(tmp_path / "s.swc").vertices) == 1
