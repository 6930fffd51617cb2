import io
import os
import pickle

import numpy as np
import pytest

from glsk_o3d.errors import FileFormatError
from glsk_o3d.io.formats import npz
from glsk_o3d.io.skeletons import read_skeleton


def test_npz_is_plain(tree, tmp_path):
    tree.save(tmp_path / "s.npz")
    with np.load(tmp_path / "s.npz", allow_pickle=False) as archive:
        assert archive["format"] == "glsk-o3d skeleton"
        np.testing.assert_array_equal(archive["vertices"], tree.vertices)


def test_npz_never_unpickles(tree, tmp_path):
    class Bomb:
        def __reduce__(self):
            return os.mkdir, (str(tmp_path / "went off"),)

    with np.load(io.BytesIO(npz.write(tree))) as archive:
        values = dict(archive)
    np.savez(tmp_path / "s.npz", **{**values, "points": np.array([Bomb()], object)})
    (tmp_path / "t.npz").write_bytes(pickle.dumps(Bomb()))
    for name in "st":
        with pytest.raises(FileFormatError):
            read_skeleton(tmp_path / f"{name}.npz")
    assert not (tmp_path / "went off").exists()


@pytest.mark.parametrize(
    "text",
    [
        "PK",
    ],
)
def test_damaged_files(tmp_path, text):
    (tmp_path / "s.npz").write_text(text, encoding="latin-1")
    with pytest.raises(FileFormatError, match=r"s\.npz"):
        read_skeleton(tmp_path / "s.npz")
