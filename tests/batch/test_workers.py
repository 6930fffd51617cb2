"""Processes of this machine: their deaths, and Ctrl-C."""

import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import psutil  # comes with distributed
import pytest

from glsk_o3d import BatchError, load_recipe
from glsk_o3d.batch import run_batch
from glsk_o3d.batch.run import WORKER_DIED
from glsk_o3d.batch.workers import GivenWorkers, LocalWorkers
from glsk_o3d.cli.overrides import override


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


def test_a_script_without_a_guard_blames_no_scan(tmp_path, write):
    write(tmp_path / "in" / "a.ply")
    script = tmp_path / "script.py"
    script.write_text("from glsk_o3d.batch import run_batch\nrun_batch('in', 'out', workers=1)\n")
    run = subprocess.run([sys.executable, script], cwd=tmp_path, capture_output=True, text=True, timeout=60)
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
def slow(saboteur, write, tmp_path):
    """Six scans that take some time each, and the words that run them."""
    for i in range(6):
        write(tmp_path / "in" / f"{i}.ply", seed=i)
    return "in", "-o", "out", "--recipe", saboteur, "--set", "Saboteur.seconds=0.3", "--workers", "1"


def test_ctrl_c_and_on_again(start, until, slow, saboteur, rows, tmp_path):
    out = tmp_path / "out"
    run = start(*slow)
    until(lambda: finished(out) >= 2)
    os.killpg(run.pid, signal.SIGINT)
    _, said = run.communicate(timeout=30)
    assert run.returncode == 130, said
    assert "finishing what is in work (1), nothing else" in said
    assert said.splitlines()[-1] == "glsk: error: interrupted; no file is half-written"
    first = rows(out)
    assert 2 <= len(first) < 6
    pipeline = override(load_recipe(saboteur), ["Saboteur.seconds=0.3"])
    with ThreadPoolExecutor(1) as pool:
        result = run_batch(tmp_path / "in", out, pipeline=pipeline, executor=pool)
    assert (result.done, result.skipped) == (6 - len(first), len(first))
    again = rows(out)
    assert len(again) == 6
    assert {name: again[name] for name in first} == first  # not done twice


def test_ctrl_c_twice_and_a_batch_that_is_killed_leave_no_worker(start, until, slow, rows, tmp_path):
    out = tmp_path / "out"
    slow = [word.replace("0.3", "60") if isinstance(word, str) else word for word in slow]

    def workers(run):
        return [child for child in psutil.Process(run.pid).children() if "spawn_main" in str(child.cmdline())]

    def gone(child):
        return not child.is_running() or child.status() == psutil.STATUS_ZOMBIE  # nobody has asked after it

    run = start(*slow)
    [worker] = until(lambda: workers(run))
    time.sleep(1)
    begun = time.monotonic()
    os.killpg(run.pid, signal.SIGINT)
    time.sleep(0.3)
    os.killpg(run.pid, signal.SIGINT)
    _, said = run.communicate(timeout=20)
    assert run.returncode == 130, said
    assert time.monotonic() - begun < 15
    until(lambda: gone(worker))
    assert rows(out) == {}

    run = start(*slow)
    [worker] = until(lambda: workers(run))
    time.sleep(1)
    run.kill()
    until(lambda: gone(worker))
    assert rows(out) == {}
