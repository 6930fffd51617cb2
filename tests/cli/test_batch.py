"""What `glsk batch` takes, refuses and says; what it does is tested in tests/apps/batch."""

import json

import pytest

from glsk_o3d import read_skeleton
from glsk_o3d.samples import torus

pytestmark = pytest.mark.usefixtures("at_once")


@pytest.fixture
def folder(tmp_path, write_scan):
    """Two scans and a file that is none."""
    (tmp_path / "in").mkdir()
    for name in "ab":
        write_scan(tmp_path / "in" / f"{name}.ply", torus(256).points)
    (tmp_path / "in" / "bad.ply").write_text("no")
    return tmp_path / "in"


def test_a_scan_that_fails_is_one_line_and_no_success(invoke, folder, tmp_path):
    words = ("batch", "in", "-o", "out", "--format", "ply, json", "--preview")
    result = invoke(*words)
    assert result.exit_code == 1
    first, last = result.stderr.splitlines()
    assert first.startswith(f"glsk: warning: {folder / 'bad.ply'}: not a valid .ply file")
    assert last == f"glsk: error: 1 of 3 scans failed: {tmp_path / 'out' / 'ledger.jsonl'} says why"
    assert {path.name for path in (tmp_path / "out").glob("a.*")} == {"a.ply", "a.json", "a.png"}
    result = invoke(*words, "--json", "--quiet")
    assert (result.exit_code, result.stderr.count("\n")) == (1, 1)
    facts = json.loads(result.stdout)
    assert (facts["done"], facts["skipped"], facts["failed"]) == (0, 2, 1)
    assert [failure["input"] for failure in facts["failures"]] == [str(folder / "bad.ply")]
    (folder / "bad.ply").unlink()
    assert invoke(*words, "--quiet").output == ""


def test_dry_run(invoke, folder, tmp_path):
    def plan(*words):
        result = invoke("batch", "in", "-o", "out", "--dry-run", *words)
        assert result.exit_code == 0
        return result

    assert plan().stdout.splitlines()[-1] == "3 to do, 0 to skip"
    assert not (tmp_path / "out").exists()
    invoke("batch", "in", "-o", "out")
    before = sorted(path.stat().st_mtime_ns for path in (tmp_path / "out").iterdir())
    assert plan().stdout == f"{folder / 'bad.ply'} (failed before) -> bad.ply\n1 to do, 2 to skip\n"
    facts = json.loads(plan("--json", "--set", "Connector.radius=3%").stdout)
    assert [task["why"] for task in facts["tasks"]] == ["other parameters"] * 2 + ["failed before"]
    assert json.loads(plan("--json", "--force").stdout)["tasks"][0]["why"] == "asked for"
    assert sorted(path.stat().st_mtime_ns for path in (tmp_path / "out").iterdir()) == before
    (folder / "a.md").touch()
    assert "left out 1: no cloud by its ending, .md" in plan().stderr
    assert plan("--quiet").output == ""


def test_options_reach_the_run(invoke, folder, scans, tmp_path, at_once):
    words = ("--workers", "2", "--set", "Connector.radius=5%", "--pipeline", "wen2024")
    invoke("batch", "in/a.ply", "in/b.ply", "-o", "out", "--format", "npz", *words)
    stages = read_skeleton(tmp_path / "out" / "a.npz").report.stages
    assert any("Connector(radius='5%'" in stage for stage in stages)
    assert any("RingBuilder(k='published'" in stage for stage in stages)
    assert at_once == [2]
    assert "2 of 1000 points" in invoke("batch", scans / "nan.ply", "-o", "out").stderr
    assert invoke("batch", scans / "nan.ply", "-o", "out", "--drop-invalid").exit_code == 0
