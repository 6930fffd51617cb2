"""The working frame: distinct points, centred on their bounding box, about 1.6 long, and near ones near in memory."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..errors import InvalidCloudError
from .groups import component_labels
from .morton import morton_order
from .neighbourhoods import nearest_neighbours
from .vectors import box, dot, norm

FRAME_SIDE = 1.6  # published: longest side of the box
CLOUD_SLACK = 1.2  # published: how much larger than the cloud the contracted one may be
FLAT_BOX = 0.01  # fitted: least half side of the box for that, over its diagonal
MIN_POINTS = 8  # derived: the least that can have rings of three and a curve
MIN_EXTENT, MAX_EXTENT = 1e-120, 1e120  # derived: a float64 holds their squares and products
MIN_STEPS = 1024  # derived: across the cloud, between which coordinates can choose: places in it then have three digits
ROUNDINGS = 4e-15  # derived: a few roundings in the working frame
SAME_POINT = 1e-4  # derived: distance of copies over that of other points; one random pair in 10^8 is as near


@dataclass(frozen=True, eq=False)
class Frame:
    """Similarity between the user's units and the working frame, in which weights and thresholds are stated."""

    centre: np.ndarray  # (3,) of the bounding box, in the user's units
    scale: float  # user's units per unit of the frame
    half_extent: np.ndarray  # (3,) half the sides of the bounding box, in the frame
    diagonal: float  # of the box by which the frame was scaled, in the frame
    mean: np.ndarray | None = None  # (3,) of the points, in the frame, if the frame turns with the cloud
    reach: float = 0.0  # distance of the farthest point from it

    @classmethod
    def of(cls, points: np.ndarray, by: str = "box") -> Frame:
        """The frame in which the longest side of a box is 1.6.

        `by` is "box" for the axis-aligned bounding box (Wen et al. 2024), or "spread" for the box that has the points'
        spread if it is evenly filled, whose longest side and diagonal do not change when the cloud is turned.
        """
        low, high = box(points)
        # Half the difference first: the sum of two large coordinates would cost a digit.
        half = (high - low) / 2
        centre, longest = low + half, 2 * half.max()
        if by == "box":
            scale = longest / FRAME_SIDE
            return cls(centre, float(scale), half / scale, float(2 * np.linalg.norm(half / scale)))
        inner = (points - centre) / longest
        mean = inner.mean(axis=0)
        inner -= mean
        variance = np.linalg.eigvalsh(inner.T @ inner / len(inner))  # of a box with sides a, b, c: a^2 / 12, ...
        side, diagonal = np.sqrt(12 * np.array([variance[2], variance.sum()]))
        reach, unit = np.sqrt(dot(inner, inner).max()), side / FRAME_SIDE
        scale = longest * unit
        return cls(centre, float(scale), half / scale, float(diagonal / unit), mean / unit, float(reach / unit))

    def beyond(self, points: np.ndarray) -> np.ndarray:
        """Points of the frame out of the cloud's box, or its ball if the frame turns, 1.2 times as large, (n,) bool."""
        if self.mean is None:
            return (np.abs(points) > np.maximum(CLOUD_SLACK * self.half_extent, FLAT_BOX * self.diagonal)).any(axis=1)
        return norm(points - self.mean) > CLOUD_SLACK * self.reach

    def into(self, points: np.ndarray) -> np.ndarray:
        """User's units to the frame."""
        return (points - self.centre) / self.scale

    def out_of(self, points: np.ndarray) -> np.ndarray:
        """Frame to the user's units."""
        return points * self.scale + self.centre


def not_finite(n: int, total: int, first: int) -> InvalidCloudError:
    """The error for n of all points, the first at an index, that have no finite coordinates."""
    if n == total:
        return InvalidCloudError(f"none of its {n} points has finite coordinates: there is no cloud to work with")
    which = f"{n} of {total} points have NaN or infinite coordinates, the first at index {first}"
    return InvalidCloudError(f"{which}: drop them with drop_invalid (--drop-invalid), or remove them first")


