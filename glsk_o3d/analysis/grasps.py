"""Candidates for grasps with parallel jaws along a skeleton, with a free approach."""

import warnings
from collections import Counter
from typing import Any

import numpy as np

from ..data.points import surface_points
from ..data.report import outside
from ..data.skeleton import Skeleton
from ..errors import InvalidParameterError, SkeletonWarning
from ..geometry.groups import group_rank
from ..geometry.polylines import arc_lengths
from ..parameters import check_number
from .curves import check_places
from .grasp_checks import Approaches, check_approaches, checked_plane
from .gripper import GraspCandidates, Gripper, in_words

UNLIKELY_OPENING = 20.0  # derived: openings over diagonals: above those of hands and screws, below those of mm and m


def grasp_candidates(
    skeleton: Skeleton,
    gripper: Gripper | float,
    *,
    cloud: Any = None,
    plane: Any = None,
    clearance: float | None = None,
    around: int = 8,
    spacing: float | None = None,
    min_confidence: float = 0.5,
) -> GraspCandidates:
    """Candidates for grasps with parallel jaws, from the axis and the radii of a skeleton's branches.

    The jaws close across a branch, at places along its curve and from directions around it. The open gripper approaches
    in a straight line, from as far away as the diagonal of the object, until its fingertips are past the axis by its
    reach, but not past the part. Approaches are left out if a finger or the palm would touch points or reach behind a
    table's plane, or if no points are between the jaws. Unseen space counts as free. The quality ranks candidates; it
    does not measure force closure. Its formula, each step, and the sources (Vahrenkamp et al. 2018; ten Pas et al.
    2017): docs/grasping.md.

    Parameters
    ----------
    skeleton : Skeleton
        With radii.
    gripper : Gripper or float
        Or its widest opening [cloud's units], with the other sizes in proportion.
    cloud : cloud, optional
        All points that the gripper must not touch, also of other objects; by default the skeleton's. With an empty
        tuple a finger may go through the object.
    plane : (4,) array_like, optional
        A table, as from Open3D's ``segment_plane``: solid behind it as seen from the points.
    clearance : float, optional
        Opening beyond the width w [cloud's units], half on either side; twice or three times as much where less is not
        free, as in noise. Half of it is also kept all around the gripper. By default a tenth of the widest opening.
    around : int
        Approach directions at each place, evenly around the axis; the first is as near as possible to -z.
    spacing : float, optional
        Distance of the places along the curve [cloud's units]; by default the median radius of the branch. They keep
        a radius away from the ends of the branch.
    min_confidence : float
        Least confidence of the skeleton, from 0 to 1. 0 also takes unknown confidences.

    Returns
    -------
    GraspCandidates
        The best of each place first, then the second best of each, and so on, each round by quality; equal ones in the
        order of the branches, along them and around.

    Raises
    ------
    InvalidParameterError
        The skeleton is empty or lacks radii, confidence or points; or a parameter is out of range.
    InvalidCloudError
        `cloud` is none.

    Warns
    -----
    SkeletonWarning
        There is no candidate, with the reason; or the gripper is so large that it may be in other units.

    Examples
    --------
    >>> from glsk_o3d import Skeleton
    >>> from glsk_o3d.samples import tube
    >>> straight = tube(length=1.0, radius=0.1)
    >>> axis = Skeleton(straight.nodes, straight.edges, straight.radii, (), (), (), confidence=[1, 1])
    >>> table = (0, 0, 1, 0.1)  # z = -0.1: the tube lies on it, and cannot be taken from below, nor from the side
    >>> grasp_candidates(axis, 0.4, cloud=straight.points, plane=table, clearance=0.05, around=4)
    GraspCandidates(9 at 9 places; not taken: 27 ways in behind the plane)
    """
    gripper = gripper if isinstance(gripper, Gripper) else Gripper(gripper)
    clearance = gripper.max_opening / 10 if clearance is None else clearance
    _check(skeleton, clearance, around, spacing, min_confidence)
    plane = None if plane is None else checked_plane(plane)
    points = _object_points(skeleton, cloud)
    middle = points if len(points) else skeleton.vertices
    if gripper.max_opening > UNLIKELY_OPENING * np.linalg.norm(np.ptp(middle, axis=0)):
        many = f"more than {UNLIKELY_OPENING:g} times as wide as the object is long"
        warnings.warn(f"the gripper opens {many}: are the units the same?", SkeletonWarning, stacklevel=outside())
    place, branch, width, quality, left_out, examined = _graspable_places(
        skeleton, gripper, clearance, spacing, min_confidence
    )
    position, axis = place[:, :3], place[:, 3:6]
    approach = _directions_around(axis, around)
    approaches = Approaches(position, axis, approach, np.cross(axis[:, None], approach))
    obstacles, opening, depth, seen = check_approaches(approaches, points, plane, middle, gripper, width, clearance)
    free, blocked = _remaining(obstacles)
    quality = quality[free // around] * (seen.ravel()[free] / 3 if len(points) else 1)
    # the best of each place, then the second best of each; in each round the best first; equal ones in their order
    best = np.argsort(-quality.round(9), kind="stable")
    order = best[np.argsort(group_rank(free[best] // around, len(place)), kind="stable")]
    free, quality = free[order], quality[order]
    row = free // around
    candidates = GraspCandidates(
        position=position[row],
        approach=approach.reshape(-1, 3)[free],
        closing=approaches.closing.reshape(-1, 3)[free],
        opening=opening.ravel()[free],
        depth=depth.ravel()[free],
        branch=branch[row],
        confidence=place[row, 8],
        quality=quality,
        seen=seen.ravel()[free],
        gripper=gripper,
        places=examined,
        left_out=left_out | blocked,
    )
    if len(candidates) == 0:
        reason = in_words(candidates.left_out) or "the skeleton has no branch"
        warnings.warn(f"no grasp at {examined} places: {reason}", SkeletonWarning, stacklevel=outside())
    return candidates


def _graspable_places(
    skeleton: Skeleton, gripper: Gripper, clearance: float, spacing: float | None, min_confidence: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, int], int]:
    """Places that fit between the jaws: as of `_places_on`, with branch, width and quality; the others are counted.

    The counts are those of the rejected places, by reason, and of all examined ones.
    """
    places = [_places_on(skeleton, path, spacing) for path in skeleton.branches]
    counts = np.array(list(map(len, places)), int)
    place, branch = np.concatenate([np.empty((0, 9)), *places]), np.repeat(np.arange(len(places)), counts)
    radius, slope, confidence = place[:, 6:].T
    with np.errstate(divide="ignore", invalid="ignore"):
        even = np.sqrt(np.clip(1 - slope**2, 0, None))
        width = 2 * radius / even
        quality = np.nan_to_num(confidence, nan=1.0) * (1 - width / gripper.max_opening) * even
    reasons = {
        "unknown radius": np.isnan(width),
        "too wide": width + clearance > gripper.max_opening,
        "uncertain": ~(confidence >= min_confidence) if min_confidence > 0 else np.zeros(len(width), bool),
    }
    remaining, left_out = _remaining(reasons)
    if not counts.all():
        left_out["branches without a place between their margins"] = int((counts == 0).sum())
    return place[remaining], branch[remaining], width[remaining], quality[remaining], left_out, len(place)


def _remaining(reasons: dict[str, np.ndarray]) -> tuple[np.ndarray, dict[str, int]]:
    """The rows without a reason to reject them, and for each reason how often it is the first."""
    first = np.select([reason.ravel() for reason in reasons.values()], list(reasons), "")
    return np.flatnonzero(first == ""), dict(Counter(first[first != ""].tolist()))


def _places_on(skeleton: Skeleton, path: np.ndarray, spacing: float | None) -> np.ndarray:
    """Places along a branch, (n, 9): position, axis, radius, its slope, confidence."""
    curve, radii = skeleton.vertices[path], skeleton.radii[path]
    along = arc_lengths(curve)
    length = along[-1]
    if not length > 0:
        return np.empty((0, 9))
    closed = path[0] == path[-1] and skeleton.degree[path[0]] == 2
    median_radius = np.nanmedian(radii) if np.isfinite(radii).any() else 0.0
    step = spacing or median_radius or length / 10
    check_places(length, step)
    if closed:
        count = max(round(length / step), 1)
        at = length / count * np.arange(count)
    else:
        low, high = np.nan_to_num(radii[0]), length - np.nan_to_num(radii[-1])
        if low > high:
            return np.empty((0, 9))
        count = int((high - low) / step * (1 + 1e-12)) + 1
        at = (low + high) / 2 + step * (np.arange(count) - (count - 1) / 2)
    values = np.column_stack([curve, radii, skeleton.confidence[path]])

    def sample(places: np.ndarray) -> np.ndarray:
        period = {"period": length} if closed else {}
        return np.column_stack([np.interp(places, along, column, **period) for column in values.T])

    values_at = sample(at)
    reach = np.where(values_at[:, 3] > 0, values_at[:, 3], step)
    if closed:
        reach = np.minimum(reach, length / 4)
    start, end = np.clip([at - reach, at + reach], *((-np.inf, np.inf) if closed else (0, length)))
    chord = sample(end) - sample(start)
    size: np.ndarray = np.linalg.norm(chord[:, :3], axis=1, keepdims=True)
    axis = np.divide(chord[:, :3], size, out=np.full((count, 3), np.nan), where=size > 0)
    slope = np.divide(chord[:, 3], end - start, out=np.zeros(count), where=end > start)
    return np.column_stack([values_at[:, :3], axis, values_at[:, 3], slope, values_at[:, 4]])[size[:, 0] > 0]


def _directions_around(axis: np.ndarray, n: int) -> np.ndarray:
    """Directions perpendicular to each axis, (P, n, 3), evenly around it; the first points down as far as it can."""
    down, aside = (v - axis * (axis @ v)[:, None] for v in (np.array([0.0, 0, -1]), np.array([1.0, 0, 0])))
    size = np.linalg.norm(down, axis=1, keepdims=True)
    first = np.where(size > 1e-6, down, aside)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    turn = 2 * np.pi * np.arange(n)[:, None] / n
    return np.cos(turn) * first[:, None] + np.sin(turn) * np.cross(axis, first)[:, None]


def _object_points(skeleton: Skeleton, cloud: Any) -> np.ndarray:
    """The points of the object, none for an empty `cloud`."""
    if isinstance(cloud, tuple | list) and len(cloud) == 0:
        return np.empty((0, 3))
    whole = skeleton.whole
    if cloud is None and (skeleton.lacks_sample or len(whole.points) == 0):
        raise InvalidParameterError(
            "this skeleton has no points of the object: give its cloud (--cloud), or cloud=() to check nothing"
        )
    points = whole.points if cloud is None else surface_points(cloud)
    return points[np.isfinite(points).all(axis=1)]


def _check(skeleton: Skeleton, clearance: Any, around: Any, spacing: Any, min_confidence: Any) -> None:
    if len(skeleton.vertices) == 0:
        raise InvalidParameterError("the skeleton is empty: there is nothing to grasp")
    if not np.isfinite(skeleton.radii).any():
        raise InvalidParameterError("grasps need finite vertices and radii: save skeletons as .json, .npz or .ply")
    if min_confidence != 0 and np.isnan(skeleton.confidence).all():
        raise InvalidParameterError("this skeleton has no confidence: give min_confidence=0 (--min-confidence 0)")
    check_number("clearance", clearance, low=0)
    check_number("spacing", spacing, "float?", low=0, open_low=True)
    check_number("min_confidence", min_confidence, low=0, high=1)
    check_number("around", around, "int", low=1)
