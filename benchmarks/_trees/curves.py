"""Skeletons of sparse trees against their axes."""

from __future__ import annotations

from statistics import fmean

import numpy as np
from _common.results import pick
from _common.tables import Tables, number
from _peers import Peer, skeleton_of

from glsk_o3d.analysis.curves import distances
from glsk_o3d.skeleton import Skeleton

from .clouds import SparseTree
from .tools import TOOLS

STEP = 0.002  # between the places at which curves are measured, as a share of the diagonal
CLOSE = 0.01  # places nearer to the other curve are right, as a share of the diagonal
MEASURED = ("f1", "precision", "recall", "accuracy", "completeness", "tips", "components", "loops", "cpu")


def score(points: np.ndarray, axis: Skeleton, found: Skeleton) -> dict[str, float]:
    """Shares of both curves that are close to the other, mean distances in percent of the diagonal, and topology."""
    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    there, back = (distances(*pair, STEP * diagonal)[0] / diagonal for pair in ((found, axis), (axis, found)))
    precision, recall = (float((way < CLOSE).mean()) for way in (there, back))
    return dict(
        f1=2 * precision * recall / max(precision + recall, 1e-9),
        precision=precision,
        recall=recall,
        accuracy=100 * float(there.mean()),
        completeness=100 * float(back.mean()),
        tips=len(found.leaves) / len(axis.leaves),
        components=found.n_components,
        loops=found.n_loops,
    )


def measure(tree: SparseTree, tool: Peer) -> dict:
    """One skeleton against its axis."""
    points, nodes, edges = tree.load()
    found, cpu = tool.timed(points)
    return dict(cpu=cpu, points=len(points)) | score(points, skeleton_of(nodes, edges), found)


def tables(rows: list[dict]) -> Tables:
    """F1 in every condition at a glance, and then a table for each condition."""
    conditions, tools = (list(dict.fromkeys(row[key] for row in rows)) for key in ("condition", "tool"))
    trees = len({row["tree"] for row in rows})
    lines = []
    for tool in tools:
        means = [mean(pick(rows, tool=tool, condition=it)) for it in conditions]
        here = pick(rows, tool=tool)
        whole = sum(row.get("components") == 1 and row.get("loops") == 0 for row in here)
        clean = [number(means[0][key], 2) for key in ("accuracy", "completeness", "tips", "cpu")]
        cells = [*(number(it["f1"], 2) for it in means), f"{whole}/{len(here)}", *clean]
        lines.append([TOOLS[tool].label, *cells, failed(here)])
    header = ["", *conditions, "one tree", "accuracy %", "completeness %", "tips", "CPU s", "failed"]
    found = [(f"F1 of {trees} sparse trees, and more of the {conditions[0]} ones", header, lines)]
    header = ["", "f1", "precision", "recall", "accuracy %", "completeness %", "components", "loops", "tips", "failed"]
    for condition in conditions:
        lines = []
        for tool in tools:
            here = pick(rows, tool=tool, condition=condition)
            it = mean(here)
            shares = [number(it[key], 2) for key in ("f1", "precision", "recall", "accuracy", "completeness")]
            counts = [number(it[key], 1) for key in ("components", "loops")]
            lines.append([TOOLS[tool].label, *shares, *counts, number(it["tips"], 2), failed(here)])
        found.append((condition, header, lines))
    return found


def mean(rows: list[dict]) -> dict[str, float]:
    """Over the trees that gave a skeleton."""
    good = [row for row in rows if "failure" not in row]
    return {key: fmean(row[key] for row in good) if good else float("nan") for key in MEASURED}


def failed(rows: list[dict]) -> str:
    """Which failed, and how."""
    return ", ".join(f"{row['tree']} {row['condition']} ({row['failure']})" for row in rows if "failure" in row)
