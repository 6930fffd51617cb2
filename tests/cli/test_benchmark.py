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
    created = json.loads(invoke("benchmark", "make", "bench", *CHOICE, "--json").stdout)
    assert (created["clouds"], created["scored"], created["whole"]) == (8, 7, False)
    return "bench"


def quoted(words):
    return " ".join(f"'{word}'" for word in words)


def test_from_a_program_to_a_table(invoke, bench, program, tmp_path):
    command = quoted(program("if name == 'tubes_100_clean': sys.exit(1)\nwrite(skeleton)"))
    words = ("benchmark", "run", bench, "good", "--command", command, "--ending", ".obj")
    ran = invoke(*words)
    assert (ran.exit_code, ran.stderr) == (0, "glsk: warning: tubes_100_clean: exit code 1\n")
    assert ran.stdout.splitlines() == ["answers  good", "done     6", "failed   1", "skipped  0"]
    assert json.loads(invoke(*words, "--json", "--retry", "-q").stdout)["skipped"] == 6
    (tmp_path / "bad").mkdir()
    (tmp_path / "good" / "tubes_101_clean.obj").rename(tmp_path / "bad" / "tubes_101_clean.obj")
    scores = {}
    for name, failures in (("good", 2), ("bad", 6)):
        result = invoke("benchmark", "score", bench, name, "-o", f"{name}.json", "--json")
        assert (result.exit_code, result.stderr) == (0, "")
        scores[name] = json.loads(result.stdout)
        assert (scores[name]["failures"], scores[name]["files"]) == (failures, [f"{name}.json"])
    shown = invoke("benchmark", "table", "bad.json", "good.json")
    assert shown.stdout.index("| good | 7 | 2 |") < shown.stdout.index("| bad | 7 | 6 |")
    wrote = invoke("benchmark", "table", "bad.json", "good.json", "-o", "t.md", "-o", "t.json")
    assert wrote.stdout == "wrote t.md\nwrote t.json\n"
    assert (tmp_path / "t.md").read_text() == shown.stdout
    entries = json.loads((tmp_path / "t.json").read_text())["entries"]
    assert entries[0]["name"] == "good"
    assert entries[0]["all"]["perfect"] == scores["good"]["perfect"]


@pytest.mark.parametrize(
    ("code", "words", "message"),
    [
        (2, ("make", "new", "--seeds", "a:b"), "--seeds a:b: write FIRST:BEYOND"),
        (2, ("make", "new", "--families", "tube"), "did you mean 'tubes'"),
        (1, ("run", "none", "out"), "make a benchmark with 'glsk benchmark make none' first"),
        (2, ("score", "bench", "bench", "-o", "s.csv"), "its name ends in .json"),
        (2, ("table", "bench/benchmark.json", "-o", "t.csv"), "its name ends in .md or .json"),
        (1, ("rates", "bench/benchmark.json", "bench/benchmark.json"), "not the table of a sheet"),
    ],
)
@pytest.mark.usefixtures("bench")
def test_what_is_wrong_is_one_line(refused, code, words, message):
    assert message in refused(code, "benchmark", *words)


@pytest.mark.usefixtures("small")
def test_from_a_sheet_to_the_agreement_of_two_raters(invoke, perfect, tmp_path):
    words = ("sheet", "bench", perfect, "-o", "s.png", "--skeletons", 2)
    assert invoke("benchmark", *words).stdout == "wrote s.png\nwrote s.csv\n"
    sheet = (tmp_path / "s.csv").read_text()
    assert sheet.startswith("number,cloud,answer\n1,")
    for name, word in (("a", "accept"), ("b", "edit")):
        (tmp_path / f"{name}.csv").write_text(sheet.replace(",\n", f",{word}\n"))
    found = json.loads(invoke("benchmark", "rates", "a.csv", "b.csv", "--json").stdout)
    assert (found["clouds"], found["accept"], found["agree"], found["kappa"]) == (2, [1.0, 0.0], 0.0, 0.0)
    assert invoke("benchmark", "rates", "a.csv", "a.csv").stdout.splitlines()[-1].split() == ["kappa", "-"]


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
