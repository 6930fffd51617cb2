"""What `glsk batch` takes, refuses and says; what it does is tested in tests/batch."""

import io
import json
import re

import numpy as np
import pytest

from glsk_o3d import read_skeleton
from glsk_o3d.cli.console import progress
from glsk_o3d.samples import torus


@pytest.fixture
def folder(tmp_path, write_scan):
    """Two scans and a file that is none."""
    (tmp_path / "in").mkdir()
    for name in "ab":
        write_scan(tmp_path / "in" / f"{name}.ply", torus(256).points)
    (tmp_path / "in" / "bad.ply").write_text("no")
    return tmp_path / "in"


pytestmark = pytest.mark.usefixtures("at_once")


def test_some_fail(invoke, folder, tmp_path):
    words = ("batch", "in", "-o", "out", "--format", "ply, json", "--preview")
    result = invoke(*words)
    assert result.exit_code == 1
    first, last = result.stderr.splitlines()
    assert first.startswith(f"glsk: warning: {folder / 'bad.ply'}: not a valid .ply file")
    assert last == f"glsk: error: 1 of 3 scans failed: {tmp_path / 'out' / 'ledger.jsonl'} says why"
    told = dict(line.rsplit(maxsplit=1) for line in result.stdout.splitlines())
    assert (told["done"], told["skipped"], told["failed"]) == ("2", "0", "1")
    assert float(told["clouds per second"]) > 0
    assert {path.name for path in (tmp_path / "out").glob("a.*")} == {"a.ply", "a.json", "a.png"}
    result = invoke(*words, "--json", "--quiet")
    assert (result.exit_code, result.stderr.count("\n")) == (1, 1)
    told = json.loads(result.stdout)
    assert (told["done"], told["skipped"], told["failed"]) == (0, 2, 1)
    assert [failure["input"] for failure in told["failures"]] == [str(folder / "bad.ply")]
    (folder / "bad.ply").unlink()
    assert invoke(*words, "--quiet").output == ""


def test_dry_run(invoke, folder, tmp_path):
    def told(*words):
        result = invoke("batch", "in", "-o", "out", "--dry-run", *words)
        assert result.exit_code == 0
        return result

    assert told().stdout.splitlines()[-1] == "3 to do, 0 to skip"
    assert not (tmp_path / "out").exists()
    invoke("batch", "in", "-o", "out")
    before = sorted(path.stat().st_mtime_ns for path in (tmp_path / "out").iterdir())
    assert told().stdout == f"{folder / 'bad.ply'} (failed before) -> bad.ply\n1 to do, 2 to skip\n"
    facts = json.loads(told("--json", "--set", "Connector.radius=3%").stdout)
    assert [task["why"] for task in facts["tasks"]] == ["other parameters"] * 2 + ["failed before"]
    assert json.loads(told("--json", "--force").stdout)["tasks"][0]["why"] == "asked for"
    assert sorted(path.stat().st_mtime_ns for path in (tmp_path / "out").iterdir()) == before
    (folder / "a.md").touch()
    assert "left out 1: no cloud by its ending, .md" in told().stderr
    assert told("--quiet").output == ""


def test_options_reach_the_run(invoke, folder, scans, tmp_path, at_once):
    words = ("--workers", "2", "--set", "Connector.radius=5%", "--pipeline", "wen2024")
    invoke("batch", "in/a.ply", "in/b.ply", "-o", "out", "--format", "npz", *words)
    stages = read_skeleton(tmp_path / "out" / "a.npz").report.stages
    assert any("Connector(radius='5%'" in stage for stage in stages)
    assert any("RingBuilder(k='published'" in stage for stage in stages)
    assert at_once == [2]
    assert "2 of 1000 points" in invoke("batch", scans / "nan.ply", "-o", "out").stderr
    assert invoke("batch", scans / "nan.ply", "-o", "out", "--drop-invalid").exit_code == 0


def test_progress_tells_how_many_and_how_long(monkeypatch):
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    screen = Terminal()
    monkeypatch.setattr("sys.stderr", screen)
    with progress(remaining=True) as update:
        update("done: a.ply", 7, 10)
    plain = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", screen.getvalue())
    assert re.search(r"done: a\.ply .* 7/10 left: -?\S+", plain)


def test_one_skeleton_of_a_scene_in_tiles(invoke, tmp_path):
    rings = np.concatenate([torus(300).points + [3 * i, 0, 0] for i in range(3)])
    np.savetxt(tmp_path / "plot.csv", rings, delimiter=",", header="x,y,z", comments="")
    words = ["batch", "plot.csv", "-o", "tiles", "--tiles", "3", "--overlap", "0.5", "--json"]
    told = json.loads(invoke(*words).stdout)
    assert (told["done"] > 3, told["failed"]) == (True, 0)
    plan = json.loads(invoke(*words, "--dry-run").stdout)
    assert plan["tasks"][0]["input"] == f"{tmp_path}/plot.csv tile 0-0-0"
    assert (plan["todo"], plan["skipped"]) == (0, told["done"])
    assert read_skeleton("tiles/plot.ply").n_loops == 3
