import io
import os
import pickle
import zipfile

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


def test_an_archive_that_would_fill_the_memory_is_refused_unread(tree, tmp_path, monkeypatch):
    with np.load(io.BytesIO(npz.write(tree))) as archive:
        values = dict(archive)
    np.savez_compressed(tmp_path / "s.npz", **{**values, "points": np.zeros((10**7, 3))})
    assert (tmp_path / "s.npz").stat().st_size < 10**6
    monkeypatch.setattr(np, "load", None)
    with pytest.raises(FileFormatError, match=r"would become more than 200 times as many: no skeleton packs so"):
        read_skeleton(tmp_path / "s.npz")


def test_what_is_no_part_of_a_skeleton_is_not_read(tree, tmp_path):
    tree.save(tmp_path / "s.npz")
    with zipfile.ZipFile(tmp_path / "s.npz", "a") as packed:
        packed.writestr("more.npy", b"no array")
    np.testing.assert_array_equal(read_skeleton(tmp_path / "s.npz").vertices, tree.vertices)


@pytest.mark.parametrize("shape", ["(9999999999999, 3)", "(3, 9999999)", "(1, 1, 6)", "(7, 3)"])
def test_arrays_that_are_larger_than_their_bytes_are_refused(tree, tmp_path, shape):
    data = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(npz.write(tree))) as packed, zipfile.ZipFile(data, "w") as lying:
        for name in packed.namelist():
            content = packed.read(name)
            if name == "vertices.npy":
                header = content[:128].replace(b"(6, 3)", shape.encode())
                content = header[:127].rstrip()[:127].ljust(127) + b"\n" + content[128:]
            lying.writestr(name, content)
    (tmp_path / "s.npz").write_bytes(data.getvalue())
    with pytest.raises(FileFormatError, match=r"vertices has shape"):
        read_skeleton(tmp_path / "s.npz")
