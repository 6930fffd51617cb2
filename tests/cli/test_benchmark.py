"""`glsk benchmark`: from nothing to a table, in lines, files and JSON; and what it says when something is wrong."""

import json
import subprocess
import sys

import pytest

CHOICE = ("--families", "tubes,trees", "--seeds", "100:102", "--variants", "clean, scan2", "--jobs", 1)
"""Rods in the place of the shapes, of which one cloud of eight is not scored."""


@pytest.fixture
def bench(invoke, rods):
    """The name of a folder with a benchmark."""
    assert invoke("benchmark", "make", "bench", *CHOICE, "-q").exit_code == 0
    return "bench"


def quoted(words):
    return " ".join(f"'{word}'" for word in words)


def test_from_nothing_to_a_table(invoke, rods, program, tmp_path):
    made = invoke("benchmark", "make", "bench", *CHOICE)
    assert (made.exit_code, made.stderr) == (0, "")
    rows = dict(line.split(maxsplit=1) for line in made.stdout.splitlines())
    facts = dict(folder="bench", version="v1", shapes="4", clouds="8", scored="7", whole="no")
    assert {name: rows[name] for name in facts} == facts
    good = quoted(program("write(skeleton)"))
    ran = invoke("benchmark", "run", "bench", "good", "--command", good, "--ending", ".obj")
    assert (ran.exit_code, ran.stderr) == (0, "")
    assert ran.stdout.splitlines() == ["answers  good", "done     7", "failed   0", "skipped  0"]
    (tmp_path / "bad").mkdir()
    (tmp_path / "good" / "tubes_100_clean.obj").rename(tmp_path / "bad" / "tubes_100_clean.obj")
    for name, failures in (("good", 1), ("bad", 6)):
        scored = invoke("benchmark", "score", "bench", name, "-o", f"{name}.json")
        assert (scored.exit_code, scored.stderr) == (0, "")
        lines = scored.stdout.splitlines()
        assert lines[:3] == [f"name          {name}", "clouds        7", f"failures      {failures}"]
        assert lines[-1] == f"wrote {name}.json"
    shown = invoke("benchmark", "table", "bad.json", "good.json")
    assert (shown.exit_code, shown.stderr) == (0, "")
    assert "**7 clouds of 4 shapes**" in shown.stdout
    assert shown.stdout.index("| good | 7 | 1 |") < shown.stdout.index("| bad | 7 | 6 |")
    wrote = invoke("benchmark", "table", "bad.json", "good.json", "-o", "t.md", "-o", "t.json")
    assert wrote.stdout == "wrote t.md\nwrote t.json\n"
    assert (tmp_path / "t.md").read_text() == shown.stdout
    assert json.loads((tmp_path / "t.json").read_text())["entries"][0]["name"] == "good"


def test_json(invoke, rods, program):
    words = ("--families", "tubes", "--families", "trees", "--seeds", "100", "--seeds", "101", "--variants", "clean")
    made = json.loads(invoke("benchmark", "make", "bench", *words, "--variants", "scan2", "--jobs", 1, "--json").stdout)
    assert (made["clouds"], made["scored"], made["whole"]) == (8, 7, False)
    command = quoted(program("if name == 'tubes_100_clean': sys.exit(1)\nwrite(skeleton)"))
    words = ("benchmark", "run", "bench", "out", "--command", command, "--ending", ".obj", "--json")
    ran = invoke(*words)
    assert ran.stderr == "glsk: warning: tubes_100_clean: exit code 1\n"
    assert json.loads(ran.stdout)["failures"] == {"tubes_100_clean": "exit code 1"}
    assert json.loads(invoke(*words, "--retry", "-q").stdout)["skipped"] == 6
    words = ("-o", "s.json", "--name", "mine", "--json")
    scored = json.loads(invoke("benchmark", "score", "bench", "out", *words).stdout)
    assert (scored["name"], scored["failures"], scored["files"]) == ("mine", 1, ["s.json"])
    table = json.loads(invoke("benchmark", "table", "s.json", "--json").stdout)
    assert table["entries"][0]["all"]["perfect"] == scored["perfect"]


@pytest.mark.parametrize(
    ("code", "words", "said"),
    [
        (2, ("make", "new", "--seeds", "a:b"), "--seeds a:b: write FIRST:BEYOND"),
        (2, ("make", "new", "--families", "tube"), "did you mean 'tubes'"),
        (1, ("run", "none", "out"), "make a benchmark with 'glsk benchmark make none' first"),
        (2, ("run", "bench", "out", "--command", "true {cloud}"), "has no {skeleton}"),
        (1, ("score", "bench", "none", "-o", "s.json"), "no such folder of answers"),
        (2, ("score", "bench", "bench", "-o", "s.csv"), "its name ends in .json"),
        (1, ("sample", "new", "none"), "none: has no meshes"),
        (1, ("table", "bench/benchmark.json"), "not the scores of a benchmark"),
        (2, ("table", "bench/benchmark.json", "-o", "t.csv"), "its name ends in .md or .json"),
    ],
)
@pytest.mark.usefixtures("bench")
def test_what_is_wrong_is_one_line(refused, code, words, said):
    assert said in refused(code, "benchmark", *words)


def test_making_scoring_and_tables_need_no_open3d(bench, tmp_path):
    (tmp_path / "answers").mkdir()
    (tmp_path / "answers" / "tubes_100_clean.obj").write_text("v 0 0 0\nv 1 0 0\nl 1 2\n")
    code = """
import sys
import glsk_bench.making
from glsk_o3d.cli.main import app
app(["benchmark", "score", "bench", "answers", "-o", "s.json"], standalone_mode=False)
app(["benchmark", "table", "s.json"], standalone_mode=False)
print(*sorted({name.partition('.')[0] for name in sys.modules}))
"""
    run = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
    loaded = set(run.stdout.splitlines()[-1].split())
    assert "scipy" in loaded
    assert not {"open3d", "matplotlib", "networkx", "igl"} & loaded
