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
from functools import partial
from pathlib import Path
from typing import Annotated

import numpy as np
import psutil
import typer

from glsk_o3d import samples
from glsk_o3d.io.formats import ply

from .runs import Markdown, Output
from .tables import number, present, save

SHAPES = (
    *(samples.tube, samples.torus, samples.y_junction, samples.two_rings, samples.helix),
    partial(samples.sauropod, cameras=None),
)
CORRUPT = ("empty.ply", "truncated.ply", "garbage.xyz", "nan.ply", "a_ply.pcd")
app = typer.Typer(add_completion=False)


def write_ply(path: Path, points) -> None:
    """Write points as binary PLY."""
    rows = ply.rows_of(dict(zip("xyz", np.asarray(points, float).T, strict=True)))
    path.write_bytes(ply.header_of(rows.dtype, len(rows)) + rows.tobytes())


def make_scans(folder: Path, count: int, smallest: int, largest: int) -> None:
    """Write clouds of all kinds, sizes and seeds, and in their midst five that are corrupt."""
    rng = np.random.default_rng(0)
    for i in range(count):
        n = int(smallest * (largest / smallest) ** rng.random())
        write_ply(folder / f"{i:04}.ply", SHAPES[i % len(SHAPES)](n, noise=0.002 * (i % 3), seed=i).points)
    whole = samples.torus(1024).points
    empty, cut, garbage, nan, other = (folder / f"{count * i // 6:04}_{name}" for i, name in enumerate(CORRUPT, 1))
    empty.touch()
    write_ply(cut, whole)
    cut.write_bytes(cut.read_bytes()[:-5000])
    garbage.write_text("this is no cloud\n" * 100)
    write_ply(nan, np.full_like(whole, np.nan))
    write_ply(other, whole)


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


@app.command()
def main(
    count: Annotated[int, typer.Option("--count", min=10, help="Clouds, besides the five corrupt ones.")] = 495,
    smallest: Annotated[int, typer.Option("--smallest", min=256, help="Points.")] = 1024,
    largest: Annotated[int, typer.Option("--largest", min=256, help="Points.")] = 8192,
    workers: Annotated[str, typer.Option("--workers", metavar="NUMBERS", help="With commas.")] = "1,2",
    markdown: Markdown = False,
    output: Output = None,
) -> None:
    """Measure the rate of batches, and kill a worker in the midst of one."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        scans = folder / "scans"
        scans.mkdir()
        make_scans(scans, count, smallest, largest)
        each = [int(word) for word in workers.split(",")]
        rows = [row for n in each for row in measured(scans, folder, n)]
        killed = kill_one(scans, folder / "killed", count // 4)
        failures = [row for row in ledger(folder / f"local{each[0]}") if row["status"] == "failed"]
    title = f"{count} clouds of {smallest} to {largest} points and 5 corrupt ones, {os.cpu_count()} cores"
    header = ["run", "workers", "done", "skipped", "failed", "seconds", "CPU s", "clouds/s", "load before"]
    lines = []
    for row in rows:
        values = [number(row[key], 1) for key in ("wall", "cpu", "clouds_per_second", "load")]
        lines.append([row["run"], *(str(row[key]) for key in ("workers", "done", "skipped", "failed")), *values])
    reasons = [[Path(row["input"]).name, row["error"]] for row in failures]
    facts = [[key, str(value)] for key, value in killed.items()]
    tables = [(title, header, lines), ("What failed", ["input", "note"], reasons)]
    present([*tables, ("One of two workers killed", ["", "note"], facts)], markdown)
    save(output, [*rows, {"run": "one of two workers killed", **killed}])
