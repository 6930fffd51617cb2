"""The authors' own code, as far as runs of it are recorded: three clouds of 1024 points in tests/golden."""

from __future__ import annotations

import numpy as np
from _common.results import ROOT
from _common.tables import Table
from _peers import skeleton_of

from glsk_o3d import Skeleton
from glsk_o3d.recipes.catalogue import named_pipeline

GOLDEN = ROOT / "tests" / "golden"
KNOWN = {"y_unequal": (1, 0, 3), "torus": (1, 1, 0), "quadruped": (1, 0, 6)}  # components, loops, leaves
OURS = ("wen2024", "cao2010", "default")


def table() -> Table:
    """Components, loops and leaves of what was recorded, and of ours from the same points."""
    lines: dict[str, list[str]] = {"right": [_told(known) for known in KNOWN.values()]}
    for shape in KNOWN:
        with np.load(GOLDEN / f"{shape}_1024.npz") as file:
            recorded = dict(file)
        theirs = {"published code": "skeleton", "its baseline of 2010": "cao_skeleton"}
        found = {
            name: skeleton_of(recorded[f"{word}_vertices"], recorded[f"{word}_edges"]) for name, word in theirs.items()
        }
        found |= {f"`{name}`": named_pipeline(name)(recorded["points"]) for name in OURS}
        for name, skeleton in found.items():
            lines.setdefault(name, []).append(_told(_counts(skeleton)))
    return "components / loops / leaves", ["", *KNOWN], [[name, *cells] for name, cells in lines.items()]


def _counts(skeleton: Skeleton) -> tuple[int, int, int]:
    return skeleton.n_components, skeleton.n_loops, len(skeleton.leaves)


def _told(counts: tuple[int, int, int]) -> str:
    return " / ".join(map(str, counts))
