"""What large trees cost."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
from _common.tables import Tables, short
from _speed.stopwatch import MB, peak, reset_peak, resident

from glsk_o3d import samples
from glsk_o3d.recipes.catalogue import named_pipeline

from .clouds import CAMERAS

NOISE = 0.001  # share of the diagonal, 7 mm
PIPELINES = {"default, untraced": ("default", {"Tracer.surface": 0}), "default": ("default", {}), "tree": ("tree", {})}


def scan(n: int, forks: int) -> np.ndarray:
    """So many points of one tree, as a lidar sees it from three places."""
    return samples.tree(n, forks=forks, seed=1, noise=NOISE, cameras=CAMERAS).points


def once(path: Path, pipeline: str) -> dict:
    """One run on a saved scan, to be made in a fresh process."""
    points = np.load(path)
    name, options = PIPELINES[pipeline]
    chosen = named_pipeline(name).with_options(options)
    reset_peak()
    before, start = resident(), (time.process_time(), time.perf_counter())
    skeleton = chosen(points)
    facts = dict(cpu=time.process_time() - start[0], wall=time.perf_counter() - start[1], peak=(peak() - before) / MB)
    counts = dict(components=skeleton.n_components, loops=skeleton.n_loops, tips=len(skeleton.leaves))
    return facts | counts | dict(traced=skeleton.report.n_traced)


def tables(rows: list[dict]) -> Tables:
    """A line for each size and pipeline."""
    lines = []
    for row in rows:
        if "failure" in row:
            lines.append([row["pipeline"], str(row["n"]), *"-" * 7, row["failure"]])
            continue
        counts = [str(row[key]) for key in ("components", "loops", "tips", "traced")]
        lines.append(
            [row["pipeline"], str(row["n"]), *(short(row[key]) for key in ("cpu", "wall", "peak")), *counts, ""]
        )
    header = ["", "points", "CPU s", "wall s", "MB", "components", "loops", "tips", "traced", "note"]
    return [("Lidar scans of one tree", header, lines)]
