"""``glsk edit`` and ``glsk convert``."""

import json

import numpy as np
import pytest

from glsk_o3d import Skeleton, read_skeleton
from glsk_o3d.cli.options import SKELETON_ENDINGS, TREE_ENDINGS
from glsk_o3d.io.skeletons import FORMATS


@pytest.fixture
def file(tmp_path):
    """A ring with a tail of two edges and a twig, and another piece."""
    turn = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    circle = np.column_stack([np.cos(turn), np.sin(turn), 0 * turn])
    vertices = np.concatenate([circle, [[2, 0, 0], [3, 0, 0], [2, 0.2, 0], [9, 0, 0], [9, 1, 0]]])
    edges = [*((i, i + 1) for i in range(11)), (0, 11), (0, 12), (12, 13), (12, 14), (15, 16)]
    path = tmp_path / "raw.json"
    Skeleton(vertices, edges, np.ones(17), (), (), ()).save(path)
    return path


def test_all_at_once(invoke, file, tmp_path):
    words = ["--largest", "--cut-loops", "--root", "x", "--prune-length", "0.5", "--smooth", "2", "--vertices", "5"]
    result = invoke("edit", file, "-o", tmp_path / "new.swc", "-o", tmp_path / "new.json", *words)
    assert result.exit_code == 0, result.output
    lines = result.stdout.splitlines()
    assert lines[0] == "kept one of 2 components"
    assert lines[1].startswith("cut a loop at (")
    assert lines[2].startswith("grows from (-1, ")
    assert lines[3].startswith("pruned 1 of ")
    assert lines[4] == "kept 5 of 14 vertices"
    new = read_skeleton(tmp_path / "new.json")
    assert (new.n_components, new.n_loops, len(new.vertices)) == (1, 0, 5)
    assert read_skeleton(tmp_path / "new.swc").length == pytest.approx(new.length)


def test_simplify_by_tolerance_in_silence(invoke, file, tmp_path):
    result = invoke("edit", file, "-o", tmp_path / "new.ply", "--simplify", 10, "-q")
    assert (result.exit_code, result.output) == (0, "")
    assert read_skeleton(tmp_path / "new.ply").n_loops == 1


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--simplify", "1", "--vertices", "3"], "simplify needs either a tolerance or n"),
        (["--root", "x"], "the skeleton has 1 loops: only trees have a root"),
        (["--cut-loops", "--root", "99"], "root = 99: there are vertices"),
        (["--prune-order", "0"], "branches have an order in a tree"),
    ],
)
def test_refuses(refused, file, words, message):
    assert message in refused(2, "edit", file, "-o", "new.ply", *words)


def test_refuses_to_write_over_what_it_reads_or_nowhere(invoke, file):
    assert invoke("edit", file, "-o", file).exit_code == 2
    assert invoke("edit", file).exit_code == 2


def test_convert(invoke, file, tmp_path):
    result = invoke("convert", file, tmp_path / "a.ply", tmp_path / "a.graphml", tmp_path / "a.obj")
    assert result.exit_code == 0, result.output
    assert result.stdout.count("wrote") == 3 or "a.graphml" in result.stdout
    for name in ("a.ply", "a.graphml", "a.obj"):
        assert read_skeleton(tmp_path / name).n_loops == 1


def test_convert_to_a_format_of_trees(invoke, file, tmp_path):
    refused = invoke("convert", file, tmp_path / "a.swc")
    assert refused.exit_code == 1
    assert "loop" in refused.stderr
    assert invoke("convert", file, tmp_path / "a.swc", "--cut-loops").exit_code == 0
    assert invoke("convert", file, tmp_path / "a.nope").exit_code == 2


@pytest.fixture
def line(tmp_path):
    """Three edges along x, from the thin end to the thick one."""
    path = tmp_path / "line.json"
    Skeleton([[x, 0, 0] for x in range(-1, 3)], [(0, 1), (1, 2), (2, 3)], [0.1, 0.2, 0.3, 0.4], (), (), ()).save(path)
    return path


@pytest.mark.parametrize(
    ("word", "x"), [("x", -1), ("-x", 2), ("thickest", 2), ("1", 0), ("0.9,0.1,0", 1), ("-0.9,0.1,0", -1)]
)
def test_a_root_in_all_words(invoke, line, tmp_path, word, x):
    for name in ("swc", "mtg", "plant.csv", "urdf", "glb"):
        result = invoke("convert", line, tmp_path / f"t.{name}", "--root", word)
        assert (result.exit_code, result.stderr) == (0, ""), result.output
        read_skeleton(line).save(tmp_path / f"expected.{name}", root=[x, 0, 0])
        assert (tmp_path / f"t.{name}").read_bytes() == (tmp_path / f"expected.{name}").read_bytes()
    assert read_skeleton(tmp_path / "t.swc").vertices[0].tolist() == [x, 0, 0]
    result = invoke("edit", line, "-o", tmp_path / "e.json", "--root", word)
    assert result.stdout.startswith(f"grows from ({x}, 0, 0)\n")
    told = json.loads(invoke("tree", line, "--json", "--root", word).stdout)
    assert told["root"] == [x, 0, 0] or 0 <= x <= 1  # from inside a branch a tree grows from an end of it


def test_a_root_is_for_formats_of_trees(invoke, refused, line, tmp_path):
    assert refused(2, "convert", line, tmp_path / "a.ply", "--root", "x").endswith("for others use 'glsk edit'")
    both = [tmp_path / "a.ply", tmp_path / "a.swc"]
    assert invoke("convert", line, *both, "--root", "-x").exit_code == 0
    assert [read_skeleton(path).vertices[0].tolist() for path in both] == [[-1, 0, 0], [2, 0, 0]]
    assert "a.swc: root = 7: there are vertices 0 to 3" in invoke("convert", line, both[1], "--root", "7").stderr


def test_formats_of_trees_are_those_of_the_table():
    assert {ending for ending, format in FORMATS.items() if format.trees} == {f".{ending}" for ending in TREE_ENDINGS}
    assert set(FORMATS) == {f".{ending}" for ending in SKELETON_ENDINGS}
