"""``glsk edit`` and ``glsk convert``."""

import numpy as np
import pytest

from glsk_o3d import Skeleton, read_skeleton


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
    ("words", "code"),
    [
        (["--simplify", "1", "--vertices", "3"], 2),
        (["--root", "x"], 2),  # there is a loop
        (["--cut-loops", "--root", "99"], 2),
        (["--prune-order", "0"], 2),
        (["--prune-length", "-1"], 2),
    ],
)
def test_refuses(invoke, file, tmp_path, words, code):
    result = invoke("edit", file, "-o", tmp_path / "new.ply", *words)
    assert result.exit_code == code
    assert not (tmp_path / "new.ply").exists()


def test_says_what_to_add_where_a_root_needs_a_tree(invoke, file, tmp_path):
    told = invoke("edit", file, "-o", tmp_path / "new.ply", "--root", "x").stderr
    assert " ".join(told.split()).endswith("1 loops: only trees have a root: add --cut-loops")


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