def to_working_frame(
    points: np.ndarray, counts: np.ndarray, by: str, k: Callable[[int], int], neighbours: np.ndarray | None = None
) -> tuple[Frame, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Bring points (n, 3), each of which stands for `counts` (n,), into their working frame, see `Frame.of`.

    `k` says how many neighbours to look up for so many points; `neighbours` (n, k), if they are known, are those of
    points that are all distinct. Copies are points much nearer to each other than to others; of each group the first in
    Morton order stays. Returned are the frame; the m distinct points in Morton order (m, 3); which of the given points
    they are (m,); for each given point its row among them; how many points each row stands for; and the neighbours of
    each row. InvalidCloudError if fewer than 8 points are distinct, or as of `check_extent`.
    """
    if len(points) < MIN_POINTS:
        raise InvalidCloudError(f"{len(points)} finite points: a skeleton needs at least {MIN_POINTS} distinct ones")
    check_extent(points)
    # In this order from here on: even the last digit of a sum must not depend on how the points were numbered, since
    # on grids it decides between neighbours that are equally near.
    kept, row = morton_order(points), np.empty(len(points), int)
    row[kept] = np.arange(len(points))
    weight = counts[kept]
    while True:
        frame = Frame.of(points[kept], by)  # that of the distinct points, however often they came
        cloud = frame.into(points[kept])
        if neighbours is not None:
            return frame, cloud, kept, row, weight, row[neighbours[kept, : k(len(cloud))]]
        distance, near = nearest_neighbours(cloud, k(len(cloud)))
        group = _places(cloud, distance, near)
        first = np.unique(group, return_index=True)[1]
        if len(first) == len(cloud):
            return frame, cloud, kept, row, weight, near
        if len(first) < MIN_POINTS:
            few = f"{len(points)} points but only {len(first)} distinct ones"
            raise InvalidCloudError(f"{few}: a skeleton needs at least {MIN_POINTS}")
        stays = np.sort(first)
        merged, most = np.searchsorted(stays, first[group]), np.zeros(len(first))
        np.maximum.at(most, merged, weight)
        kept, row, weight = kept[stays], merged[row], most


def _places(cloud: np.ndarray, distance: np.ndarray, near: np.ndarray) -> np.ndarray:
    """The place of each point, (n,) int array: copies have one; `distance` and `near` (n, k) are to its neighbours."""
    # Where the neighbours may all be copies, the spacing is that of n points in a square as wide as half of the cloud:
    # a group with all its neighbours in it is one place, but one of more than sqrt(n) points is an object, far away.
    n, last = len(cloud), distance[:, -1:]
    middle = 2 * np.median(norm(cloud - np.median(cloud, axis=0)))  # of outliers it knows nothing
    spacing = np.maximum(last, middle / np.sqrt(n))
    for _ in range(2):
        place, copy = np.nonzero(distance <= np.maximum(SAME_POINT * spacing, ROUNDINGS))
        group = component_labels(n, np.stack([place, near[place, copy]], axis=1)[place != near[place, copy]])
        outside, count = np.bincount(group, (group[near] != group[:, None]).any(axis=1)), np.bincount(group)
        spacing = np.where(((outside > 0) | (count**2 > n))[group, None], last, spacing)
    return group


def check_extent(points: np.ndarray, n: int | None = None) -> None:
    """Raise InvalidCloudError where n points, given or by the corners of their box, coincide, or squares overflow."""
    low, high = box(points)
    with np.errstate(over="ignore"):
        extent = (high - low).max()
    if extent == 0:
        raise InvalidCloudError(f"all {n or len(points)} points coincide: there is nothing to skeletonise")
    if not MIN_EXTENT < extent < MAX_EXTENT:
        raise InvalidCloudError(f"the cloud is {extent:g} long, and its square is out of range: rescale it")
    distance = max(high.max(), -low.min())
    if extent < MIN_STEPS * np.spacing(distance):
        where = f"{distance:g} away from the origin, where numbers are {np.spacing(distance):g} apart"
        what = "its shape is lost in rounding; subtract an offset before the coordinates are first stored"
        raise InvalidCloudError(f"the cloud is {extent:g} long and {where}: {what}")
