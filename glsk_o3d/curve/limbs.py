"""The branches of a curve, seen from the junctions that they leave."""

from collections import defaultdict
from functools import cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..geometry.groups import quantile
from ..geometry.polylines import arc_lengths, place_at, relative_distance
from ..geometry.vectors import TINY, dot, norm
from .curve import Curve
from .numbers import CURVE


class Line(NamedTuple):
    """What a limb says of where it comes from."""

    middle: np.ndarray  # (3,) of the part that nothing disturbs
    direction: np.ndarray  # (3,) unit vector towards the junction, or zero
    spread: float  # standard deviation along the line of that part
    bend: float  # root mean square distance from the line
    start: float  # length along the limb that is disturbed
    lead: np.ndarray  # (k, 3) where the limb goes there, from its junction on, up to where that ends
    radius: float  # of the limb


def _split(branch: np.ndarray, joint: np.ndarray) -> list[np.ndarray]:
    """The parts of a branch between joints; a closed one begins at one of them."""
    inner = np.flatnonzero(joint[branch])
    if branch[0] == branch[-1] and len(inner) and not joint[branch[0]]:
        branch = np.concatenate([branch[inner[0] :], branch[1 : inner[0] + 1]])
        inner = np.flatnonzero(joint[branch])
    cuts = np.unique(np.concatenate([[0], inner, [len(branch) - 1]]))
    return [branch[a : b + 1] for a, b in pairwise(cuts)]


class JunctionLimbs:
    """The branches of a curve seen from their junctions.

    The `surface` (M,) is as far from every vertex; without points, its radius. Of every branch there is the `radius`
    (B,), the median of that along it, and whether it is `inner` (B,), between two junctions. The `paths` lead from
    every junction along its branches, those `at` it; `branch` has the number of the branch of each. Other vertices may
    be `joints`, too, int array, where branches are split.
    """

    def __init__(self, curve: Curve, joints: np.ndarray | None = None) -> None:
        self.vertices, degree = curve.vertices, curve.degree
        surface = curve.cloud.distance
        self.surface = np.where(surface > 0, surface, curve.radii)
        self.branches = curve.branches
        joint = degree > 2
        if joints is not None and len(joints):
            joint[joints] = True
            self.branches = tuple(part for branch in self.branches for part in _split(branch, joint))
        ends = np.array([branch[[0, -1]] for branch in self.branches], int).reshape(-1, 2)
        self.radius = np.array([quantile(self.surface[branch]) for branch in self.branches], float)
        self.inner = (degree[ends] > 2).all(axis=1) & (ends[:, 0] != ends[:, 1])
        self.paths, self.branch, self.at = list[np.ndarray](), list[int](), defaultdict[int, list[int]](list)
        for number, branch in enumerate(self.branches):
            for path in (branch, branch[::-1]):
                if joint[path[0]]:
                    self.at[int(path[0])].append(len(self.paths))
                    self.paths.append(path)
                    self.branch.append(number)
        self.axis = cache(self._axis)

    def signature(self, junction: int) -> bytes:
        """What is equal of two junctions if their limbs are: what was found out about one is known of the other."""
        paths = [self.paths[limb] for limb in self.at[junction]]
        return b"".join(values[path].tobytes() for path in paths for values in (self.vertices, self.surface))

    def _axis(self, limb: int) -> tuple[np.ndarray, np.ndarray]:
        """The last undisturbed place of a limb, and its direction there, towards the junction."""
        path, radius = self.paths[limb], self.radius[self.branch[limb]]
        places = self.vertices[path]
        along = arc_lengths(places)
        half = along[-1] / 2  # the other end may be disturbed, too
        others = [self.paths[k] for k in self.at[int(path[0])] if self.branch[k] != self.branch[limb]]
        start = 0.0
        if others:
            near = places[: max(np.searchsorted(along, half), 1)]
            ratio, _ = relative_distance(near, self.vertices, self.surface, others)
            inside = np.flatnonzero(ratio <= CURVE.undisturbed)
            start = min(along[inside[-1] + 1], half) if len(inside) else start
        stop = min(start + CURVE.line_length * radius, along[-1])
        anchor, back = place_at(places, along, start), place_at(places, along, stop)
        return anchor, (anchor - back) / max(np.linalg.norm(anchor - back), TINY)

    def meeting(self, limbs: list[int], near: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The place nearest to the axes of some limbs, in the sense of least squares.

        The limbs are numbers of paths, at least one. Where lines are nearly one, they meet `near` where the junction
        was. Returned are, of each limb, its last undisturbed place (k, 3), where it passes the meeting place (k, 3), or
        again its last place if that is behind it, and whether it passes within the radius of the thickest (k,).
        """
        anchor, direction = (np.array(values) for values in zip(*map(self.axis, limbs), strict=True))
        radius = self.radius[[self.branch[limb] for limb in limbs]]
        across = np.eye(3) - direction[:, :, None] * direction[:, None]
        weight = across.sum(axis=0) + CURVE.stay * np.eye(3)
        place = near + np.linalg.solve(weight, np.einsum("kij,kj->i", across, anchor - near))
        along = dot(place - anchor, direction)
        fits = norm(place - anchor - along[:, None] * direction) <= radius.max()
        return anchor, anchor + np.maximum(along, 0)[:, None] * direction, fits
