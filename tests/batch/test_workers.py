"""Processes of this machine: their deaths, and Ctrl-C."""

import os
import signal
import subprocess
import sys

import psutil  # comes with distributed
import pytest

from glsk_o3d import BatchError
from glsk_o3d.batch import run_batch
from glsk_o3d.batch.run import WORKER_DIED
from glsk_o3d.batch.workers import GivenWorkers, LocalWorkers


def test_workers_compute_in_one_thread_and_ignore_ctrl_c(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    workers = LocalWorkers(1, load=False)
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
    for i, order in enumerate((0, 1000, 2000)):
        write(tmp_path / "in" / f"{i}.ply", seed=i, order=order)
    once = tmp_path / "saboteur" / "once"
    once.touch()  # so that 2 kills its worker the first time
    result = run_batch(tmp_path / "in", tmp_path / "out", pipeline=saboteur, workers=2)
    found = rows()
    assert (result.done, result.failed, len(found)) == (2, 1, 3)
    assert not once.exists()
    assert (found["1"]["status"], found["1"]["error"]) == ("failed", WORKER_DIED)


def test_a_worker_that_dies_before_it_begins_is_replaced(tmp_path, monkeypatch):
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
    workers = LocalWorkers(1, load=False)
    assert workers.submit(os.getpid).exception() is not None
    assert workers.submit(os.getpid).result() > 0
    workers.close(at_once=True)


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


@pytest.fixture
def begin(saboteur, start, waiting, write, tmp_path):
    """Start a batch of four scans and press Ctrl-C while the third waits; gives the process and its worker."""
    for i in range(4):
        write(tmp_path / "in" / f"{i}.ply", seed=i, order=4000 * (i == 2))

    def run():
        batch = start("in", "-o", "out", "--pipeline", saboteur, "--workers", "1")
        [worker] = map(psutil.Process, waiting(batch))
        os.killpg(batch.pid, signal.SIGINT)
        for line in batch.stderr:
            if "finishing 1 running clouds, starting no more: Ctrl-C again stops at once" in line:
                return batch, worker
        pytest.fail("ended without a word of it")

    return run


def test_ctrl_c_and_on_again(begin, run, saboteur, rows, tmp_path):
    batch, _ = begin()
    (tmp_path / "saboteur" / "open").touch()
    said = batch.stderr.read()
    assert batch.wait() == 130, said
    assert said.splitlines()[-1] == "glsk: error: interrupted; no file is half-written"
    first = rows()
    assert sorted(first) == ["0", "1", "2"]
    assert list(run(pipeline=saboteur)) == ["3"]
    again = rows()
    assert {name: again[name] for name in first} == first  # not done twice


def test_ctrl_c_twice_leaves_no_worker(begin, until, rows):
    batch, worker = begin()
    os.killpg(batch.pid, signal.SIGINT)
    said = batch.stderr.read()  # to its end, although the scan never goes on
    assert batch.wait() == 130, said
    until(lambda: not worker.is_running() or worker.status() == psutil.STATUS_ZOMBIE)  # nobody has asked after it
    assert sorted(rows()) == ["0", "1"]
