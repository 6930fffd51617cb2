"""Processes of this machine: their deaths, and Ctrl-C."""

import os
import signal
import subprocess
import sys

import psutil
import pytest

from glsk_o3d.apps.batch import run_batch
from glsk_o3d.apps.batch.run import WORKER_DIED
from glsk_o3d.apps.batch.workers import Workers


def test_workers_compute_in_one_thread_and_ignore_ctrl_c(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    workers = Workers(1)
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
    for i, order in enumerate((0, 1000, 0)):
        write(tmp_path / "in" / f"{i}.ply", seed=i, order=order)
    result = run_batch(tmp_path / "in", tmp_path / "out", pipeline=saboteur, workers=2)
    actual = rows()
    assert (result.done, result.failed, len(actual)) == (2, 1, 3)
    assert (actual["1"]["status"], actual["1"]["error"]) == ("failed", WORKER_DIED)
    once = tmp_path / "saboteur" / "once"
    once.touch()
    write(tmp_path / "in" / "1.ply", seed=1, order=2000)  # kills its worker the first time
    assert run_batch(tmp_path / "in", tmp_path / "out", pipeline=saboteur, workers=2).done == 1
    assert not once.exists()


def test_a_script_without_a_guard_blames_no_scan(tmp_path, write):
    write(tmp_path / "in" / "a.ply")
    script = tmp_path / "script.py"
    script.write_text("from glsk_o3d.apps.batch import run_batch\nrun_batch('in', 'out', workers=1)\n")
    run = subprocess.run([sys.executable, script], cwd=tmp_path, capture_output=True, text=True)
    assert run.returncode == 1
    assert "BatchError: worker processes die before they begin; stderr may say why" in run.stderr
    assert "failed" not in (tmp_path / "out" / "ledger.jsonl").read_text()


def test_ctrl_c_leaves_no_worker_and_on_again(saboteur, start, waiting, until, write, run, rows, tmp_path):
    for i in range(4):
        write(tmp_path / "in" / f"{i}.ply", seed=i, order=4000 * (i == 2))
    batch = start("in", "-o", "out", "--pipeline", saboteur, "--workers", "1")
    [worker] = map(psutil.Process, waiting(batch))
    os.killpg(batch.pid, signal.SIGINT)
    answer = batch.stderr.read()  # to its end, although the third scan never goes on
    assert batch.wait() == 130, answer
    assert answer.splitlines()[-1] == "glsk: error: interrupted; no file is half-written"
    until(lambda: not worker.is_running() or worker.status() == psutil.STATUS_ZOMBIE)  # nobody has asked after it
    first = rows(strict=False)
    assert sorted(first) == ["0", "1"]
    (tmp_path / "saboteur" / "open").touch()
    assert run(pipeline=saboteur) == {"2": "interrupted before", "3": "new"}
    again = rows()
    assert {name: again[name] for name in first} == first  # not done twice
