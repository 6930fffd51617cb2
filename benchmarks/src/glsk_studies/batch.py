"""``glsk batch`` on many generated clouds, some of them corrupt: the ledger, the rate, and what a killed worker costs.

Everything is run as its users run it: the command ``glsk``, as a process.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Annotated

import numpy as np
import psutil
import typer

from glsk_o3d import samples
from glsk_o3d.io.formats import ply

from .runs import Output, application
from .tables import Table, fixed, number, present, save, table

SHAPES = (
    *(samples.tube, samples.torus, samples.y_junction, samples.two_rings, samples.helix),
    partial(samples.sauropod, cameras=None),
)
CORRUPT = ("empty.ply", "truncated.ply", "garbage.xyz", "nan.ply", "a_ply.pcd")
app = application(None)


def make_scans(folder: Path, count: int, smallest: int, largest: int) -> None:
    """Write clouds of all kinds, sizes and seeds, and in their midst five that are corrupt."""
    rng = np.random.default_rng(0)
    for i in range(count):
        n = int(smallest * (largest / smallest) ** rng.random())
        cloud = SHAPES[i % len(SHAPES)](n, noise=0.002 * (i % 3), seed=i).points
        ply.save(folder / f"{i:04}.ply", {"positions": cloud})
    whole = samples.torus(1024).points
    empty, cut, garbage, nan, other = (folder / f"{count * i // 6:04}_{name}" for i, name in enumerate(CORRUPT, 1))
    empty.touch()
    ply.save(cut, {"positions": whole})
    cut.write_bytes(cut.read_bytes()[:-5000])
    garbage.write_text("this is no cloud\n" * 100)
    ply.save(nan, {"positions": np.full_like(whole, np.nan)})
    ply.save(other, {"positions": whole})


def command(scans: Path, out: Path, *words: str) -> list[str]:
    """`glsk batch` as a list of words."""
    return [sys.executable, "-m", "glsk_o3d", "batch", str(scans), "-o", str(out), "--json", *words]


def glsk_batch(scans: Path, out: Path, *words: str) -> dict:
    """Run the command; gives what it printed, with its wall seconds."""
    start = time.perf_counter()
    run = subprocess.run(command(scans, out, *words), capture_output=True, text=True)
    if run.returncode not in (0, 1):
        raise RuntimeError(run.stderr)
    return {**json.loads(run.stdout), "wall": time.perf_counter() - start}


def ledger(out: Path) -> list[dict]:
    """The rows of a ledger."""
    path = out / "ledger.jsonl"
    return [json.loads(line) for line in path.read_bytes().splitlines()] if path.exists() else []


def kill_one(scans: Path, out: Path, after: int, *words: str) -> dict:
    """Kill one of two workers once some scans or tiles are done; gives what became of all."""
    start, path = time.perf_counter(), out / "ledger.jsonl"
    line = command(scans, out, *words, "--workers", "2")
    run = subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    while not path.exists() or path.read_bytes().count(b'"done"') < after:
        time.sleep(0.02)
    killed = next(child for child in psutil.Process(run.pid).children() if "spawn_main" in " ".join(child.cmdline()))
    killed.kill()
    run.wait()
    seconds = time.perf_counter() - start
    rows = ledger(out)
    per_worker = Counter(int(row["worker"].split()[-1]) for row in rows)
    done = [row for row in rows if row["status"] == "done"]
    return {
        "exit code": run.returncode,
        "seconds": seconds,
        "lines": len(rows),
        "inputs named twice": len(rows) - len({row["input"] for row in rows}),
        "done": len(done),
        "done without output": sum(not (out / name).is_file() for row in done for name in row["outputs"]),
        "failed": sorted(row["name"] for row in rows if row["status"] == "failed"),
        "by the killed worker": per_worker[killed.pid],
    }


def measured(scans: Path, folder: Path, workers: int) -> list[dict]:
    """A row for a batch, and for the same again."""
    rows = []
    for run in ("first", "again"):
        row = {"run": run, "workers": workers, "load": os.getloadavg()[0]}
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        row |= glsk_batch(scans, folder / f"local{workers}", "--workers", str(workers))
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        rows.append(row | {"cpu": after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime})
    return rows


def facts_table(title: str, facts: Mapping[str, object]) -> Table:
    """A line for each fact."""
    cells = [[name, number(it, 4) if isinstance(it, float) else str(it)] for name, it in facts.items()]
    return title, ["", "note"], cells


@app.command()
def main(
    count: Annotated[int, typer.Option("--count", min=10, help="Clouds, besides the five corrupt ones.")] = 495,
    largest: Annotated[int, typer.Option("--largest", min=1024, help="Points; the smallest have 1024.")] = 8192,
    output: Output = None,
) -> None:
    """Measure the rate of batches, and kill a worker in the midst of one."""
    with tempfile.TemporaryDirectory() as name:
        folder, scans = Path(name), Path(name, "scans")
        scans.mkdir()
        make_scans(scans, count, 1024, largest)
        rows = [row for workers in (1, 2) for row in measured(scans, folder, workers)]
        killed = kill_one(scans, folder / "killed", count // 4)
        failed = [row for row in ledger(folder / "local1") if row["status"] == "failed"]
    title = f"{count} clouds of 1024 to {largest} points and 5 corrupt ones, {os.cpu_count()} cores"
    columns = {name: name for name in ("run", "workers", "done", "skipped", "failed")}
    columns |= {"seconds": fixed("wall", 1), "CPU s": fixed("cpu", 1), "clouds/s": fixed("clouds_per_second", 1)}
    reasons = {Path(row["input"]).name: row["error"] for row in failed}
    tables = [table(title, rows, {**columns, "load before": fixed("load", 1)}, note=False)]
    present([*tables, facts_table("What failed", reasons), facts_table("One of two workers killed", killed)])
    save(output, [*rows, {"run": "one of two workers killed", **killed}])
