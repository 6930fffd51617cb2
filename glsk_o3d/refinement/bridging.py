"""Bridge the gaps that a scan leaves in one part."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..numerics.vectors import TINY, dot, norm
from ..skeleton import Skeleton

# All fitted.
BRIDGE_COSINE = 0.7  # least cosine between the bridge and either end
BRIDGE_RADIUS_RATIO = 2.0  # most that one end may be thicker than the other
BRIDGE_LOOK_BACK = 3.0  # radii to look back along a branch for its direction


def bridge_gaps(skeleton: Skeleton, gap: float) -> Skeleton:
    """Join ends of different components that point at each other and are equally thick; nearest first.

    Parameters
    ----------
    skeleton : Skeleton
    gap : float
        Longest bridge over the mean radius of the two branches.

    Returns
    -------
    Skeleton
        With an edge for each bridge.
    """
    leaf, direction, radius = _ends(skeleton)
    if skeleton.n_components < 2 or len(leaf) < 2:
        return skeleton
    place, component = skeleton.vertices[leaf], skeleton.component_of_vertex[leaf]
    i, j = np.triu_indices(len(leaf), 1)
    way = place[j] - place[i]
    length = norm(way)
    way = way / np.maximum(length, TINY)[:, None]
    relative = length / ((radius[i] + radius[j]) / 2)
    fits = (
        (component[i] != component[j])
        & (relative < gap)
        & (dot(way, direction[i]) > BRIDGE_COSINE)
        & (dot(way, direction[j]) < -BRIDGE_COSINE)
        & (np.maximum(radius[i], radius[j]) < BRIDGE_RADIUS_RATIO * np.minimum(radius[i], radius[j]))
    )
    pairs = np.flatnonzero(fits)
    pairs = pairs[np.argsort(relative[pairs], kind="stable")]
    used, label, bridges = set(), component, []
    for one, other in zip(i[pairs].tolist(), j[pairs].tolist(), strict=True):
        if one in used or other in used or label[one] == label[other]:
            continue
        used |= {one, other}
        label = np.where(label == label[other], label[one], label)
        bridges.append(sorted((leaf[one], leaf[other])))
    if not bridges:
        return skeleton
    return replace(skeleton, edges=np.unique(np.concatenate([skeleton.edges, bridges]), axis=0))


def _ends(skeleton: Skeleton) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Leaves, the directions in which their branches end, and the median radii of these."""
    found = []
    for branch in skeleton.branches:
        radius = float(np.median(skeleton.radii[branch]))
        for path in (branch, branch[::-1]):
            if skeleton.degree[path[0]] == 1 and radius > 0:
                found.append((path[0], _outward(skeleton.vertices[path], BRIDGE_LOOK_BACK * radius), radius))
    if not found:
        return np.empty(0, int), np.empty((0, 3)), np.empty(0)
    leaf, direction, radius = zip(*found, strict=True)
    return np.array(leaf), np.array(direction), np.array(radius)


def _outward(path: np.ndarray, back: float) -> np.ndarray:
    """Unit vector from the place so far back along a path to its start."""
    travelled = np.cumsum(norm(np.diff(path, axis=0)))
    way = path[0] - path[min(int(np.searchsorted(travelled, back)), len(travelled) - 1) + 1]
    return way / max(np.linalg.norm(way), TINY)
