"""The command as its users meet it: files, streams and exit codes; bugs, Ctrl-C, full disks."""

import os
import resource
import signal
import subprocess
import sys

import numpy as np
import pytest

import glsk_o3d
from glsk_o3d import read_cloud, read_skeleton, save_skeleton
from glsk_o3d.samples.capsules import union_sample


def test_as_a_process(glsk, scans, tmp_path):
    names = ["s.ply", "s.json", "s.npz", "s.obj"]
    outputs = [word for name in names for word in ("-o", name)]
    run = glsk("skeletonize", scans / "sample.ply", *outputs, "--preview", "s.png")
    assert (run.returncode, run.stderr) == (0, "")
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([*names, "s.png"])
    skeletons = [read_skeleton(tmp_path / name) for name in names]
    assert len({(len(s.edges), s.n_loops, s.n_components) for s in skeletons}) == 1
    assert (tmp_path / "s.png").read_bytes().startswith(b"\x89PNG")
    first = [line.split()[0] for line in run.stdout.splitlines()]
    shown = "points distinct vertices edges components loops leaves junctions length"
    assert list(dict.fromkeys(first)) == [*shown.split(), "contraction", "seconds", "wrote"]
    assert f"vertices     {len(skeletons[0].vertices)}\n" in run.stdout
    assert glsk("skeletonize").returncode == 2


def test_close_calls_say_what_changes_them(glsk, tmp_path):
    """The ends of a body that is about as thick as it is long."""
    handle = np.linspace(-np.pi / 2, np.pi / 2, 17)
    bow = np.column_stack([0.38 + 0.28 * np.cos(handle), 0 * handle, 0.28 * np.sin(handle)])
    nodes = np.concatenate([[[0, 0, -0.35], [0, 0, 0.35]], bow])
    edges = np.array([[0, 1], *((k, k + 1) for k in range(2, 18))])
    pot = union_sample("", nodes, edges, np.repeat([0.4, 0.06], [2, 17]), 4096, 0.0, 0)
    np.savetxt(tmp_path / "pot.xyz", pot.points)
    run = glsk("skeletonize", "pot.xyz", "-o", "pot.json")
    uncertain = read_skeleton(tmp_path / "pot.json").report.uncertain
    assert uncertain
    rows = [line for line in run.stdout.splitlines() if "is a limb: " in line]
    assert rows
    assert all("if that is wrong: --set Refiner.limb=0." in line for line in rows)


def test_demo(invoke, tmp_path):
    run = invoke("demo", "--points", "1200", "-o", "there/demo")
    assert (run.exit_code, run.stderr) == (0, "")
    folder = tmp_path / "there" / "demo"
    assert {path.name for path in folder.iterdir()} == {"cloud.ply", "skeleton.ply", "skeleton.json", "skeleton.png"}
    assert len(read_cloud(folder / "cloud.ply").points) == 1200
    assert len(read_skeleton(folder / "skeleton.json").vertices) > 10
    assert run.stdout.count("wrote there/demo/") == 4


def test_nothing_is_half_written_on_a_full_disk(glsk, scans, tmp_path, tree):
    old = tmp_path / "s.ply"
    old.write_text("kept")

    def little_room():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))

    files = ("-o", "s.ply", "-o", "s.json", "--preview", "s.png")
    run = glsk("skeletonize", scans / "sample.ply", *files, "--quiet", preexec_fn=little_room)
    assert (run.returncode, run.stderr.count("\n")) == (1, 1)
    assert all(f"{name}: cannot be written: File too large" in run.stderr for name in ("s.ply", "s.json", "s.png"))
    assert old.read_text() == "kept"
    save_skeleton(tree, old)
    run = glsk("branches", old, "-o", "s.csv", "--quiet", preexec_fn=little_room)
    assert (run.returncode, run.stderr) == (1, "glsk: error: s.csv: cannot be written: File too large\n")
    assert [path.name for path in tmp_path.iterdir()] == ["s.ply"]


def test_help_and_version_load_nothing_heavy():
    code = """
import sys
from glsk_o3d.cli.main import app
try:
    app(sys.argv[1:])
except SystemExit as done:
    print(done.code, *{name.partition('.')[0] for name in sys.modules}, file=sys.stderr)
"""
    for words in (["--help"], ["crosscheck", "--help"], ["--version"]):
        run = subprocess.run([sys.executable, "-c", code, *words], capture_output=True, text=True, check=True)
        code_, *loaded = run.stderr.split()
        assert code_ == "0"
        assert not set(loaded) & {"open3d", "matplotlib", "numpy", "scipy", "networkx", "igl"}
    assert run.stdout == f"glsk-o3d {glsk_o3d.__version__}\n"


def test_help_cuts_no_line_and_tells_the_exit_codes(invoke, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    assert "..." not in invoke("--help").stdout.partition("Commands:")[2]
    for words in (["--help"], ["skeletonize", "--help"]):
        told = " ".join(invoke(*words).stdout.split())
        assert "Exit codes: 0 all went well; 1 the input or the run failed; 2 the command line is wrong" in told
    assert invoke("no-such-command").exit_code == 2


@pytest.mark.parametrize("unbuffered", ["", "1"])
@pytest.mark.parametrize(
    "words", ["--help", "--version", "info --help", "filters", "branches y.ply", "info y.ply --json"]
)
def test_output_that_nobody_takes_is_one_line_and_no_success(tmp_path, y, words, unbuffered):
    command = [sys.executable, "-m", "glsk_o3d", *words.split()]
    given = dict(stderr=subprocess.PIPE, text=True, cwd=tmp_path, env={**os.environ, "PYTHONUNBUFFERED": unbuffered})
    with subprocess.Popen(command, stdout=subprocess.PIPE, **given) as run:
        run.stdout.close()
        assert run.stderr.read() == ""  # who closed it knows
    assert run.returncode == 1
    with open("/dev/full", "w") as full:
        run = subprocess.run(command, stdout=full, **given)
        assert run.stderr == "glsk: error: standard output: cannot be written: No space left on device\n"
        assert run.returncode == 1
        assert subprocess.run([*command, "--nonsense"], **{**given, "stderr": full}).returncode != 0


def test_bugs_keep_their_traceback(invoke, scans, monkeypatch):
    monkeypatch.setattr(glsk_o3d.Refiner, "run", lambda *_: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        invoke("skeletonize", scans / "sample.ply", "-o", "s.ply")


def test_ctrl_c_in_a_run(refused, scans, monkeypatch):
    def interrupted(self, data, on_iteration):
        raise KeyboardInterrupt

    monkeypatch.setattr(glsk_o3d.RingBuilder, "run", interrupted)
    assert refused(130, "skeletonize", scans / "sample.ply", "-o", "s.ply") == "interrupted; no file is half-written"
