"""What JSON and npz have in common: they keep every field."""

import dataclasses
import io
import json
import math
from contextlib import nullcontext

import numpy as np
import pytest

from glsk_o3d.errors import FileFormatError
from glsk_o3d.io.formats import json as json_format
from glsk_o3d.io.formats import npz
from glsk_o3d.io.formats.fields import ARRAYS, LATER
from glsk_o3d.io.skeletons import read_skeleton, save_skeleton
from glsk_o3d.skeleton import Skeleton


@pytest.mark.parametrize("ending", [".json", ".npz"])
def test_json_and_npz_keep_everything(skeleton, tmp_path, assert_identical, ending):
    save_skeleton(skeleton, tmp_path / f"s{ending}")
    assert_identical(read_skeleton(tmp_path / f"s{ending}"), skeleton)


@pytest.mark.parametrize("ending", [".json", ".npz"])
def test_skeletons_without_cloud_or_vertices(bare, tmp_path, assert_identical, ending):
    for skeleton in (bare, Skeleton((), (), (), (), (), ())):
        save_skeleton(skeleton, tmp_path / f"s{ending}")
        assert_identical(read_skeleton(tmp_path / f"s{ending}"), skeleton)


@pytest.mark.parametrize("ending", [".json", ".npz"])
def test_numbers_of_the_report_come_back_as_they_were(tree, tmp_path, ending):
    tree.save(tmp_path / f"s{ending}")
    records = (tree.report.iterations, read_skeleton(tmp_path / f"s{ending}").report.iterations)
    for before, after in zip(*records, strict=True):
        for a, b in zip(dataclasses.astuple(before), dataclasses.astuple(after), strict=True):
            assert type(b) in (int, float)
            assert isinstance(b, float) == isinstance(a, float)
            assert a == b or (math.isnan(a) and math.isnan(b))


def doctored(tree, **changes):
    values = json.loads(json_format.write(tree))
    values.update(changes)
    return json.dumps({key: value for key, value in values.items() if value is not ...}).encode()


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"format": "other"}, "glsk-o3d skeleton"),
        ({"format_version": 2}, "format_version 2.*update glsk-o3d"),
        ({"edges": [[0, 6]]}, "edge.* 6"),
        ({"edges": [[-1, 2]]}, "edge.* 6"),
        ({"edges": [[0, 1.5]]}, "edges"),
        ({"edges": [0, 1]}, "edges"),
        ({"vertices": [[0, 1]]}, "vertices"),
        ({"vertices": "abc"}, "valid"),
        ({"radii": [1.0]}, "1 radii.* 6 "),
        ({"confidence": [0.5] * 5}, "5 confidences.* 6 "),
        ({"confidence": []}, "0 confidences.* 6 "),
        ({"confidence": [[0.5]] * 6}, "confidence"),
        ({"confidence": [0.5, 7, 0, 1, 1, 1]}, "a confidence is 7"),
        ({"half_width": [0.5] * 5}, "5 half_width.* 6 "),
        ({"half_thickness": [9, 0, 0, 0, 0, 0]}, "a half_thickness is 9"),
        ({"half_thickness": [-1, 0, 0, 0, 0, 0]}, "a half_thickness is -1"),
        ({"radii": [0.5, -0.25, 0, 1, 1, 1]}, "a radius is -0.25"),
        ({"vertices": [[0, 0, None]] * 6}, "not finite"),
        ({"vertex_of_point": [9] * 7}, "vertex_of_point"),
        ({"points": [[0, 0, 0]]}, "points.*vertex_of_point.*length"),
        ({"report": {"iterations": [{"iteration": 1}]}}, "missing"),
        ({"report": None}, "valid"),
    ],
)
def test_json_that_makes_no_sense(tree, tmp_path, changes, says):
    (tmp_path / "s.json").write_bytes(doctored(tree, **changes))
    with pytest.raises(FileFormatError, match=says):
        read_skeleton(tmp_path / "s.json")


@pytest.mark.parametrize("name", [*ARRAYS, "report"])
def test_json_and_npz_that_lack_something(tree, tmp_path, name):
    values = json.loads(json_format.write(tree))
    del values[name]
    (tmp_path / "s.json").write_text(json.dumps(values))
    with np.load(io.BytesIO(npz.write(tree))) as archive:
        np.savez(tmp_path / "s.npz", **{key: archive[key] for key in archive.files if key != name})
    for ending in (".json", ".npz"):
        with nullcontext() if name in LATER else pytest.raises(FileFormatError):
            read_skeleton(tmp_path / f"s{ending}")


@pytest.mark.parametrize("format", [json_format, npz])
def test_files_from_before_the_half_axes(tree, format, monkeypatch, assert_identical):
    old = dataclasses.replace(tree, half_width=None, half_thickness=None)
    monkeypatch.setattr(format, "ARRAYS", [name for name in ARRAYS if name not in LATER])
    written = format.write(old)
    monkeypatch.undo()
    assert len(written) < len(format.write(old))
    assert_identical(format.read(written), old)
