"""Loops of real clouds whose number is known."""

from __future__ import annotations

import json
import time
from pathlib import Path
from statistics import median

from _common.runs import run
from _common.tables import Tables, number

from glsk_o3d import Pipeline, read_cloud

from .measuring import by_pipeline


def looped(path: Path, pipeline: Pipeline) -> dict:
    """Loops and CPU seconds of a cloud in a file."""
    cloud = read_cloud(path)
    start = time.process_time()
    skeleton = pipeline(cloud)
    seconds = time.process_time() - start
    return dict(cpu=seconds, points=skeleton.report.n_input, components=skeleton.n_components, loops=skeleton.n_loops)


def measure_loops(folder: Path, pipelines: dict[str, Pipeline], largest: int, jobs: int) -> list[dict]:
    """A row for each pipeline and cloud of the folder's manifest that has a known number of loops."""
    listed = json.loads((folder / "manifest.json").read_text())
    listed = [it for it in listed if it["meaningful_skeleton"] and it["loops"] is not None]
    listed = [it for it in listed if it["n_points"] <= largest]
    listed.sort(key=lambda it: it["n_points"], reverse=True)  # the long ones first, so that no process is left alone
    work = [
        (dict(pipeline=name, cloud=it["name"], expected=it["loops"]), (folder / it["path"], pipeline))
        for it in listed
        for name, pipeline in pipelines.items()
    ]
    return run(looped, work, jobs)


def loop_tables(rows: list[dict]) -> Tables:
    """A table per pipeline."""
    header = ["cloud", "points", "CPU s", "per point", "components", "loops", "expected", "right", "note"]
    tables = []
    for name, here in by_pipeline(rows).items():
        each = [row["cpu"] / row["points"] for row in here if "failure" not in row]
        lines = []
        for row in here:
            if "failure" in row:
                lines.append([row["cloud"], *"-" * 5, str(row["expected"]), "no", row["failure"]])
                continue
            cost = number(row["cpu"] / row["points"] / median(each), 2)
            counts = [str(row[key]) for key in ("components", "loops", "expected")]
            right = "yes" if row["loops"] == row["expected"] else "no"
            lines.append([row["cloud"], str(row["points"]), number(row["cpu"], 2), cost, *counts, right, ""])
        total = sum(line[7] == "yes" for line in lines)
        tables.append((f"{name}: {total} of {len(lines)} right", header, lines))
    return tables
