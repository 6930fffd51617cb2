"""Grasps judged by what is inside the object: a fine grid in the boxes of the gripper, without any clearance."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable

import numpy as np

from glsk_o3d import skeletonize
from glsk_o3d.analysis import GraspCandidates, grasp_candidates

from .objects import built

BEST = 20
OPENING = {"mug": 0.08}  # in metres; of the samples, which have no unit:
USUAL_OPENING = 0.25
STEPS = (9, 9, 25)  # of the grid in a box, at rest; on the way in, as close


def pierces(grasps: GraspCandidates, inside: Callable[[np.ndarray], np.ndarray], way: float) -> np.ndarray:
    """Which grasps have a finger or the palm in the object, at rest and on the way in: (G, 2) bool array."""
    found = np.zeros((len(grasps), 2), bool)
    corners = grasps.gripper.boxes(grasps.opening, grasps.depth)
    for row, (pose, *boxes) in enumerate(zip(grasps.poses, *corners, strict=True)):
        for low, high in zip(*boxes, strict=True):
            back = np.arange(0, way, (high - low)[2] / STEPS[2])
            axes = [np.linspace(*ends, n) for *ends, n in zip(low, high, STEPS, strict=True)]
            for column, z in enumerate((axes[2], low[2] - back)):
                grid = np.stack(np.meshgrid(*axes[:2], z, indexing="ij"), axis=-1).reshape(-1, 3)
                found[row, column] |= inside(grid @ pose[:3, :3].T + pose[:3, 3]).any()
    found[:, 1] |= found[:, 0]
    return found


def measure(name: str, condition: str, n: int, seed: int) -> dict:
    """The best grasps of one cloud, found without and with a look at its points."""
    thing = built(name, seed)
    points = thing.cloud(n, condition, seed)
    way = float(np.linalg.norm(np.ptp(points, axis=0)))
    opening = OPENING.get(name, USUAL_OPENING)
    row: dict = {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # no grasp at all shows as such
        skeleton = skeletonize(points)
        for key, cloud in (("alone", ()), ("checked", None)):
            start = time.process_time()
            found = grasp_candidates(skeleton, opening, cloud=cloud)
            row[f"{key} cpu"] = time.process_time() - start
            row[key] = judged(found, thing.inside, way)
        row["seen"] = judged(found[found.seen == 3], thing.inside, way)
    return row


def judged(found: GraspCandidates, inside: Callable[[np.ndarray], np.ndarray], way: float) -> dict:
    """How many there are, and how many of the best are bad, at rest and on the way in."""
    best = found[:BEST]
    rest, coming = pierces(best, inside, way).sum(axis=0).tolist()
    return dict(found=len(found), best=len(best), rest=rest, coming=coming)
