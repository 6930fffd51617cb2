"""What `glsk batch` takes, refuses and says; what it does is tested in tests/batch."""

import io
import json
import re

import numpy as np
import pytest

from glsk_o3d import read_skeleton
from glsk_o3d.batch import run_batch
from glsk_o3d.cli.console import progress


@pytest.fixture
def folder(tmp_path, write_scan):
    """Two scans and a file that is none."""
    from glsk_o3d.samples import torus

    (tmp_path / "in").mkdir()
    for name in "ab":
        write_scan(tmp_path / "in" / f"{name}.ply", torus(256).points)
    (tmp_path / "in" / "bad.ply").write_text("no")
    return tmp_path / "in"


@pytest.fixture(autouse=True)
def here(monkeypatch):
    """Do the work in this process."""
    from concurrent.futures import Future

    import glsk_o3d.batch.run as module

    class Here:
        def __init__(self, count):
            counts.append(count)

        def capacity(self):
            return 1

        def submit(self, function, job):
            future = Future()
            future.set_result(function(job))
            return future

        def close(self, *, at_once):
            pass

    counts = []
    monkeypatch.setattr(module, "LocalWorkers", Here)
    return counts


@pytest.mark.usefixtures("no_run")
@pytest.mark.parametrize(
    ("code", "words", "message"),
    [
        (1, ["none"], "none: no such file or folder"),
        (1, ["in/*.pcd"], "in/*.pcd: no cloud matches; known endings are .ply"),
        (1, ["."], "sub-folders are taken with recursive"),
        (2, ["in", "--format", "stl"], "unknown ending; known are .ply"),
        (2, ["in", "--format", ","], "nothing to write"),
        (2, ["in", "--pipeline", "wen2042"], "did you mean 'wen2024'?"),
        (2, ["in", "--pipeline", "cao2010", "--recipe", "r.json"], "give one of them"),
        (2, ["in", "--set", "Connector.radios=1"], "did you mean 'radius'?"),
        (2, ["in", "--workers", "2", "--scheduler", "tcp://x:1"], "give neither workers"),
    ],
)
def test_typos_leave_nothing_behind(refused, folder, code, words, message):
    assert message in refused(code, "batch", *words, "-o", "out")


def test_results_of_their_own(refused, folder):
    assert "give the results one of their own" in refused(2, "batch", "in", "-o", "in")


def test_some_fail(invoke, folder, tmp_path):
    result = invoke("batch", "in", "-o", "out", "--format", "ply, json", "--preview")
    assert result.exit_code == 1
    first, last = result.stderr.splitlines()
    assert first.startswith(f"glsk: warning: {folder / 'bad.ply'}: not a valid .ply file")
    assert last == f"glsk: error: 1 of 3 scans failed: {tmp_path / 'out' / 'ledger.csv'} says why"
    told = dict(line.rsplit(maxsplit=1) for line in result.stdout.splitlines())
    assert (told["done"], told["skipped"], told["failed"]) == ("2", "0", "1")
    assert float(told["clouds per second"]) > 0
    assert {path.name for path in (tmp_path / "out").glob("a.*")} == {"a.ply", "a.json", "a.png"}
    assert read_skeleton(tmp_path / "out" / "a.json").n_loops == 1


def test_again(invoke, folder, tmp_path):
    (folder / "bad.ply").unlink()
    assert invoke("batch", "in", "-o", "out").exit_code == 0
    result = invoke("batch", "in", "-o", "out", "--json")
    assert (result.exit_code, result.stderr) == (0, "")
    told = json.loads(result.stdout)
    assert (told["done"], told["skipped"], told["failed"], told["failures"]) == (0, 2, 0, [])


def test_json_and_quiet(invoke, folder, tmp_path):
    result = invoke("batch", "in", "-o", "out", "--json", "--quiet")
    assert result.exit_code == 1
    assert result.stderr.count("\n") == 1
    told = json.loads(result.stdout)
    assert [failure["input"] for failure in told["failures"]] == [str(folder / "bad.ply")]
    assert told["ledger"] == str(tmp_path / "out" / "ledger.jsonl")
    (folder / "bad.ply").unlink()
    assert invoke("batch", "in", "-o", "out", "-q").output == ""


def test_points_that_are_not_finite(invoke, scans):
    assert "2 of 1000 points" in invoke("batch", scans / "nan.ply", "-o", "out").stderr
    assert invoke("batch", scans / "nan.ply", "-o", "out", "--drop-invalid").exit_code == 0


