"""The plane of symmetry of an object, and the branches of its skeleton that are mirror images of each other."""

from typing import NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment, minimize
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from ..data.skeleton import Skeleton
from ..geometry.polylines import arc_lengths, place_at
from ..geometry.vectors import TINY, Floats, finite_rows, unit

MIRRORED_POINTS = 1500  # speed: of the cloud, whose mirror image is compared with it
FARTHEST_MIRRORED = 0.1  # fitted: of the object's size, what a point without a mirror image counts at most
TRIED_NORMALS = 100  # fitted: directions, a dozen degrees apart on the half sphere, besides the principal axes
REFINED_NORMALS = 4  # fitted: of them, the best
COMPARED_PART = np.linspace(0.3, 1, 8)  # fitted: of two branches; where limbs begin, the trunk shifts them
PAIR_TOLERANCE = 0.2  # fitted: distance of a branch from the mirror image of its partner, over its length
MOST_PAIRED = 2000  # speed: branches; of a plant with more, none has a mirror image
NO_PARTNER = 3.0  # derived: more than two partners at the limit, so that no pair is given up for one


class Plane(NamedTuple):
    """A point of a plane and its unit normal, two (3,) float arrays."""

    point: Floats
    normal: Floats

    def mirrored(self, places: Floats) -> Floats:
        """Mirror images of places (n, 3)."""
        mirrored: Floats = places - 2 * ((places - self.point) @ self.normal)[:, None] * self.normal
        return mirrored


def mirror_plane(points: np.ndarray) -> Plane:
    """The plane in which points (N, 3) are nearest to their mirror image: a minimum of the mean nearest distance.

    The search begins with the principal planes and with random directions, through the middle of
    the points, and refines the best. Every object has such a plane; whether it is symmetric is another question.
    """
    points = points[finite_rows(points)]
    points = points[np.unique(np.linspace(0, len(points) - 1, MIRRORED_POINTS).astype(int))]
    middle, size, tree = points.mean(axis=0), max(float(np.linalg.norm(np.ptp(points, axis=0))), TINY), cKDTree(points)

    def plane(numbers: np.ndarray) -> Plane:
        """With this normal, of any length; the fourth number is its distance from the middle, over the size."""
        normal = unit(numbers[None, :3])[0]
        return Plane(middle + size * numbers[3] * normal, normal)

    def mismatch(numbers: np.ndarray) -> float:
        distance = tree.query(plane(numbers).mirrored(points))[0]
        return float(np.minimum(distance, FARTHEST_MIRRORED * size).mean())

    tried = np.random.default_rng(0).normal(size=(TRIED_NORMALS, 3))
    normals = np.concatenate([np.linalg.svd(points - middle, full_matrices=False)[2], tried])
    starts = sorted(np.pad(normals, ((0, 0), (0, 1))), key=mismatch)[:REFINED_NORMALS]
    steps = np.concatenate([np.zeros((1, 4)), np.diag([0.1, 0.1, 0.1, 0.02])])
    options = [{"initial_simplex": start + steps, "maxfev": 300} for start in starts]
    ends = [minimize(mismatch, each["initial_simplex"][0], method="Nelder-Mead", options=each) for each in options]
    return plane(min(ends, key=lambda each: float(each.fun)).x)


def mirrored_branches(skeleton: Skeleton, plane: Plane) -> np.ndarray:
    """The mirror image of every branch, itself if it lies in the plane, -1 if there is none, (B,) int array."""
    curves = [skeleton.vertices[path] for path in skeleton.branches]
    lengths = [arc_lengths(curve) for curve in curves]
    samples = [place_at(curve, at, at[-1] * COMPARED_PART) for curve, at in zip(curves, lengths, strict=True)]
    if not 0 < len(samples) <= MOST_PAIRED:
        return np.full(len(samples), -1)
    mirrored = np.stack([plane.mirrored(places) for places in samples]).reshape(len(samples), -1)
    distance = cdist(mirrored, np.stack(samples).reshape(len(samples), -1)) / len(COMPARED_PART) ** 0.5
    length = np.array([at[-1] for at in lengths])
    limit = PAIR_TOLERANCE * np.minimum(length[:, None], length)
    limit += np.array([np.nan_to_num(skeleton.radii[path]).mean() for path in skeleton.branches])
    share = (distance + distance.T) / np.maximum(limit + limit.T, TINY)
    partner = linear_sum_assignment(np.where(share <= 1, share, NO_PARTNER))[1]
    rows = np.arange(len(partner))
    return np.where((partner[partner] == rows) & (share[rows, partner] <= 1), partner, -1)
