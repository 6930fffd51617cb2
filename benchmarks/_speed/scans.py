"""What clouds cost as scanners give them: bodies with noise, scans of shapes, and scanned objects."""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from unittest.mock import patch

import numpy as np
from _common.clouds import Case, cases
from _common.command_line import named
from _common.results import pick
from _common.runs import run
from _common.tables import Tables, number, short

from .figures import Scan, scanned
from .stages import growth, told
from .table_of_stages import STAGES
from .timing import in_turns, yardstick

NOISE = ("noise0.1", "noise0.3", "noise1")  # of the bodies, in percent of the diagonal
VIEWS = ("depth2", "misreg", "lidar")  # of the shapes of folders
OBJECTS = "scanned objects"
TWO = {"OMP_NUM_THREADS": "2"}  # the package asks at every call


def clouds(folders: Sequence[Path], sizes: Sequence[int]) -> list[tuple[str, int, Case | Scan]]:
    """Kind, size and cloud: the package's own bodies with noise, the scans in folders, and scanned objects."""
    found: list[tuple[str, int, Case | Scan]] = []
    for kind in NOISE:
        found += [(kind, case.size, case) for case in cases(None, True, _variants(kind, sizes))]
    if folders:
        for kind in VIEWS:
            found += [(kind, case.size, case) for case in cases(folders, False, _variants(kind, sizes))]
    return found + [(OBJECTS, scan.n, scan) for scan in scanned(sizes)]


def _variants(kind: str, sizes: Sequence[int]) -> str:
    return ",".join(f"{kind}_{n}" for n in sizes)


def timed(cloud: Case | Scan, pipeline: str, repeat: int) -> dict:
    """The yardstick and the pipeline in turns, in one thread and in two."""
    points = cloud.load()[0]

    def skeleton() -> dict:
        return told(named(pipeline)[pipeline](points))

    tasks = {"1 kNN": partial(yardstick, points), "one": skeleton, "two": patch.dict(os.environ, TWO)(skeleton)}
    found = in_turns(tasks, repeat, STAGES)
    facts, costs = found["one"]
    knn, wall = found["1 kNN"][1], found["two"][1]["wall"]
    return facts | costs | dict(knn_cpu=knn["cpu"], knn_wall=knn["wall"], wall_of_two=wall)


def measure_scans(folders: Sequence[Path], sizes: list[int], pipeline: str, repeat: int, jobs: int) -> list[dict]:
    """A row for each cloud."""
    named(pipeline)
    work = [
        (dict(measure="scans", kind=kind, n=n, shape=cloud.shape), (cloud, pipeline, repeat))
        for kind, n, cloud in clouds(folders, sizes)
    ]
    return run(timed, work, min(jobs, 1))


def scan_tables(rows: list[dict]) -> Tables:
    """What each kind costs, and how that grows; and what the stages have of it."""
    header = ["", "points", "clouds", "1 kNN ms", "in kNN, median (quartiles)", "contracted", "wall ms, one thread"]
    header += ["two threads", "growth", "note"]
    lines, shares = [], []
    for kind in dict.fromkeys(row["kind"] for row in rows):
        mine = [row for row in pick(rows, kind=kind) if "failure" not in row]
        sizes = sorted({row["n"] for row in mine})
        at = {n: pick(mine, n=n) for n in sizes}
        slope = growth(sizes, [_median(at[n], "cpu") for n in sizes])
        failed = pick(rows, kind=kind)
        note = "; ".join(f"{row['shape']}: {row['failure']}" for row in failed if "failure" in row)
        for n in sizes:
            low, middle, high = np.quantile([row["cpu"] / row["knn_cpu"] for row in at[n]], [0.25, 0.5, 0.75])
            cells = [kind, str(n), str(len(at[n])), short(1000 * _median(at[n], "knn_cpu"))]
            cells += [f"{middle:.1f} ({low:.1f} to {high:.1f})", f"{_median(at[n], 'contracted'):.0f}"]
            cells += [short(1000 * _median(at[n], key)) for key in ("wall", "wall_of_two")]
            lines.append([*cells, number(slope, 2), note])
            of_stages = [np.median([row["stages"][stage]["cpu"] / row["knn_cpu"] for row in at[n]]) for stage in STAGES]
            shares.append([kind, str(n), *(number(float(share), 2) for share in of_stages)])
    return [("scans, CPU", header, lines), ("of it the stages, in kNN", ["", "points", *STAGES], shares)]


def _median(rows: list[dict], key: str) -> float:
    return float(np.median([row[key] for row in rows]))
