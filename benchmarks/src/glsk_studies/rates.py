"""Skeletons per second: in a fresh process and after, and of the frames of a depth camera."""

from __future__ import annotations

import json
import os
import tempfile
import time
import warnings
from collections.abc import Callable
from functools import partial
from itertools import product
from multiprocessing import get_context
from pathlib import Path
from statistics import median
from unittest.mock import patch

import numpy as np
from glsk_bench.scanning import depth_image, places_at
from glsk_bench.shapes import shape

from glsk_o3d import SkeletonWarning, skeletonize
from glsk_o3d.data.skeleton import ARRAYS
from glsk_o3d.geometry.cores import cores

from .clouds import builtin
from .runs import named, run
from .stages import timed
from .stopwatch import fresh_python, in_turns, yardstick
from .tables import Tables, brief, number, table

FRAMES, TURN = 30, 60.0  # of a camera, and the degrees that it turns by around the scene meanwhile
CAMERA_HEIGHT = 20.0  # degrees
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
COLD_FACTS = {"import": "import", "first call": "first", "process": "process"}


def first_and_next(path: Path, pipeline: str, repeat: int, threads: int) -> dict:
    """Medians over fresh processes, and what runs take that follow each other in one."""
    with patch.dict(os.environ, OMP_NUM_THREADS=str(threads)):  # the package asks at every call
        found = []
        for _ in range(repeat):
            spent, wall = fresh_python(COLD, path, pipeline)
            found.append(json.loads(spent) | dict(process_wall=wall))
        cold = {name: median(each[name] for each in found) for name in found[0]}
        return cold | timed(path, named(pipeline)[pipeline], repeat)


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
    columns = {"": "pipeline", "points": "n", "threads": "threads", "1 kNN ms": brief("knn_wall", 1000)}
    columns |= {f"{what} ms": brief(f"{fact}_wall", 1000) for what, fact in COLD_FACTS.items()}
    columns |= {"next call ms": brief("wall", 1000), "CPU ms": brief("cpu", 1000), "per second": per_second("wall")}
    columns |= {"first process per second": per_second("process_wall")}
    return [table("skeletons per second, wall time", rows, columns)]


def per_second(fact: str) -> Callable[[dict], str]:
    """A column of how often what takes so many seconds can be done in one."""
    return lambda row: number(1 / row[fact], 1)


def frames(family: str, seed: int, n: int) -> list[np.ndarray]:
    """What a depth camera that turns around a random shape sees, n points a frame."""
    scene, rng = shape(family, seed), np.random.default_rng(seed)
    eyes = places_at(np.radians(np.linspace(0, TURN, FRAMES)), np.full(FRAMES, np.radians(CAMERA_HEIGHT)))
    return [depth_image(scene, eye, n, rng) for eye in eyes]


def measure_stream(sizes: list[int], families: list[str], repeat: int) -> list[dict]:
    """A row for each size, family and number of workers: frames per second, once all processes have begun."""
    warnings.simplefilter("ignore", SkeletonWarning)
    rows = []
    for n, family in product(sizes, families):
        seen = frames(family, 0, n)
        knn = in_turns({"1 kNN": partial(yardstick, seen[0])}, repeat)["1 kNN"][1]["wall"]
        expected = [skeletonize(frame) for frame in seen]
        for workers in sorted({1, cores()}):
            spent = []
            with get_context("spawn").Pool(workers) as pool:
                pool.map(skeletonize, seen[: 2 * workers])
                for _ in range(repeat):
                    start = time.perf_counter()
                    found = list(pool.imap(skeletonize, seen))
                    spent.append((time.perf_counter() - start) / FRAMES)
            same = all(
                np.array_equal(getattr(one, name), getattr(other, name), equal_nan=True)
                for one, other in zip(found, expected, strict=True)
                for name in ARRAYS
            )
            facts = dict(measure="stream", n=n, shape=family, workers=workers, same=same)
            rows.append(facts | dict(knn_wall=knn, wall=median(spent), least=min(spent), most=max(spent)))
    return rows


def stream_tables(rows: list[dict]) -> Tables:
    """Frames per second of streams."""
    columns = {"scene": "shape", "points": "n", "workers": "workers", "1 kNN ms": brief("knn_wall", 1000)}
    columns |= {"a frame ms": brief("wall", 1000), "frames per second": per_second("wall")}
    columns |= {"least": per_second("most"), "most": per_second("least")}
    columns |= {"same bits": lambda row: "yes" if row["same"] else "no"}
    return [table(f"streams of {FRAMES} depth frames, wall time", rows, columns, note=False)]
