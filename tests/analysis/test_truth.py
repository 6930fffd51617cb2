"""What is no known axis, in arrays and in files."""

import re

import numpy as np
import pytest

from glsk_o3d import read_truth
from glsk_o3d.analysis import Truth, compare
from glsk_o3d.errors import FileFormatError, InvalidParameterError

LINE = [[0, 0, 0], [1, 0, 0]]


@pytest.mark.parametrize(
    ("nodes", "edges", "radii", "message"),
    [
        (np.empty((0, 3)), np.empty((0, 2), int), [], "no nodes"),
        (LINE, [[0, 1]], [1, 0], "positive, finite radius"),
        (LINE, [[0, 1]], [1, np.inf], "positive, finite radius"),
        (LINE, [[0, 1]], [1], "positive, finite radius"),
        ([[0, 0, np.inf], [1, 0, 0]], [[0, 1]], [1, 1], "not finite"),
        (LINE, [[0, 5]], [1, 1], "not there"),
        (LINE, [[0.5, 1]], [1, 1], "whole numbers"),
        ([[0, 0]], [[0, 1]], [1, 1], "of no use"),
    ],
)
def test_truths_that_are_none(nodes, edges, radii, message):
    with pytest.raises(InvalidParameterError, match=message):
        Truth(nodes, edges, radii)


def test_truth_files(ring, tmp_path, axis_of):
    np.savez(tmp_path / "truth.npz", nodes=ring.nodes, edges=ring.edges, radii=ring.radii, more=1)
    axis = axis_of(ring)
    for name in ("s.npz", "s.json", "s.ply"):
        axis.save(tmp_path / name)
    for path in tmp_path.iterdir():
        assert compare(axis, read_truth(path)).error < 1e-12


def test_files_without_a_truth(ring, tmp_path, axis_of):
    np.savez(tmp_path / "other.npz", nodes=ring.nodes)
    np.savez(tmp_path / "bad.npz", nodes=ring.nodes, edges=ring.edges, radii=0 * ring.radii)
    axis_of(ring).save(tmp_path / "noradii.obj")
    data = (tmp_path / "bad.npz").read_bytes()
    (tmp_path / "cut.npz").write_bytes(data[: len(data) // 2])
    (tmp_path / "flipped.npz").write_bytes(data[:200] + bytes([data[200] ^ 255]) + data[201:])
    for path in tmp_path.iterdir():
        with pytest.raises(FileFormatError, match=re.escape(str(path))):
            read_truth(path)
    with pytest.raises(FileNotFoundError, match="no such file"):
        read_truth(tmp_path / "none.npz")
