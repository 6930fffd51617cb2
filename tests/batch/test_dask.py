"""A real Dask cluster on this machine: a scheduler and two workers, each a process."""

import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import pytest

from glsk_o3d import BatchError
from glsk_o3d.batch import plan_batch, run_batch
from glsk_o3d.batch.run import WORKER_DIED
from glsk_o3d.samples import torus

distributed = pytest.importorskip("distributed")


@pytest.fixture
def cluster(tmp_path, until, patience, monkeypatch):
    """Start a scheduler and workers; gives the scheduler's file and the workers' processes, once they are at work."""
    begun = []
    for name in ("CONNECT", "TCP"):
        monkeypatch.setenv(f"DASK_DISTRIBUTED__COMM__TIMEOUTS__{name}", f"{patience} s")
    monkeypatch.setattr("glsk_o3d.batch.workers._SCHEDULER_SECONDS", patience)

    def dask(*words, **environment):
        command = [sys.executable, "-m", "dask", *words, "--no-dashboard"]
        with (tmp_path / f"dask{len(begun)}.log").open("w") as log:
            begun.append(subprocess.Popen(command, stdout=log, stderr=log, env={**os.environ, **environment}))
        return begun[-1]

    def make(workers, **environment):
        file = tmp_path / "scheduler.json"
        make.scheduler = dask(
            "scheduler", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(file), **environment
        )
        until(lambda: file.exists() and file.read_text().endswith("}"), make.scheduler)
        options = ("--scheduler-file", str(file), "--no-nanny", "--nthreads", "1", "--host", "127.0.0.1")
        processes = [dask("worker", *options) for _ in range(workers)]
        with distributed.Client(scheduler_file=str(file), timeout=patience, set_as_default=False) as client:
            until(lambda: len(client.nthreads()) == workers, make.scheduler, *processes)
        return file, processes

    yield make
    for process in reversed(begun):
        process.kill()
        process.wait()


def worker(row):
    return int(re.search(r"process (\d+)$", row["worker"])[1])


@pytest.fixture
def kill_first(until, gate):
    """Kill the first of the workers as soon as all wait at the gate; the others may go on."""

    def kill(workers):
        until(lambda: gate.waiting(*workers) == {worker.pid for worker in workers}, *workers)
        workers[0].kill()
        workers[0].wait()
        gate.open()

    return kill


def test_a_worker_is_killed_and_then_the_scheduler(cluster, kill_first, saboteur, write, rows, tmp_path):
    for i in range(16):
        write(tmp_path / "in" / f"{i:02}.ply", seed=i, order=4000 * (i >= 4))
    (tmp_path / "in" / "bad.ply").write_text("no")
    file, processes = cluster(2)
    pids = [process.pid for process in processes]
    seen = []

    with ThreadPoolExecutor(1) as aside:
        killing = aside.submit(kill_first, processes)  # when both are in the middle of a scan
        result = run_batch(tmp_path / "in", tmp_path / "out", pipeline=saboteur, scheduler=file, on_result=seen.append)
        killing.result()
    found = rows(tmp_path / "out")
    assert (result.done, result.failed) == (16, 1)
    assert found["bad"]["error"].startswith("not a valid .ply file")
    assert sorted(row["name"] for row in seen) == sorted(found)  # nothing lost, nothing twice
    assert {worker(found[f"{i:02}"]) for i in range(4, 16)} == {pids[1]}
    again = run_batch(tmp_path / "in", tmp_path / "out", pipeline=saboteur, scheduler=file)
    assert (again.done, again.skipped, again.failed) == (0, 16, 1)

    def stop(row):
        cluster.scheduler.kill()
        cluster.scheduler.wait()

    with pytest.raises(BatchError, match="the same batch to go on"):
        run_batch(tmp_path / "in", tmp_path / "new", pipeline=saboteur, scheduler=file, on_result=stop)
    first = rows(tmp_path / "new", strict=False)
    assert 1 <= len(first) < 16
    assert plan_batch(tmp_path / "in", tmp_path / "new", pipeline=saboteur).skipped == len(first) - ("bad" in first)


def test_a_scan_that_kills_its_workers(cluster, until, saboteur, write, rows, tmp_path):
    for i in range(4):
        write(tmp_path / "in" / f"{i}.ply", seed=i, order=1000 * (i == 0))
    file, processes = cluster(3, DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES="0")
    result = run_batch(tmp_path / "in", tmp_path / "out", pipeline=saboteur, scheduler=file)
    found = rows(tmp_path / "out")
    assert (result.done, result.failed) == (3, 1)
    assert found["0"]["error"] == WORKER_DIED
    until(lambda: sum(process.poll() is None for process in processes) == 1)


@pytest.mark.filterwarnings("ignore::glsk_o3d.SkeletonWarning")  # of work done in this process
def test_a_worker_is_killed_in_the_midst_of_a_scene(cluster, kill_first, saboteur, rows, write_points, tmp_path):
    ring = torus(4000, radius=0.05).points + [4500, 0, 0]  # wherever it is cut, workers wait at the gate
    scene = write_points(tmp_path / "scene.ply", ring)
    what = dict(pipeline=saboteur, tiles=0.5, overlap=0.12)
    file, processes = cluster(2)
    pids = [process.pid for process in processes]

    with ThreadPoolExecutor(1) as aside:
        killing = aside.submit(kill_first, processes)  # when both are in the middle of a tile
        result = run_batch(scene, tmp_path / "out", scheduler=file, **what)
        killing.result()
    found = rows(tmp_path / "out")
    assert (result.done, result.failed) == (len(found), 0)
    assert (found["scene"]["components"], found["scene"]["loops"], found["scene"]["unmatched"]) == (1, 1, 0)
    assert {worker(row) for row in found.values()} == {pids[1]}
    with ThreadPoolExecutor(1) as pool:
        run_batch(scene, tmp_path / "undisturbed", executor=pool, **what)
    results = [(tmp_path / out / "scene.ply").read_bytes() for out in ("out", "undisturbed")]
    assert results[0] == results[1]


@pytest.mark.parametrize("address", ["nonsense", "foo://a:1", "tcp://127.0.0.1:1"])
def test_nobody_there(write, tmp_path, monkeypatch, address):
    write(tmp_path / "in" / "a.ply")
    monkeypatch.setattr("glsk_o3d.batch.workers._SCHEDULER_SECONDS", 0.5)
    with pytest.raises(BatchError, match=f"{address}: no Dask scheduler answers there"):
        run_batch(tmp_path / "in", tmp_path / "out", scheduler=address)
