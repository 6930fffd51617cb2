"""The part between the jaws of a gripper: how wide it is in each direction, and how its surface meets the jaws."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import csr_array

from ..data.skeleton import Skeleton
from ..geometry.vectors import dot, norm
from .gripper import Gripper

SEEN_SIDE = 0.5  # fitted: a side that the points show less of, over the other side, was not seen
FACING = 0.85  # fitted: cosine of the angle between a jaw and the surface that it touches, where that was seen
ALIKE = 0.9  # fitted: distances of two sides of a part from its axis, the less over the greater
CONTACT_DEPTH = 0.1  # fitted: of the points that a jaw touches, over the width of the part
SECTION_REACH = 1.0  # fitted: vertices whose points show a section, over the radius or the width of a finger
FEWEST = 8  # fitted: points that show a section


class Sections(NamedTuple):
    """The part between the jaws, at P places in A directions: (P, A) float arrays."""

    width: np.ndarray  # along the closing direction
    shift: np.ndarray  # of its middle from the axis, along the closing direction
    far: np.ndarray  # from the axis to the side away from the palm
    contact: np.ndarray  # cosine of the angle between the closing direction and the surface at the worse jaw

    def of(self, rows: Any) -> Sections:
        """Some of the places, or of all approaches as one row."""
        return Sections(*(values[rows] for values in self))


def in_time(rows: Iterable[int], stop: float) -> Iterator[int]:
    """The first row in any case, and the others until a time of the monotonic clock."""
    for count, row in enumerate(rows):
        if count and time.monotonic() > stop:
            return
        yield row


def sections_at(
    skeleton: Skeleton,
    branch: np.ndarray,
    places: np.ndarray,
    directions: tuple[np.ndarray, np.ndarray],
    gripper: Gripper,
    rows: Iterable[int],
) -> tuple[Sections, np.ndarray]:
    """The sections of the part at places on branches (P,), for `directions` of approach and closing, (P, A, 3) each.

    The places, (P, 9), are positions, axes, radii and their slopes along the branch, and confidences. Those of `rows`
    are examined, others are taken for round; which were is a (P,) bool array.

    The points of the branch show it, as far as half the width of a finger to either side of the place, and along the
    approach as far as the fingertips reach. An unseen side is as far from the axis as the side across;
    without points the section is round.
    """
    position, axis, radius, slope = places[:, :3], places[:, 3:6], places[:, 6], places[:, 7]
    even = np.sqrt(np.clip(1 - slope**2, 0, None))
    with np.errstate(divide="ignore", invalid="ignore"):
        half = np.where(even > 0, radius / even, np.nan)
    result = Sections(
        *(np.repeat(v[:, None], directions[0].shape[1], axis=1) for v in (2 * half, 0 * half, half, even))
    )
    whole, across = skeleton.whole, gripper.finger[1]
    known = np.flatnonzero(np.isfinite(whole.normals).all(axis=1) & (whole.vertex_of_point >= 0))
    points_of = csr_array(
        (np.ones(len(known)), (whole.vertex_of_point[known], known)), (len(skeleton.vertices), len(whole.points))
    )
    is_examined = np.zeros(len(branch), bool)
    for place in rows:
        is_examined[place] = True
        path = skeleton.branches[branch[place]]
        local = path[norm(skeleton.vertices[path] - position[place]) <= SECTION_REACH * np.fmax(half[place], across)]
        near_points = points_of[np.unique(local)].indices
        offset = whole.points[near_points] - position[place]
        near = abs(offset @ axis[place]) < across / 2
        if near.sum() < FEWEST or not half[place] > 0:
            continue
        offset, normal = offset[near], whole.normals[near_points[near]]
        approach, closing = (offset @ vectors[place].T for vectors in directions)  # (n, A)
        far, near_palm = np.maximum([approach.max(axis=0), -approach.min(axis=0)], 0)
        far = result.far[place] = np.where(far > SEEN_SIDE * near_palm, far, near_palm)
        between = approach <= np.minimum(gripper.reach, far)
        facing = np.sign(normal @ directions[1][place].T)
        sides = [np.where(between, side, -np.inf) for side in (-closing, closing)]
        ends = np.maximum([side.max(axis=0) for side in sides], 0)
        touched = []
        for end, side in zip(ends, sides, strict=True):
            at_jaw = side >= end - CONTACT_DEPTH * ends.sum(axis=0)
            mean = (facing * at_jaw).T @ normal
            touched.append(dot(mean, directions[1][place]) / np.maximum(norm(mean), 1e-12))
        # the edge of what was seen is nearer than the other side, and does not face its jaw
        edge = (np.array(touched) < FACING) & (ends < ALIKE * ends[::-1])
        seen = (ends > SEEN_SIDE * ends[::-1]) & ~edge
        ends = np.where(seen, ends, ends[::-1])
        result.width[place], result.shift[place] = ends.sum(axis=0), (ends[1] - ends[0]) / 2
        result.contact[place] = np.where(seen, touched, 1).min(axis=0)
    return result, is_examined
