"""What changes when a cloud is turned and shuffled."""

from __future__ import annotations

from statistics import median

import numpy as np
from _common.clouds import Case
from _common.tables import Tables, number
from scipy.spatial.transform import Rotation

from glsk_o3d import Pipeline

from .axis import feet, local_radius
from .measuring import by_variant


def turned(case: Case, count: int, pipeline: Pipeline) -> dict:
    """What changes when the cloud is turned at random and its points are shuffled."""
    points, axis = case.load()
    rng = np.random.default_rng(0)
    first = pipeline(points)
    moves, topology, leaves = [], 0, 0
    for _ in range(count):
        rotation = Rotation.from_quat(rng.normal(size=4)).as_matrix()
        other = pipeline((points @ rotation.T)[rng.permutation(len(points))])
        back = other.vertices @ rotation
        there = feet(back, first.vertices, first.edges)[0] / local_radius(axis, back)
        here = feet(first.vertices, back, other.edges)[0] / local_radius(axis, first.vertices)
        moves.append(float(max(there.max(), here.max())))
        topology += (other.n_loops, other.n_components) != (first.n_loops, first.n_components)
        leaves += len(other.leaves) != len(first.leaves)
    return dict(runs=count, topology_changes=topology, leaf_changes=leaves, moves=moves)


def turn_tables(rows: list[dict]) -> Tables:
    """A table per variant."""
    header = ["shape", "turns", "topology changes", "leaf changes", "median move", "largest move", "note"]
    tables = []
    for variant, here in by_variant(rows).items():
        lines = []
        for row in here:
            counts = [str(row.get(key, "-")) for key in ("runs", "topology_changes", "leaf_changes")]
            moves = [number(of(row["moves"])) if "moves" in row else "-" for of in (median, max)]
            lines.append([row["shape"], *counts, *moves, row.get("failure", "")])
        tables.append((variant, header, lines))
    return tables
