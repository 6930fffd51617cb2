"""The branches of a skeleton, seen from the junctions that they leave."""

from collections import defaultdict
from functools import cache

import numpy as np

from ..numerics.groups import component_labels, quantile
from ..numerics.polylines import arc_lengths, place_at, relative_distance
from ..numerics.vectors import TINY, dot, norm
from ..skeleton import Skeleton
from .axis_fit import FIT_STAY
from .sections import VertexPoints

# All fitted.
AXIS_LEAVES = 1.3  # distance from the other limbs, over that from them to the surface, where half a limb is undisturbed
AXIS_LENGTH = 2.0  # radii from there, or from where an end is cut, over which its line is taken


class Limbs:
    """The branches of a skeleton seen from their junctions.

    The `surface` (M,) is as far from every vertex; without points, its radius. Of every branch there is the `radius`
    (B,), the median of that along it; whether it is `inner` (B,), between two junctions; and whether it is `short`
    (B,), no longer than a radius from each junction, so that the contraction disturbs it all along, if they are to be
    `joined`: what short inner branches join is
    one `region` (M,), else every vertex by itself. The `paths` lead from every junction along its branches; `branch`
    has the number of the branch of each, and `at` those that start in a region.
    """

    def __init__(self, skeleton: Skeleton, joined: bool) -> None:
        self.vertices, degree = skeleton.vertices, skeleton.degree
        surface = VertexPoints(skeleton).distance
        self.surface = np.where(surface > 0, surface, skeleton.radii)
        self.branches = skeleton.branches
        ends = np.array([branch[[0, -1]] for branch in self.branches], int).reshape(-1, 2)
        self.radius = np.array([quantile(self.surface[branch]) for branch in self.branches], float)
        self.inner = (degree[ends] > 2).all(axis=1) & (ends[:, 0] != ends[:, 1])
        length = np.array([arc_lengths(self.vertices[branch])[-1] for branch in self.branches], float)
        self.short = joined & (length < self.radius * np.where(self.inner, 2, 1))
        self.region = np.arange(len(degree))
        if joined:
            self.region = component_labels(len(degree), ends[self.short & self.inner])
        self.paths, self.branch, self.at = list[np.ndarray](), list[int](), defaultdict[int, list[int]](list)
        for number, branch in enumerate(self.branches):
            for path in (branch, branch[::-1]):
                if degree[path[0]] > 2:
                    self.at[self.region[path[0]]].append(len(self.paths))
                    self.paths.append(path)
                    self.branch.append(number)
        self.axis = cache(self._axis)

    def _axis(self, limb: int) -> tuple[np.ndarray, np.ndarray]:
        """The last undisturbed place of a limb, and its direction there, towards the junction."""
        path, radius = self.paths[limb], self.radius[self.branch[limb]]
        places = self.vertices[path]
        along = arc_lengths(places)
        half = along[-1] / 2  # the other end may be disturbed, too
        others = [
            self.paths[k]
            for k in self.at[self.region[path[0]]]
            if self.branch[k] != self.branch[limb] and not self.short[self.branch[k]]
        ]
        start = 0.0
        if others:
            near = places[: max(np.searchsorted(along, half), 1)]
            ratio, _ = relative_distance(near, self.vertices, self.surface, others)
            inside = np.flatnonzero(ratio <= AXIS_LEAVES)
            start = min(along[inside[-1] + 1], half) if len(inside) else start
        stop = min(start + AXIS_LENGTH * radius, along[-1])
        anchor, back = place_at(places, along, start), place_at(places, along, stop)
        return anchor, (anchor - back) / max(np.linalg.norm(anchor - back), TINY)

    def meeting(self, limbs: list[int], near: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The place nearest to the axes of some limbs, in the sense of least squares.

        The limbs are numbers of paths, at least one; short ones have no say if there are two others. Where lines are
        nearly one, they meet `near` where the junction was. Returned are, of each limb, its last undisturbed place
        (k, 3), where it passes the meeting place (k, 3), or again its last place if that is behind it, and whether it
        passes within the radius of the thickest (k,).
        """
        anchor, way = (np.array(values) for values in zip(*map(self.axis, limbs), strict=True))
        radius = self.radius[[self.branch[limb] for limb in limbs]]
        long = ~self.short[[self.branch[limb] for limb in limbs]]
        say = long if long.sum() > 1 else np.ones(len(long), bool)
        across = say[:, None, None] * (np.eye(3) - way[:, :, None] * way[:, None])
        weight = across.sum(axis=0) + FIT_STAY * np.eye(3)  # lines that are nearly one meet anywhere
        place = near + np.linalg.solve(weight, np.einsum("kij,kj->i", across, anchor - near))
        along = dot(place - anchor, way)
        fits = norm(place - anchor - along[:, None] * way) <= radius.max()
        return anchor, anchor + np.maximum(along, 0)[:, None] * way, fits
