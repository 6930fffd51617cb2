"""Trunks that go on beyond a gap in the scan, and do not hang on twigs that reach past it."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from ...geometry.groups import component_labels
from ...geometry.near_links import linked
from ...geometry.numbers import fitted
from ...geometry.vectors import Ints, norm, unit
from ..numbers import CURVE


@dataclass(frozen=True)
class ContinuationNumbers:
    """Numbers of `continuations`, fitted on trunks with a hidden stretch that twigs reach past."""

    trunk: float = fitted(0.4, "least radius of a trunk, over that of the thickest part")
    span: float = fitted(4.0, "radii of an end over which it has its direction; also lengths that an offset counts for")
    gap: float = fitted(20.0, "longest gap over the radius")
    ahead: float = fitted(0.9, "least cosine between the gap and the direction of the end")
    taper: float = fitted(0.5, "least radius where it goes on, over that of the end")
    hollow: float = fitted(1.5, "radii around most of a gap without points; so near its ends there may be some")


CONTINUATION = ContinuationNumbers()


def continuations(places: np.ndarray, edges: np.ndarray, radius: np.ndarray, points: np.ndarray, root: int) -> Ints:
    """Ends of trunks, and the places where these go on towards the root, (k, 2) int array.

    That place is straight ahead across empty space, about as thick, and in the part of the root, and the end is not.
    """
    pairs = np.empty((0, 2), int)
    thick = edges[(radius[edges] > CONTINUATION.trunk * radius.max(initial=0)).all(axis=1)]  # less twigs at the ends
    for end in np.flatnonzero(np.bincount(thick.ravel(), minlength=len(places)) == 1).tolist():
        place = _ahead(places, thick, radius, points, end)
        part = component_labels(len(places), np.concatenate([edges, pairs]))
        if place is not None and part[end] != part[place] == part[root]:
            pairs = np.concatenate([pairs, [[end, place]]])
    return pairs


def _ahead(places: np.ndarray, edges: np.ndarray, radius: np.ndarray, points: np.ndarray, end: int) -> int | None:
    """The place where a trunk goes on beyond its end, or None."""
    distance = dijkstra(linked(places, edges), indices=end, limit=CONTINUATION.span * radius[end])
    near = np.isfinite(distance)
    thick, gap = float(np.median(radius[near])), places - places[end]
    length, direction = norm(gap), unit(places[[end]] - places[near].mean(axis=0))[0]
    along = gap @ direction
    fits = (radius >= CONTINUATION.taper * thick) & (along > CONTINUATION.ahead * length)
    fits &= ~near & (length <= CONTINUATION.gap * thick)
    if not fits.any():
        return None
    offset = np.sqrt(np.maximum(length**2 - along**2, 0))
    place = int(np.where(fits, along + CONTINUATION.span * offset, np.inf).argmin())
    between = np.arange(CONTINUATION.hollow * thick, length[place] - CONTINUATION.hollow * thick, thick / 2)
    line = places[end] + between[:, None] * gap[place] / length[place]
    is_gap = len(line) and (cKDTree(points).query(line)[0] > CONTINUATION.hollow * thick).mean() > CURVE.majority
    return place if is_gap else None
