"""Processes of this machine: their deaths, and Ctrl-C."""

import os
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import psutil  # comes with distributed
import pytest

from glsk_o3d import BatchError
from glsk_o3d.batch import run_batch
from glsk_o3d.batch.run import WORKER_DIED
from glsk_o3d.batch.workers import GivenWorkers, LocalWorkers


def test_workers_compute_in_one_thread_and_ignore_ctrl_c(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    workers = LocalWorkers(1)
    try:
        assert workers.submit(os.getenv, "OMP_NUM_THREADS").result() == "1"
        assert workers.submit(os.getenv, "OPENBLAS_NUM_THREADS").result() == "1"
        assert (os.environ["OMP_NUM_THREADS"], os.getenv("OPENBLAS_NUM_THREADS")) == ("7", None)
        pid = workers.submit(os.getpid).result()
        os.kill(pid, signal.SIGINT)
        assert workers.submit(os.getpid).result() == pid
    finally:
        workers.close(at_once=False)
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


def test_a_worker_that_dies_costs_its_own_scan_alone(tmp_path, write, rows, saboteur):
    for i in range(6):
        write(tmp_path / "in" / f"{i}.ply", seed=i, order={1: 1000, 4: 2000}.get(i, 0))
    (tmp_path / "once").touch()  # so that 4 kills its worker the first time
    result = run_batch(tmp_path / "in", tmp_path / "out", pipeline=saboteur, workers=2)
    found = rows(tmp_path / "out")
    assert (result.done, result.failed, len(found)) == (5, 1, 6)
    assert not (tmp_path / "once").exists()
    assert (found["1"]["status"], found["1"]["error"]) == ("failed", WORKER_DIED)
    assert (
        len({row["worker"] for row in found.values() if row["status"] == "done"}) >= 2
    )  # one that lived, or a new one


def test_a_worker_that_dies_before_it_begins_is_replaced(tmp_path, write, rows, monkeypatch):
    once = tmp_path / "once"
    once.touch()
    (tmp_path / "sitecustomize.py").write_text(f"""
import os
import sys

if "--multiprocessing-fork" in sys.orig_argv and os.path.exists({str(once)!r}):
    os.unlink({str(once)!r})
    os._exit(3)
""")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path), prepend=os.pathsep)
    for i in range(3):
        write(tmp_path / "in" / f"{i}.ply", seed=i)
    result = run_batch(tmp_path / "in", tmp_path / "out", workers=1)
    assert not once.exists()
    assert (result.done, result.failed) == (3, 0)
    assert len(rows(tmp_path / "out")) == 3


def test_a_script_without_a_guard_blames_no_scan(tmp_path, write):
    write(tmp_path / "in" / "a.ply")
    script = tmp_path / "script.py"
    script.write_text("from glsk_o3d.batch import run_batch\nrun_batch('in', 'out', workers=1)\n")
    run = subprocess.run([sys.executable, script], cwd=tmp_path, capture_output=True, text=True)
    assert run.returncode == 1
    assert "BatchError: worker processes die before they begin; stderr may say why" in run.stderr
    assert (tmp_path / "out" / "ledger.jsonl").read_text() == ""


def test_an_executor_that_is_gone():
    class Gone:
        def submit(self, *_):
            raise RuntimeError("shut down")

    with pytest.raises(BatchError, match="takes no more work: shut down"):
        GivenWorkers(Gone()).submit(print)


def finished(out):
    ledger = out / "ledger.jsonl"
    return ledger.read_bytes().count(b"\n") if ledger.exists() else 0


@pytest.fixture
def six(saboteur, write, tmp_path):
    """Six scans of which the third waits at the gate, and the words that run them."""
    for i in range(6):
        write(tmp_path / "in" / f"{i}.ply", seed=i, order=4000 * (i == 2))
    return "in", "-o", "out", "--recipe", saboteur, "--workers", "1"


def ctrl_c(run):
    os.killpg(run.pid, signal.SIGINT)


def told_of(run, words):
    """What a process says up to the line with these words."""
    said = ""
    for line in run.stderr:
        said += line
        if words in line:
            return said
    pytest.fail(f"ended without a word of it: {said}")


def test_ctrl_c_and_on_again(start, gate, six, saboteur, rows, tmp_path):
    out = tmp_path / "out"
    run = start(*six)
    gate.waiting(run)
    assert finished(out) == 2
    ctrl_c(run)
    told_of(run, "finishing what is in work (1), nothing else")
    gate.open()
    said = run.stderr.read()
    assert run.wait() == 130, said
    assert said.splitlines()[-1] == "glsk: error: interrupted; no file is half-written"
    first = rows(out)
    assert sorted(first) == ["0", "1", "2"]
    with ThreadPoolExecutor(1) as pool:
        result = run_batch(tmp_path / "in", out, pipeline=saboteur, executor=pool)
    assert (result.done, result.skipped) == (3, 3)
    again = rows(out)
    assert len(again) == 6
    assert {name: again[name] for name in first} == first  # not done twice


def test_ctrl_c_twice_and_a_batch_that_is_killed_leave_no_worker(start, until, gate, six, rows, tmp_path):
    out = tmp_path / "out"

    def gone(worker):
        return not worker.is_running() or worker.status() == psutil.STATUS_ZOMBIE  # nobody has asked after it

    run = start(*six)
    [worker] = map(psutil.Process, gate.waiting(run))
    ctrl_c(run)
    told_of(run, "Ctrl-C again stops at once")
    ctrl_c(run)
    said = run.stderr.read()  # to its end, although the gate never opens
    assert run.wait() == 130, said
    until(lambda: gone(worker))
    assert sorted(rows(out)) == ["0", "1"]

    gate.forget()
    run = start(*six)
    [worker] = map(psutil.Process, gate.waiting(run))
    run.kill()
    until(lambda: gone(worker))
    assert sorted(rows(out)) == ["0", "1"]
