"""Clouds as scanners give them: what they cost, in one thread and in two."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from unittest.mock import patch

import numpy as np
import typer

from glsk_o3d import read_cloud
from glsk_o3d.interop.clouds import cloud_points

from .clouds import Case, cases, folder_or
from .runs import named, run
from .stages import costs, counts_of, growth
from .stopwatch import STAGES, in_turns, yardstick
from .tables import Tables, by_size, failures, good, grouped, middle, number, quartiles, short

NOISE = ("noise0.1", "noise0.3", "noise1")  # of the bodies, in percent of the diagonal
VIEWS = ("clean", "depth2", "misreg", "lidar")  # of the shapes of folders
OBJECTS = "scanned objects"
TWO = {"OMP_NUM_THREADS": "2"}  # the package asks at every call


@dataclass(frozen=True)
class Scan:
    """A cloud in a file, or so many of its points drawn at random."""

    shape: str
    path: Path
    n: int

    def load(self) -> tuple[np.ndarray, None]:
        """The points, and no axis."""
        points = cloud_points(read_cloud(self.path))
        return np.random.default_rng(1).choice(points, self.n, replace=False), None


def scanned(sizes: Sequence[int]) -> list[Scan]:
    """The scans of $GLSK_DATA, or of the folder shared/data beside the repository, that are large enough."""
    try:
        folder = folder_or(None, "GLSK_DATA", "shared/data")
    except typer.BadParameter as problem:
        typer.echo(f"left out: scans, {problem}", err=True)
        return []
    found: list[Scan] = []
    listed = json.loads((folder / "manifest.json").read_text())
    for n in sizes:
        large = [it for it in listed if it["n_points"] >= n]
        if len(large) < len(listed):
            typer.echo(f"left out: {len(listed) - len(large)} clouds of less than {n} points", err=True)
        found += [Scan(it["name"], folder / it["path"], n) for it in large]
    return found


def clouds(folders: Sequence[Path], sizes: Sequence[int]) -> list[tuple[str, int, Case | Scan]]:
    """Kind, size and cloud: the package's own bodies with noise, the scans in folders, and scanned objects."""
    found: list[tuple[str, int, Case | Scan]] = []
    for kind in (*NOISE, *(VIEWS if folders else ())):
        own = kind in NOISE
        variants = ",".join(f"{kind}_{n}" for n in sizes)
        found += [(kind, case.size, case) for case in cases(None if own else folders, own, variants)]
    return found + [(OBJECTS, scan.n, scan) for scan in scanned(sizes)]


def scan_costs(cloud: Case | Scan, pipeline: str, repeat: int) -> dict:
    """The yardstick and the pipeline in turns, in one thread and in two."""
    points = cloud.load()[0]

    def skeleton() -> dict:
        return counts_of(named(pipeline)[pipeline](points))

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
    return run(scan_costs, work, min(jobs, 1))


def scan_tables(rows: list[dict]) -> Tables:
    """What each kind costs, and how that grows; and what the stages have of it."""
    header = ["", "points", "clouds", "1 kNN ms", "in kNN, median (quartiles)", "contracted", "wall ms, one thread"]
    header += ["two threads", "growth", "note"]
    lines, shares = [], []
    for kind, those in grouped(rows, "kind").items():
        at = by_size(good(those))
        slope = number(growth(at, costs(at, "whole")), 2)
        for n, here in at.items():
            spent = quartiles(np.array([row["cpu"] / row["knn_cpu"] for row in here]), 1)
            cells = [kind, str(n), str(len(here)), short(1000 * middle(here, "knn_cpu")), spent]
            cells += [f"{middle(here, 'contracted'):.0f}"]
            cells += [short(1000 * middle(here, key)) for key in ("wall", "wall_of_two")]
            lines.append([*cells, slope, failures(those)])
            parts = [middle(here, lambda row, it=it: row["stages"][it]["cpu"] / row["knn_cpu"]) for it in STAGES]
            shares.append([kind, str(n), *(number(part, 2) for part in parts)])
    return [("scans, CPU", header, lines), ("of it the stages, in kNN", ["", "points", *STAGES], shares)]
