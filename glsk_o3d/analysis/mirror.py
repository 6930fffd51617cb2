"""The plane of symmetry of an object, and the branches of its skeleton that are mirror images of each other."""

from typing import NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment, minimize
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from ..data.skeleton import Skeleton
from ..geometry.polylines import arc_lengths, place_at
from ..geometry.vectors import TINY, Floats, finite_rows, norm, unit

MIRRORED_POINTS = 1500  # speed: of the cloud, whose mirror image is compared with it
FARTHEST_MIRRORED = 0.1  # fitted: of the object's size, what a point without a mirror image counts at most
TRIED_NORMALS = 60  # fitted: directions over the half sphere, a dozen degrees apart, besides the principal axes
REFINED_NORMALS = 4  # fitted: of them, the best
COMPARED_PART = np.linspace(0.3, 1, 8)  # fitted: of two branches; where limbs begin, the trunk shifts them
PAIR_TOLERANCE = 0.2  # fitted: distance of a branch from the mirror image of its partner, over its length
NO_PARTNER = 3.0  # derived: more than two partners at the limit, so that no pair is given up for one


class Plane(NamedTuple):
    """A point of a plane and its unit normal, two (3,) float arrays."""

    point: Floats
    normal: Floats

    def height(self, places: Floats) -> Floats:
        """Signed distances of places (n, 3), (n,) float array."""
        distance: Floats = (places - self.point) @ self.normal
        return distance

    def mirrored(self, places: Floats) -> Floats:
        """Mirror images of places (n, 3)."""
        return places - 2 * self.height(places)[:, None] * self.normal


def mirror_plane(points: np.ndarray) -> Plane:
    """The plane in which points (N, 3) are nearest to their mirror image: a minimum of the mean nearest distance.

    The search begins with the principal planes and with directions over the whole half sphere, through the middle of
    the points, and refines the best. Every object has such a plane; whether it is symmetric is another question.
    """
    points = points[finite_rows(points)]
    points = points[np.unique(np.linspace(0, len(points) - 1, MIRRORED_POINTS).astype(int))]
    middle, size, tree = points.mean(axis=0), max(float(norm(np.ptp(points, axis=0)[None])[0]), 1e-300), cKDTree(points)
    most = FARTHEST_MIRRORED * size

    def mismatch(numbers: np.ndarray) -> float:
        """Of the plane with this normal, of any length, whose distance from the middle is the fourth number."""
        normal = unit(numbers[None, :3])[0]
        mirrored = Plane(middle + size * numbers[3] * normal, normal).mirrored(points)
        return float(np.minimum(tree.query(mirrored, distance_upper_bound=most)[0], most).mean())

    turn, height = np.arange(TRIED_NORMALS) * np.pi * (3 - 5**0.5), (np.arange(TRIED_NORMALS) + 0.5) / TRIED_NORMALS
    across = np.sqrt(1 - height**2)
    sphere = np.column_stack([across * np.cos(turn), across * np.sin(turn), height])
    normals = np.concatenate([np.linalg.svd(points - middle, full_matrices=False)[2], sphere])
    starts = sorted(np.pad(normals, ((0, 0), (0, 1))), key=mismatch)[:REFINED_NORMALS]
    steps = np.concatenate([np.zeros((1, 4)), np.diag([0.1, 0.1, 0.1, 0.02])])
    refined = [
        minimize(mismatch, start, method="Nelder-Mead", options={"initial_simplex": start + steps, "maxfev": 300})
        for start in starts
    ]
    best = min(refined, key=lambda each: each.fun).x
    normal = unit(best[None, :3])[0]
    return Plane(middle + size * best[3] * normal, normal)


def mirrored_branches(skeleton: Skeleton, plane: Plane) -> np.ndarray:
    """The mirror image of every branch, itself if it lies in the plane, -1 if there is none, (B,) int array."""
    curves = [skeleton.vertices[path] for path in skeleton.branches]
    lengths = [arc_lengths(curve) for curve in curves]
    samples = [place_at(curve, at, at[-1] * COMPARED_PART) for curve, at in zip(curves, lengths, strict=True)]
    if len(samples) == 0:
        return np.empty(0, int)
    mirrored = np.stack([plane.mirrored(places) for places in samples]).reshape(len(samples), -1)
    distance = cdist(mirrored, np.stack(samples).reshape(len(samples), -1)) / len(COMPARED_PART) ** 0.5
    length = np.array([at[-1] for at in lengths])
    limit = PAIR_TOLERANCE * np.minimum(length[:, None], length)
    limit += np.array([np.nan_to_num(skeleton.radii[path]).mean() for path in skeleton.branches])
    share = (distance + distance.T) / np.maximum(limit + limit.T, TINY)
    partner = linear_sum_assignment(np.where(share <= 1, share, NO_PARTNER))[1]
    rows = np.arange(len(partner))
    return np.where((partner[partner] == rows) & (share[rows, partner] <= 1), partner, -1)
