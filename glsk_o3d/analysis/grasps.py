"""Where a gripper with parallel jaws can take an object: candidates along its skeleton."""

from __future__ import annotations

import math
import warnings
from collections import Counter
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InvalidParameterError, SkeletonWarning
from ..report import outside
from .grippers import GraspCandidates, told

if TYPE_CHECKING:
    from ..skeleton import Skeleton


def grasp_candidates(
    skeleton: Skeleton,
    max_opening: float,
    *,
    min_opening: float = 0.0,
    clearance: float | None = None,
    around: int = 8,
    spacing: float | None = None,
    margin: float = 1.0,
    min_confidence: float = 0.5,
    up: Any = (0.0, 0.0, 1.0),
) -> GraspCandidates:
    r"""Candidates for grasps with parallel jaws, from the axis and the radii of a skeleton's branches.

    The jaws close across a branch: at places along its curve, from directions around it. With the radius r of the ball
    on the axis that touches the surface and its change :math:`r' = dr/ds` along the curve, a part of round section is
    :math:`w = 2 r / \sqrt{1 - r'^2}` wide across its axis: :math:`2 r` on a tube, more on a cone, which the ball
    touches ahead of its widest section. Direction and :math:`r'` are those of a chord of the curve, from one radius
    before the place to one behind.

    Parameters
    ----------
    skeleton : Skeleton
        With radii.
    max_opening : float
        Widest opening of the gripper [cloud's units]. A place is left out where w and the clearance exceed it.
    min_opening : float
        Opening down to which it closes [cloud's units]; parts no wider than that are left out.
    clearance : float, optional
        What the opening exceeds the width w by [cloud's units], half on either side; by default a tenth of
        `max_opening`.
    around : int
        Approach directions at each place, evenly around the axis.
    spacing : float, optional
        Distance of the places along the curve [cloud's units]; by default the median radius of the branch. Around a
        closed branch it is changed so that it fits a whole number of times.
    margin : float
        Least distance along the curve from the ends of the branch, over the radius at that end: there, jaws meet other
        parts, or only half of them the part.
    min_confidence : float
        Least confidence of the skeleton, from 0 to 1. 0 takes also what nobody has measured.
    up : (3,) float array_like
        The first approach comes from above, as nearly as can be at a right angle to the axis; on axes parallel to `up`,
        from a side that depends on nothing but `up`.

    Returns
    -------
    GraspCandidates
        Best first; of equal ones, in the order of the branches, along them and around. Places: ``len`` over `around`.

    Raises
    ------
    InvalidParameterError
        The skeleton is empty or has no radii; it has no confidence, but `min_confidence` is above 0; or a parameter is
        out of range.

    Warns
    -----
    SkeletonWarning
        There is no candidate; it says why.

    Notes
    -----
    The quality is confidence x room x evenness. *Room* is :math:`1 - w / w_{max}`, the share of the widest opening that
    is left to miss the part by. *Evenness* is :math:`\sqrt{1 - r'^2}`, the cosine of the angle between the closing
    direction and the surface where the jaws meet it: 1 on a tube. An unknown confidence counts as 1. It ranks; it is no
    measure of force closure. What stands in the way of the gripper is not looked at.

    References
    ----------
    After Vahrenkamp et al. 2018, "Planning high-quality grasps using mean curvature object skeletons", IEEE RA-L 3(2),
    who place hands along the branches of a mesh's skeleton, at right angles to them. They align the hand with the
    section of the surface and evaluate the contacts; this function spreads the approaches evenly and does not.

    Examples
    --------
    >>> from glsk_o3d import Skeleton
    >>> from glsk_o3d.samples import tube
    >>> straight = tube(length=1.0, radius=0.1)
    >>> axis = Skeleton(straight.nodes, straight.edges, straight.radii, (), (), (), confidence=[1, 1])
    >>> grasps = grasp_candidates(axis, max_opening=0.4, clearance=0.05, around=4)
    >>> grasps
    GraspCandidates(36 at 9 places)
    >>> float(grasps.opening[0]), float(grasps.quality[0])
    (0.25, 0.5)
    """
    clearance = max_opening / 10 if clearance is None and _is_number(max_opening) else clearance
    _check(skeleton, max_opening, min_opening, clearance, around, spacing, margin, min_confidence)
    found = [_places(skeleton, path, spacing, margin) for path in skeleton.branches]
    empty = np.empty((0, 9))
    place = np.concatenate([empty, *found])
    branch = np.repeat(np.arange(len(found)), list(map(len, found))) if found else np.empty(0, int)
    positions, axis = place[:, :3], place[:, 3:6]
    radius, slope, confidence = place[:, 6:].T
    with np.errstate(divide="ignore", invalid="ignore"):
        even = np.sqrt(np.clip(1 - slope**2, 0, None))
        width = 2 * radius / even
    reasons = {
        "unknown radius": np.isnan(width),
        "too wide": width + clearance > max_opening,
        "too thin": width <= min_opening,
        "uncertain": ~(confidence >= min_confidence) if min_confidence > 0 else np.zeros(len(width), bool),
    }
    first = np.select(list(reasons.values()), list(reasons), "")
    left_out = dict(Counter(first[first != ""].tolist()))
    short = sum(len(rows) == 0 for rows in found)
    if short:
        left_out["branches without a place between their margins"] = short
    taken = np.flatnonzero(first == "")
    quality = np.nan_to_num(confidence[taken], nan=1.0) * (1 - width[taken] / max_opening) * even[taken]
    order = np.argsort(-quality.round(9), kind="stable")  # equal ones differ in their last digits
    taken = taken[order]
    approach = _around(axis[taken], _direction(up), around)
    again = np.repeat(taken, around)
    candidates = GraspCandidates(
        positions=positions[again],
        approach=approach,
        closing=np.cross(axis[again], approach),
        opening=(width + clearance)[again],
        branch=branch[again],
        confidence=confidence[again],
        quality=np.repeat(quality[order], around),
        places=len(place),
        left_out=left_out,
    )
    if len(taken) == 0:
        why = told(left_out, ": ") or ": the skeleton has no branch"
        warnings.warn(f"no grasp at {len(place)} places{why}", SkeletonWarning, stacklevel=outside())
    return candidates


