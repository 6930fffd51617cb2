"""Skeletons against known axes."""

from __future__ import annotations

import time
from statistics import median

from _common.clouds import Case
from _common.results import pick
from _common.runs import run

from glsk_o3d import Pipeline
from glsk_o3d.analysis import compare


def measure(case: Case, pipeline: Pipeline, repeat: int = 1) -> dict:
    """One skeleton against its axis; CPU seconds are the median of `repeat` runs."""
    points, truth = case.load()
    seconds = []
    for _ in range(repeat):
        start = time.process_time()
        skeleton = pipeline(points)
        seconds.append(time.process_time() - start)
    facts = dict(cpu=median(seconds), vertices=len(skeleton.vertices), solves=len(skeleton.report.iterations))
    return facts | compare(skeleton, truth).as_dict()


def measured(found: list[Case], pipelines: dict[str, Pipeline], jobs: int, repeat: int = 1) -> list[dict]:
    """`measure` for every case and pipeline."""
    work = [
        (dict(pipeline=name, **case.facts), (case, pipeline, repeat))
        for case in found
        for name, pipeline in pipelines.items()
    ]
    return run(measure, work, jobs)


def by_pipeline(rows: list[dict]) -> dict[str, list[dict]]:
    """The rows of each pipeline, in their order."""
    return _by("pipeline", rows)


def by_variant(rows: list[dict]) -> dict[str, list[dict]]:
    """The rows of each variant, in their order."""
    return _by("variant", rows)


def by_family(rows: list[dict]) -> dict[str, list[dict]]:
    """The rows of each family of shapes, in their order."""
    return _by("family", rows)


def _by(fact, rows):
    return {name: pick(rows, **{fact: name}) for name in dict.fromkeys(row[fact] for row in rows)}
