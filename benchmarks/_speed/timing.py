"""Runs in turns, beside a yardstick, and in processes of their own."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from statistics import median
from typing import Any

from scipy.spatial import cKDTree

from .stopwatch import Stage, Stopwatch

NEIGHBOURS = 30  # of the yardstick
LEAST, MOST = 2.0, 50  # seconds that runs in turns go on for, however few were asked for, and turns at most


def in_turns(tasks: dict, repeat: int, stages: Mapping[str, Stage] | None = None) -> dict[Any, tuple[Any, dict]]:
    """Run tasks one after the other, again and again, so that what disturbs the machine disturbs them all.

    Parameters
    ----------
    tasks : dict of callables
    repeat : int
        Runs of each, at least; it goes on for `LEAST` seconds of CPU time.
    stages : mapping of str to Stage, optional

    Returns
    -------
    dict of (object, dict)
        For each task what its last run gave, and medians over the runs: ``cpu`` and ``wall`` seconds, and the same for
        every stage in ``stages``.
    """
    watches, results = {name: [] for name in tasks}, {}
    end = time.process_time() + LEAST
    turns = 0
    while turns < repeat or (turns < MOST and time.process_time() < end):
        for name, task in tasks.items():
            with Stopwatch(stages or {}) as watch:
                results[name] = task()
            watches[name].append(watch)
        turns += 1
    found = {}
    for name, taken in watches.items():
        facts = {clock: median(getattr(watch, clock) for watch in taken) for clock in ("cpu", "wall")}
        parts = {
            stage: {clock: median(getattr(watch.shares[stage], clock) for watch in taken) for clock in ("cpu", "wall")}
            for stage in taken[0].shares
        }
        found[name] = results[name], dict(facts, runs=turns, stages=parts)
    return found


def yardstick(points) -> None:
    """1 kNN."""
    cKDTree(points).query(points, NEIGHBOURS)


def fresh_python(code: str, *words: str | Path) -> tuple[str, float]:
    """What code prints in a process of its own, and the seconds from the start of Python to its end.

    Raises
    ------
    RuntimeError
        It failed; with the last line of what it said.
    """
    start = time.perf_counter()
    line = [sys.executable, "-W", "ignore", "-c", code, *map(str, words)]
    done = subprocess.run(line, capture_output=True, text=True)
    wall = time.perf_counter() - start
    if done.returncode:
        raise RuntimeError(done.stderr.strip().splitlines()[-1])
    return done.stdout, wall
