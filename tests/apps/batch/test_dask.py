"""A real Dask cluster on this machine: a scheduler and two workers, each a process."""

import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import pytest

from glsk_o3d import BatchError
from glsk_o3d.apps.batch import plan_batch, run_batch
from glsk_o3d.apps.batch.run import WORKER_DIED

distributed = pytest.importorskip("distributed")


@pytest.fixture
def cluster(tmp_path, until, patience, monkeypatch):
    """Start a scheduler and workers; gives the scheduler's file, its process and those of the workers."""
    begun = []
    for name in ("CONNECT", "TCP"):
        monkeypatch.setenv(f"DASK_DISTRIBUTED__COMM__TIMEOUTS__{name}", f"{patience} s")
    monkeypatch.setattr("glsk_o3d.apps.batch.workers._SCHEDULER_SECONDS", patience)

    def dask(*words, **environment):
        command = [sys.executable, "-m", "dask", *words, "--no-dashboard"]
        with (tmp_path / f"dask{len(begun)}.log").open("w") as log:
            begun.append(subprocess.Popen(command, stdout=log, stderr=log, env={**os.environ, **environment}))
        return begun[-1]

    def make(n=2, **environment):
        file = tmp_path / "scheduler.json"
        words = ("scheduler", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(file))
        scheduler = dask(*words, **environment)
        until(lambda: file.exists() and file.read_text().endswith("}"), scheduler)
        options = ("--scheduler-file", str(file), "--no-nanny", "--nthreads", "1", "--host", "127.0.0.1")
        workers = [dask("worker", *options) for _ in range(n)]
        with distributed.Client(scheduler_file=str(file), timeout=patience, set_as_default=False) as client:
            until(lambda: len(client.nthreads()) == n, scheduler, *workers)
        return file, scheduler, workers

    yield make
    for process in reversed(begun):
        process.kill()
        process.wait()


def test_a_worker_is_killed_and_then_the_scheduler(cluster, waiting, until, saboteur, write, rows, tmp_path):
    for i in range(8):
        write(tmp_path / "in" / f"{i}.ply", seed=i, order=4000 * (i >= 4))
    (tmp_path / "in" / "bad.ply").write_text("no")
    file, scheduler, workers = cluster()
    seen = []

    def kill_first():
        until(lambda: waiting(*workers) == {worker.pid for worker in workers}, *workers)
        workers[0].kill()
        workers[0].wait()
        (tmp_path / "saboteur" / "open").touch()

    with ThreadPoolExecutor(1) as aside:
        killing = aside.submit(kill_first)  # when both are in the middle of a scan
        result = run_batch(tmp_path / "in", tmp_path / "out", pipeline=saboteur, scheduler=file, on_result=seen.append)
        killing.result()
    found = rows()
    assert (result.done, result.failed) == (8, 1)
    assert found["bad"]["error"].startswith("not a valid .ply file")
    assert sorted(row["name"] for row in seen) == sorted(found)  # nothing lost, nothing twice
    assert {int(re.search(r"\d+$", found[f"{i}"]["worker"])[0]) for i in range(4, 8)} == {workers[1].pid}
    again = run_batch(tmp_path / "in", tmp_path / "out", pipeline=saboteur, scheduler=file)
    assert (again.done, again.skipped, again.failed) == (0, 8, 1)

    def stop(row):
        scheduler.kill()
        scheduler.wait()

    with pytest.raises(BatchError, match="the same batch to go on"):
        run_batch(tmp_path / "in", tmp_path / "new", pipeline=saboteur, scheduler=file, on_result=stop)
    first = rows("new", strict=False)
    assert 1 <= len(first) < 8
    assert plan_batch(tmp_path / "in", tmp_path / "new", pipeline=saboteur).skipped == len(first) - ("bad" in first)


def test_a_scan_that_kills_its_workers(cluster, saboteur, write, rows, tmp_path):
    for i in range(3):
        write(tmp_path / "in" / f"{i}.ply", seed=i, order=1000 * (i == 2))
    file, _, _ = cluster(3, DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES="0")  # it kills two, one is left
    result = run_batch(tmp_path / "in", tmp_path / "out", pipeline=saboteur, scheduler=file)
    assert (result.done, result.failed) == (2, 1)
    assert rows()["2"]["error"] == WORKER_DIED


@pytest.mark.parametrize("address", ["foo://a:1", "tcp://127.0.0.1:1"])
def test_nobody_there(write, tmp_path, monkeypatch, address):
    write(tmp_path / "in" / "a.ply")
    monkeypatch.setattr("glsk_o3d.apps.batch.workers._SCHEDULER_SECONDS", 0.5)
    with pytest.raises(BatchError, match=f"{address}: no Dask scheduler answers there"):
        run_batch(tmp_path / "in", tmp_path / "out", scheduler=address)
