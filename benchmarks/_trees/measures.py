"""What foresters read, against trees of which it is known exactly."""

from __future__ import annotations

import numpy as np
from _common.results import pick
from _common.tables import Tables
from scipy.spatial import cKDTree

from glsk_o3d import pipelines
from glsk_o3d.analysis import cylinders, tree_measures

from .clouds import solid, volume

BREAST_HEIGHT = 1.3  # of the stem's diameter, in metres
MEASURED = ("volume", "stem_diameter", "height", "radius")


def measure(seed: int, condition: str) -> dict[str, float]:
    """Errors of one tree, as shares of what is true."""
    drawn = solid(seed, condition)
    skeleton = pipelines.tree()(drawn.points)
    found = tree_measures(skeleton)
    stem = np.interp(BREAST_HEIGHT + drawn.points[:, 2].min(), drawn.nodes[:7, 2], 2 * drawn.radii[:7])
    nearest = cKDTree(drawn.nodes).query(skeleton.vertices)[1]
    true = dict(
        volume=(cylinders(skeleton).volume.sum(), volume(drawn)),
        stem_diameter=(found.stem_diameter, stem),
        height=(found.height, (drawn.nodes[:, 2] + drawn.radii).max() - (drawn.nodes[:, 2] - drawn.radii).min()),
        radius=(np.median(skeleton.radii / drawn.radii[nearest]), 1.0),
    )
    return {name: float(mine / known - 1) for name, (mine, known) in true.items()}


def tables(rows: list[dict]) -> Tables:
    """The median error of each measure, its quartiles, and the worst."""
    lines = []
    for condition in dict.fromkeys(row["condition"] for row in rows):
        here = pick(rows, condition=condition)
        good = [row for row in here if "failure" not in row]
        for name in MEASURED if good else ():
            errors = 100 * np.array([row[name] for row in good])
            low, middle, high = np.quantile(errors, [0.25, 0.5, 0.75])
            size = np.abs(errors)
            cells = [f"{np.median(size):.1f}", f"{middle:+.1f} ({low:+.1f} to {high:+.1f})", f"{size.max():.1f}"]
            lines.append([f"{condition}: {name.replace('_', ' ')}", *cells, f"{len(here) - len(good)}"])
    trees = len({row["tree"] for row in rows})
    return [
        (
            f"Errors of {trees} trees, in percent",
            ["", "median size", "median (quartiles)", "largest", "failures"],
            lines,
        )
    ]
