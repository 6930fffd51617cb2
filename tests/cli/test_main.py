"""The command as its users meet it: a process with files, streams and an exit code."""

import json
import resource
import signal
import subprocess
import sys

import pytest

import glsk_o3d
from glsk_o3d import read_cloud, read_skeleton

SUMMARY = "points distinct vertices edges components loops leaves junctions length contraction seconds wrote"


def failed(run, code):
    """The one line of a run that failed."""
    assert run.returncode == code, run.stderr
    assert run.stderr.startswith("glsk: error: ")
    assert run.stderr.count("\n") == 1
    return run.stderr


def test_skeletonizes_into_several_formats(glsk, scans, tmp_path):
    names = ["s.ply", "s.json", "s.npz", "s.obj", "s.graphml", "s.polylines.txt"]
    run = glsk(
        "skeletonize", scans / "sample.ply", *(word for name in names for word in ("-o", name)), "--preview", "s.png"
    )
    assert (run.returncode, run.stderr) == (0, "")
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([*names, "s.png"])
    skeletons = [read_skeleton(tmp_path / name) for name in names]
    assert len({(len(s.edges), s.n_loops, s.n_components) for s in skeletons}) == 1
    assert (tmp_path / "s.png").read_bytes().startswith(b"\x89PNG")
    first = [line.split()[0] for line in run.stdout.splitlines()]
    assert list(dict.fromkeys(first)) == SUMMARY.split()
    assert f"vertices     {len(skeletons[0].vertices)}\n" in run.stdout


def test_demo(glsk, tmp_path):
    run = glsk("demo", "--points", "1200", "-o", "there/demo")
    assert (run.returncode, run.stderr) == (0, "")
    folder = tmp_path / "there" / "demo"
    assert {path.name for path in folder.iterdir()} == {"cloud.ply", "skeleton.ply", "skeleton.json", "skeleton.png"}
    assert len(read_cloud(folder / "cloud.ply").points) == 1200
    assert len(read_skeleton(folder / "skeleton.json").vertices) > 10
    assert run.stdout.count("wrote there/demo/") == 4


def test_nothing_is_half_written_on_a_full_disk(glsk, scans, tmp_path, tree):
    old = tmp_path / "s.ply"
    old.write_text("kept")

    def little_room(size=1000):
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

    files = ("-o", "s.ply", "-o", "s.json", "--preview", "s.png")
    line = failed(glsk("skeletonize", scans / "sample.ply", *files, "--quiet", preexec_fn=little_room), 1)
    assert all(f"{name}: cannot be written: File too large" in line for name in ("s.ply", "s.json", "s.png"))
    assert [path.name for path in tmp_path.iterdir()] == ["s.ply"]
    assert old.read_text() == "kept"

    tree.save(old)
    for words in (["branches", old, "-o", "s.csv"], ["evaluate", old, scans / "sample.ply", "-o", "s.json"]):
        line = failed(glsk(*words, "--quiet", preexec_fn=lambda: little_room(100)), 1)
        assert line == f"glsk: error: {words[-1]}: cannot be written: File too large\n"
    assert [path.name for path in tmp_path.iterdir()] == ["s.ply"]


def test_failure_and_wrong_usage_differ(glsk, scans, tmp_path):
    assert "no.ply: no such file" in failed(glsk("skeletonize", "no.ply", "-o", "s.ply"), 1)
    assert "empty.ply" in failed(glsk("skeletonize", scans / "empty.ply", "-o", "s.ply"), 1)
    setting = ("--set", "Connector.radios=2%")
    assert "did you mean 'radius'?" in failed(glsk("skeletonize", scans / "sample.ply", "-o", "s.ply", *setting), 2)
    assert glsk("skeletonize").returncode == 2
    assert glsk("no-such-command").returncode == 2
    assert list(tmp_path.iterdir()) == []


