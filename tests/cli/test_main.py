"""The command as its users meet it: files, streams and exit codes; bugs, Ctrl-C, full disks."""

import os
import resource
import signal
import subprocess
import sys

import pytest

import glsk_o3d
from glsk_o3d import read_cloud, read_skeleton, save_skeleton


def test_as_a_process(glsk, scans, tmp_path):
    names = ["s.ply", "s.json", "s.npz", "s.obj"]
    outputs = [word for name in names for word in ("-o", name)]
    run = glsk("skeletonize", scans / "sample.ply", *outputs, "--preview", "s.png")
    assert (run.returncode, run.stderr) == (0, "")
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([*names, "s.png"])
    skeletons = [read_skeleton(tmp_path / name) for name in names]
    assert len({(len(s.edges), s.n_loops, s.n_components) for s in skeletons}) == 1
    assert (tmp_path / "s.png").read_bytes().startswith(b"\x89PNG")
    assert f"vertices     {len(skeletons[0].vertices)}\n" in run.stdout
    assert glsk("skeletonize").returncode == 2


def test_demo(invoke, tmp_path):
    run = invoke("demo", "--points", "1200", "-o", "there/demo")
    assert (run.exit_code, run.stderr) == (0, "")
    folder = tmp_path / "there" / "demo"
    assert {path.name for path in folder.iterdir()} == {"cloud.ply", "skeleton.ply", "skeleton.json", "skeleton.png"}
    assert len(read_cloud(folder / "cloud.ply").points) == 1200


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
    for words in (["crosscheck", "--help"], ["--version"]):
        run = subprocess.run([sys.executable, "-c", code, *words], capture_output=True, text=True, check=True)
        code_, *loaded = run.stderr.split()
        assert code_ == "0"
        assert not set(loaded) & {"open3d", "matplotlib", "numpy", "scipy", "networkx", "igl"}
    assert run.stdout == f"glsk-o3d {glsk_o3d.__version__}\n"


@pytest.mark.parametrize("unbuffered", ["", "1"])
@pytest.mark.parametrize("words", ["--help", "--version", "branches y.ply", "info y.ply --json"])
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
