"""JSON and npz: they keep every field, and nothing that makes no sense is believed."""

import io
import json
import os
import pickle
import zipfile

import numpy as np
import pytest

from glsk_o3d.data.skeleton import Skeleton
from glsk_o3d.errors import FileFormatError
from glsk_o3d.io.formats.fields import ARRAYS, REPRESENTATIVES, write_json, write_npz
from glsk_o3d.io.skeletons import read_skeleton, save_skeleton

both = pytest.mark.parametrize("ending", [".json", ".npz"])


@both
def test_json_and_npz_keep_everything(skeleton, bare, tmp_path, assert_identical, ending):
    for saved in (skeleton, bare, Skeleton((), (), (), (), (), ())):
        save_skeleton(saved, tmp_path / f"s{ending}")
        assert_identical(read_skeleton(tmp_path / f"s{ending}"), saved)


def test_json_is_strict_and_says_what_it_is(tree):
    def refuse(word):
        raise AssertionError(word)

    values = json.loads(write_json(tree), parse_constant=refuse)
    assert (values["format"], values["format_version"]) == ("glsk-o3d skeleton", 1)
    assert values["points"][0] == [None] * 3
    assert values["points"][1] == ["Infinity", "-Infinity", -0.0]
    numbers = [*values["report"]["iterations"][0].values()]
    assert None in numbers
    assert "Infinity" in numbers


@pytest.mark.parametrize(
    ("changes", "noun"),
    [
        *(({name: ...}, f"lacks {name}|valid") for name in (*ARRAYS, "report") if name != REPRESENTATIVES),
        ({"format": "other"}, "glsk-o3d skeleton"),
        ({"format_version": 2}, "format_version 2"),
        ({"edges": [[0, 6]]}, "edge"),
        ({"vertices": "abc"}, "valid"),
        ({"points": [[0, 0, 0]]}, "vertex_of_point"),
        ({"report": {"iterations": [{"iteration": 1}]}}, "missing"),
        ({"report": None}, "valid"),
    ],
)
def test_what_makes_no_sense(tree, tmp_path, changes, noun):
    def changed(values):
        return {name: value for name, value in (values | changes).items() if value is not ...}

    (tmp_path / "s.json").write_text(json.dumps(changed(json.loads(write_json(tree)))))
    arrays = changed(arrays_of(tree))
    if not isinstance(arrays.get("report"), dict | None):
        np.savez(tmp_path / "s.npz", **arrays)
    for path in tmp_path.iterdir():
        with pytest.raises(FileFormatError, match=noun if path.suffix == ".json" else path.name):
            read_skeleton(path)


# ----------------------------------------------------------------------------------------------------------------- npz


def arrays_of(skeleton):
    with np.load(io.BytesIO(write_npz(skeleton))) as archive:
        return dict(archive)


def test_npz_never_unpickles_nor_fills_the_memory(tree, tmp_path):
    class Bomb:
        def __reduce__(self):
            return os.mkdir, (str(tmp_path / "went off"),)

    arrays = arrays_of(tree)
    np.savez(tmp_path / "s.npz", **{**arrays, "points": np.array([Bomb()], object)})
    (tmp_path / "t.npz").write_bytes(pickle.dumps(Bomb()))
    for name in "st":
        with pytest.raises(FileFormatError):
            read_skeleton(tmp_path / f"{name}.npz")
    assert not (tmp_path / "went off").exists()
    np.savez_compressed(tmp_path / "s.npz", **{**arrays, "points": np.zeros((10**7, 3))})
    assert (tmp_path / "s.npz").stat().st_size < 10**6
    with pytest.raises(FileFormatError, match="67108864"):
        read_skeleton(tmp_path / "s.npz")


@pytest.mark.parametrize("version", [(1, 0), (2, 0), (3, 0)])
def test_arrays_of_all_versions_are_read(tree, tmp_path, version, assert_identical):
    with zipfile.ZipFile(tmp_path / "s.npz", "w") as archive:
        for name, values in arrays_of(tree).items():
            with archive.open(f"{name}.npy", "w") as stream:
                np.lib.format.write_array(stream, values, version)
    assert_identical(read_skeleton(tmp_path / "s.npz"), tree)


@pytest.mark.parametrize("version", [(1, 0), (2, 0), (3, 0)])
@pytest.mark.parametrize("shape", ["(9999999999999, 3)", "(3, 9999999)", "(1, 1, 6)", "(7, 3)"])
def test_arrays_that_are_larger_than_their_bytes_are_refused(tree, tmp_path, shape, version):
    with zipfile.ZipFile(tmp_path / "s.npz", "w") as archive:
        for name, values in arrays_of(tree).items():
            stream = io.BytesIO()
            np.lib.format.write_array(stream, values, version)
            content = stream.getvalue()
            if name == "vertices":
                end = content.index(b"\n")
                header = content[:end].replace(b"(6, 3)", shape.encode())
                content = header.rstrip().ljust(end) + content[end:]
            archive.writestr(f"{name}.npy", content)
    with pytest.raises(FileFormatError, match=r"not a valid \.npz skeleton"):
        read_skeleton(tmp_path / "s.npz")