def test_points_that_are_not_finite(glsk, scans, tmp_path):
    line = failed(glsk("skeletonize", scans / "nan.ply", "-o", "s.npz"), 1)
    assert f"{scans / 'nan.ply'}: 2 of 1000 points" in line
    assert "the first at index 3: drop them with drop_invalid=True" in line
    (tmp_path / "none.xyz").write_text("nan nan nan\n" * 20)
    line = failed(glsk("skeletonize", "none.xyz", "-o", "s.npz"), 1)
    assert line.endswith("none.xyz: none of its 20 points has finite coordinates: there is no cloud to work with\n")
    run = glsk("skeletonize", scans / "nan.ply", "-o", "s.npz", "--drop-invalid", "--json")
    assert run.returncode == 0, run.stderr
    facts = json.loads(run.stdout)
    assert (facts["points"], facts["dropped"], facts["files"]) == (1000, 2, ["s.npz"])
    assert (read_skeleton(tmp_path / "s.npz").vertex_of_point < 0).nonzero()[0].tolist() == [3, 8]


def test_help_and_version_load_nothing_heavy():
    code = """
import sys
from glsk_o3d.cli.main import app
try:
    app(sys.argv[1:])
except SystemExit as done:
    print(done.code, *{name.partition('.')[0] for name in sys.modules}, file=sys.stderr)
"""
    for words in (["--help"], ["skeletonize", "--help"], ["crosscheck", "--help"], ["--version"]):
        run = subprocess.run([sys.executable, "-c", code, *words], capture_output=True, text=True, check=True)
        code_, *loaded = run.stderr.split()
        assert code_ == "0"
        assert not set(loaded) & {"open3d", "matplotlib", "numpy", "scipy", "networkx", "igl"}
    assert run.stdout == f"glsk-o3d {glsk_o3d.__version__}\n"


def test_help_cuts_no_line(invoke, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    assert "..." not in invoke("--help").stdout.partition("Commands:")[2]


def test_as_a_module(tmp_path):
    words = [sys.executable, "-m", "glsk_o3d", "info", "none.ply"]
    run = subprocess.run(words, capture_output=True, text=True, cwd=tmp_path)
    assert (run.returncode, run.stderr) == (1, "glsk: error: none.ply: no such file\n")


def test_help_tells_the_exit_codes(invoke):
    for words in (["--help"], ["skeletonize", "--help"]):
        told = " ".join(invoke(*words).stdout.split())
        assert "Exit codes: 0 all went well; 1 the input or the run failed; 2 the command line is wrong" in told


@pytest.mark.parametrize("stage", ["Refiner", "RingBuilder"])
def test_bugs_keep_their_traceback(invoke, scans, monkeypatch, stage):
    def broken(self, data, on_iteration):
        raise ZeroDivisionError("a bug")

    monkeypatch.setattr(getattr(glsk_o3d, stage), "_run", broken)
    with pytest.raises(ZeroDivisionError, match="a bug"):
        invoke("skeletonize", scans / "sample.ply", "-o", "s.ply")


def test_ctrl_c(refused, scans, monkeypatch):
    def interrupted(self, data, on_iteration):
        raise KeyboardInterrupt

    monkeypatch.setattr(glsk_o3d.Refiner, "_run", interrupted)
    assert "interrupted" in refused(130, "skeletonize", scans / "sample.ply", "-o", "s.ply")


def test_ctrl_c_while_open3d_loads(refused, scans, monkeypatch):
    def slow():
        signal.raise_signal(signal.SIGINT)
        held.append("open3d")  # not before this is done

    held = []
    monkeypatch.setattr("glsk_o3d.cli.reporting.import_open3d", slow)
    before = signal.getsignal(signal.SIGINT)
    assert "interrupted" in refused(130, "skeletonize", scans / "sample.ply", "-o", "s.ply")
    assert held == ["open3d"]
    assert signal.getsignal(signal.SIGINT) is before