def _check(skeleton, max_opening, min_opening, clearance, around, spacing, margin, min_confidence):
    if len(skeleton.vertices) == 0:
        raise InvalidParameterError("the skeleton is empty: there is nothing to grasp")
    if not (np.isfinite(skeleton.vertices).all() and np.isfinite(skeleton.radii).any()):
        raise InvalidParameterError("grasps need finite vertices and radii: save skeletons as .json, .npz or .ply")
    if min_confidence != 0 and np.isnan(skeleton.confidence).all():
        raise InvalidParameterError("this skeleton has no confidence, perhaps due to its file: give min_confidence=0")
    for name, value, low, high, closed in (
        ("max_opening", max_opening, 0, math.inf, False),
        ("min_opening", min_opening, 0, max_opening, True),
        ("clearance", clearance, 0, math.inf, True),
        ("spacing", spacing, 0, math.inf, False),
        ("margin", margin, 0, math.inf, True),
        ("min_confidence", min_confidence, 0, 1, True),
    ):
        if name == "spacing" and value is None:
            continue
        if not (_is_number(value) and (low <= value if closed else low < value) and value <= high):
            limits = f"{'at least' if closed else 'above'} {low}" + (f" and at most {high}" if high < math.inf else "")
            raise InvalidParameterError(f"{name} = {value!r}: must be a finite number, {limits}")
    if isinstance(around, bool) or not isinstance(around, int | np.integer) or around < 1:
        raise InvalidParameterError(f"around = {around!r}: must be a whole number of at least 1")


def _is_number(value):
    return isinstance(value, int | float | np.number) and not isinstance(value, bool) and math.isfinite(value)


def _direction(up):
    try:
        vector = np.asarray(up, float)
    except (TypeError, ValueError):
        vector = np.empty(0)
    if vector.shape != (3,) or not (np.isfinite(vector).all() and vector.any()):
        raise InvalidParameterError(f"up = {up!r}: must be three finite numbers, not all 0")
    vector = vector / np.abs(vector).max()
    return vector / np.linalg.norm(vector)


def _places(skeleton, path, spacing, margin):
    """Places along a branch, (n, 9): position, axis, radius, its slope, confidence."""
    curve, radii = skeleton.vertices[path], skeleton.radii[path]
    along = np.r_[0, np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))]
    length = along[-1]
    if not length > 0:
        return np.empty((0, 9))
    closed = path[0] == path[-1] and skeleton.degree[path[0]] == 2
    usual = np.nanmedian(radii) if np.isfinite(radii).any() else 0.0
    step = spacing or usual or length / 10
    low, high = 0.0, length
    if closed:
        count = max(round(length / step), 1)
        at = length / count * np.arange(count)
    else:
        low, high = margin * np.nan_to_num(radii[0]), length - margin * np.nan_to_num(radii[-1])
        if low > high:
            return np.empty((0, 9))
        count = int((high - low) / step * (1 + 1e-12)) + 1
        at = (low + high) / 2 + step * (np.arange(count) - (count - 1) / 2)

    values = np.column_stack([curve, radii, skeleton.confidence[path]])

    def sample(places):
        period = {"period": length} if closed else {}
        return np.column_stack([np.interp(places, along, column, **period) for column in values.T])

    here = sample(at)
    reach = np.where(here[:, 3] > 0, here[:, 3], step)
    if closed:
        before, behind = at - np.minimum(reach, length / 4), at + np.minimum(reach, length / 4)
    else:
        before, behind = np.maximum(at - reach, 0), np.minimum(at + reach, length)
    chord = sample(behind) - sample(before)
    size = np.linalg.norm(chord[:, :3], axis=1, keepdims=True)
    axis = np.divide(chord[:, :3], size, out=np.full((count, 3), np.nan), where=size > 0)
    slope = chord[:, 3] / (behind - before)
    found = np.column_stack([here[:, :3], axis, here[:, 3], slope, here[:, 4]])
    return found[size[:, 0] > 0]


def _around(axis, up, n):
    """Directions perpendicular to each axis, n of each in turn; the first points down as far as it can."""
    side = np.eye(3)[np.argmin(np.abs(up))]
    down = -(up - axis * (axis @ up)[:, None])
    other = side - axis * (axis @ side)[:, None]
    size = np.linalg.norm(down, axis=1, keepdims=True)
    first = np.where(size > 1e-6, down, other)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    turn = 2 * np.pi * np.arange(n)[:, None] / n
    around = np.cos(turn) * first[:, None] + np.sin(turn) * np.cross(axis, first)[:, None]
    return around.reshape(-1, 3)
