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
    for each in (skeleton, bare, Skeleton((), (), (), (), (), ())):
        save_skeleton(each, tmp_path / f"s{ending}")
        assert_identical(read_skeleton(tmp_path / f"s{ending}"), each)


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


MISSING = object()


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        *(({name: MISSING}, f"lacks {name}|valid") for name in (*ARRAYS, "report") if name != REPRESENTATIVES),
        ({"format": "other"}, "glsk-o3d skeleton"),
        ({"format_version": 2}, "format_version 2.*update glsk-o3d"),
        ({"edges": [[0, 6]]}, "edge.* 6"),
        ({"vertices": "abc"}, "valid"),
        ({"points": [[0, 0, 0]]}, "vertex_of_point: has 7 rows for 1 points"),
        ({"report": {"iterations": [{"iteration": 1}]}}, "missing"),
        ({"report": None}, "valid"),
    ],
)
def test_what_makes_no_sense(tree, tmp_path, changes, says):
    def changed(held):
        return {name: value for name, value in (held | changes).items() if value is not MISSING}

    (tmp_path / "s.json").write_text(json.dumps(changed(json.loads(write_json(tree)))))
    with np.load(io.BytesIO(write_npz(tree))) as archive:
        held = changed(dict(archive))
    if not isinstance(held.get("report"), dict | None):
        np.savez(tmp_path / "s.npz", **held)
    for path in tmp_path.iterdir():
        with pytest.raises(FileFormatError, match=says if path.suffix == ".json" else path.name):
            read_skeleton(path)


# ----------------------------------------------------------------------------------------------------------------- npz


def test_npz_never_unpickles_nor_fills_the_memory(tree, tmp_path):
    class Bomb:
        def __reduce__(self):
            return os.mkdir, (str(tmp_path / "went off"),)

    with np.load(io.BytesIO(write_npz(tree))) as archive:
        held = dict(archive)
    np.savez(tmp_path / "s.npz", **{**held, "points": np.array([Bomb()], object)})
    (tmp_path / "t.npz").write_bytes(pickle.dumps(Bomb()))
    for name in "st":
        with pytest.raises(FileFormatError):
            read_skeleton(tmp_path / f"{name}.npz")
    assert not (tmp_path / "went off").exists()
    np.savez_compressed(tmp_path / "s.npz", **{**held, "points": np.zeros((10**7, 3))})
    assert (tmp_path / "s.npz").stat().st_size < 10**6
    with pytest.raises(FileFormatError, match=r"at most 67108864 are allowed"):
        read_skeleton(tmp_path / "s.npz")


@pytest.mark.parametrize("version", [(1, 0), (2, 0), (3, 0)])
def test_arrays_of_all_versions_are_read(tree, tmp_path, version, assert_identical):
    with np.load(io.BytesIO(write_npz(tree))) as archive, zipfile.ZipFile(tmp_path / "s.npz", "w") as written:
        for name in archive:
            with written.open(f"{name}.npy", "w") as stream:
                np.lib.format.write_array(stream, archive[name], version)
    assert_identical(read_skeleton(tmp_path / "s.npz"), tree)


@pytest.mark.parametrize("version", [1, 2, 3])
@pytest.mark.parametrize("shape", ["(9999999999999, 3)", "(3, 9999999)", "(1, 1, 6)", "(7, 3)"])
def test_arrays_that_are_larger_than_their_bytes_are_refused(tree, tmp_path, shape, version):
    with zipfile.ZipFile(io.BytesIO(write_npz(tree))) as packed, zipfile.ZipFile(tmp_path / "s.npz", "w") as lying:
        for name in packed.namelist():
            content = packed.read(name)
            if name == "vertices.npy":
                header = content[:128].replace(b"(6, 3)", shape.encode())
                content = header[:127].rstrip()[:127].ljust(127) + b"\n" + content[128:]
                if version > 1:  # four bytes for the length of the header, not two
                    content = content[:6] + bytes([version]) + content[7:10] + b"\0\0" + content[10:]
            lying.writestr(name, content)
    with pytest.raises(FileFormatError, match=r"not a valid \.npz skeleton"):
        read_skeleton(tmp_path / "s.npz")