def test_dry_run(invoke, folder, tmp_path):
    def told(*words):
        result = invoke("batch", "in", "-o", "out", "--dry-run", *words)
        assert result.exit_code == 0
        return result.stdout

    assert told().splitlines()[-1] == "3 to do, 0 to skip"
    assert not (tmp_path / "out").exists()
    invoke("batch", "in", "-o", "out")
    before = sorted(path.stat().st_mtime_ns for path in (tmp_path / "out").iterdir())
    assert told() == f"{folder / 'bad.ply'} (failed before) -> bad.ply\n1 to do, 2 to skip\n"
    assert told("--quiet") == ""
    facts = json.loads(told("--json", "--set", "Connector.radius=3%"))
    assert (facts["todo"], [task["why"] for task in facts["tasks"]]) == (
        3,
        ["other parameters"] * 2 + ["failed before"],
    )
    assert json.loads(told("--json", "--force"))["tasks"][0]["why"] == "asked for"
    assert sorted(path.stat().st_mtime_ns for path in (tmp_path / "out").iterdir()) == before


def test_options_reach_the_run(invoke, folder, tmp_path, here):
    words = ("--workers", "2", "--set", "Connector.radius=5%", "--pipeline", "wen2024")
    invoke("batch", "in/a.ply", "in/b.ply", "-o", "out", "--format", "npz", *words)
    assert here == [2]
    stages = read_skeleton(tmp_path / "out" / "a.npz").report.stages
    assert any("Connector(radius='5%'" in stage for stage in stages)
    assert any("RingBuilder(k='published'" in stage for stage in stages)


def test_no_more_workers_than_scans(folder, tmp_path, here):
    run_batch(folder, tmp_path / "out", workers=64)
    run_batch(folder, tmp_path / "out", workers=64)
    assert here == [3, 1]


def test_verbose(invoke, folder):
    result = invoke("batch", "in/a.ply", "-o", "out", "--verbose")
    assert f"glsk: {folder / 'a.ply'}: " in result.stderr


def test_progress_tells_how_many_and_how_long(monkeypatch):
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    screen = Terminal()
    monkeypatch.setattr("sys.stderr", screen)
    with progress(True, remaining=True) as update:
        update("3 scans/s, 1 failed", 7, 10)
    assert re.search(
        r"3 scans/s, 1 failed .* 7/10 left: -?\S+", re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", screen.getvalue())
    )


def test_one_skeleton_per_tree_of_a_plot(invoke, tmp_path):
    from glsk_o3d.samples import torus

    rings = np.concatenate([torus(300).points + [3 * i, 0, 0] for i in range(3)])
    table = np.column_stack([rings, np.repeat([0, 7, 9], 300), np.arange(900) % 2])
    (tmp_path / "in").mkdir()
    np.savetxt(tmp_path / "in" / "plot.csv", table, delimiter=",", header="x,y,z,treeID,return", comments="")
    (tmp_path / "in" / "README.md").touch()
    words = ["batch", "in", "-o", "out", "--by", "treeID", "--where", "treeID > 0", "--json"]
    told = json.loads(invoke(*words).stdout)
    assert (told["done"], told["failed"]) == (2, 0)
    assert told["left_out"] == {str(tmp_path / "in" / "README.md"): "no cloud by its ending, .md"}
    assert read_skeleton("out/plot-9.ply").vertices[:, 0].min() > 5
    rows = [json.loads(line) for line in (tmp_path / "out" / "ledger.jsonl").read_text().splitlines()]
    assert sorted((row["name"], row["points"]) for row in rows) == [("plot-7", 300), ("plot-9", 300)]
    assert {row["input"] for row in rows} == {f"{tmp_path}/in/plot.csv where treeID == {i}" for i in (7, 9)}
    assert json.loads(invoke(*words).stdout)["skipped"] == 2
    half = json.loads(invoke(*words[:-2], "treeID > 0 and return_ == 1", "--json").stdout)
    assert (half["done"], half["skipped"]) == (2, 0)  # other points are another result


def test_one_skeleton_of_a_scene_in_tiles(invoke, tmp_path, write_scan):
    from glsk_o3d.samples import torus

    write_scan(tmp_path / "scene.ply", torus(3000, radius=0.05).points)
    words = ["batch", "scene.ply", "-o", "out", "--tiles", "0.7", "--overlap", "0.17", "--json"]
    plan = json.loads(invoke(*words, "--dry-run").stdout)
    assert plan["todo"] == 5
    assert plan["tasks"][0]["input"] == f"{tmp_path}/scene.ply tile 0-0-0"
    told = json.loads(invoke(*words).stdout)
    assert (told["done"], told["failed"]) == (5, 0)
    assert read_skeleton("out/scene.ply").n_loops == 1
    assert json.loads(invoke(*words).stdout)["skipped"] == 5


def test_it_says_what_it_left_out(invoke, folder):
    for name in "abcdefg":
        (folder / f"{name}.md").touch()
    said = invoke("batch", "in", "-o", "out", "--dry-run").stderr
    assert "left out 7: no cloud by its ending, .md (a.md, b.md, c.md, d.md, e.md, ...)" in said
    assert not invoke("batch", "in", "-o", "out", "--dry-run", "--quiet").stderr
