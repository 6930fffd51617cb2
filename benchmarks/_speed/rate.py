"""Skeletons per second, in a fresh process and after."""

from __future__ import annotations

import json
import os
import tempfile
from itertools import product
from pathlib import Path
from statistics import median
from unittest.mock import patch

import numpy as np
from _common.clouds import builtin
from _common.command_line import named
from _common.runs import run
from _common.tables import Tables, number, short

from glsk_o3d.numerics.cores import cores

from .stages import timed
from .timing import fresh_python

COLD = """
import json, sys, time
start = time.perf_counter(), time.process_time()
from glsk_o3d import skeletonize
imported = time.perf_counter(), time.process_time()
import numpy
points = numpy.load(sys.argv[1])
begun = time.perf_counter(), time.process_time()
skeletonize(points, sys.argv[2])
done = time.perf_counter(), time.process_time()
spent = dict(import_wall=imported[0] - start[0], import_cpu=imported[1] - start[1])
print(json.dumps(dict(spent, first_wall=done[0] - begun[0], first_cpu=done[1] - begun[1])))
"""
"""A fresh process: what the import and the first call take."""


def cold(path: Path, pipeline: str, repeat: int) -> dict[str, float]:
    """Medians over fresh processes."""
    found = []
    for _ in range(repeat):
        spent, wall = fresh_python(COLD, path, pipeline)
        found.append(json.loads(spent) | dict(process_wall=wall))
    return {name: median(each[name] for each in found) for name in found[0]}


def first_and_next(path: Path, pipeline: str, repeat: int, threads: int) -> dict:
    """Cold and warm, one after the other."""
    with patch.dict(os.environ, OMP_NUM_THREADS=str(threads)):  # the package asks at every call
        return cold(path, pipeline, repeat) | timed(path, named(pipeline), repeat)[pipeline]


def measure_rate(sizes: list[int], pipelines: list[str], shape: str, repeat: int, jobs: int) -> list[dict]:
    """A row for each size and pipeline, in one thread and in one for each core."""
    named(",".join(pipelines))
    with tempfile.TemporaryDirectory() as folder:
        work = []
        for n in sizes:
            path = Path(folder, f"{n}.npy")
            np.save(path, builtin(shape, f"clean_{n}")[0])
            facts = dict(measure="rate", n=n, shape=shape)
            for name, threads in product(pipelines, sorted({1, cores()})):
                work.append((facts | dict(pipeline=name, threads=threads), (path, name, repeat, threads)))
        return run(first_and_next, work, min(jobs, 1))


def rate_tables(rows: list[dict]) -> Tables:
    """Cold and warm."""
    header = ["", "points", "threads", "1 kNN ms", "import ms", "first call ms", "process ms"]
    header += ["next call ms", "CPU ms", "per second", "first process per second", "note"]
    lines = []
    for row in rows:
        if "failure" in row:
            lines.append([row["pipeline"], str(row["n"]), str(row["threads"]), *"-" * 8, row["failure"]])
            continue
        keys = ("knn_wall", "import_wall", "first_wall", "process_wall", "wall", "cpu")
        rates = [number(1 / row[key], 1) for key in ("wall", "process_wall")]
        times = (short(1000 * row[key]) for key in keys)
        lines.append([row["pipeline"], str(row["n"]), str(row["threads"]), *times, *rates, ""])
    return [("skeletons per second, wall time", header, lines)]
