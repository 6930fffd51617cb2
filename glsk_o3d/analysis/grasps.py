"""Candidates for grasps with parallel jaws along a skeleton, with a free approach."""

import time
import warnings
from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np

from ..data.points import surface_points
from ..data.report import outside
from ..data.skeleton import Skeleton
from ..data.verdict import CODES, Verdict
from ..errors import InvalidParameterError, SkeletonWarning
from ..filters.outlier_remover import OutlierRemover
from ..filters.sampler import Sampler
from ..geometry.frame import MIN_POINTS
from ..geometry.groups import group_rank
from ..geometry.neighbourhoods import nearest_neighbours, principal
from ..geometry.polylines import arc_lengths
from ..parameters import check_number
from .curves import check_places
from .grasp_checks import Approaches, check_approaches, checked_plane, surface_around
from .grasp_sections import in_time, sections_at
from .gripper import GraspCandidates, Gripper, in_words

TABLE_SHARE = 0.05  # fitted: of the opening, the distance from a plane up to which points are of the table
SECTIONS_SHARE = 0.5  # speed: of the time at most, for what the parts are like; the rest is for ways in
WALL_POINTS = 16  # fitted: neighbours among outliers that show whether they form a wall
WALL_FLATNESS = 0.01  # fitted: third over first principal spread of outliers that form a wall
TURNS_PER_STEP = 2  # fitted: directions per approach direction, one of which is across the thin side of a flat part
FLAT_PART = 0.9  # fitted: width across the thin side of a flat part, over that in the usual directions
UNSEARCHED = "places not searched"
UNLIKELY_OPENING = 20.0  # derived: openings over diagonals: above those of hands and screws, below those of mm and m


def grasp_candidates(
    skeleton: Skeleton,
    gripper: Gripper | float,
    *,
    cloud: Any = None,
    mask: Any = None,
    plane: Any = None,
    clearance: float | None = None,
    around: int = 12,
    spacing: float | None = None,
    min_confidence: float = 0.25,
    accept: Verdict | str = Verdict.DOUBTFUL,
    outlier_factor: float = 2.5,
    max_places: int | None = None,
    seconds: float | None = None,
) -> GraspCandidates:
    """Candidates for grasps with parallel jaws, from the axis and the sections of a skeleton's branches.

    The jaws close across a branch, at places along its curve and from directions around it, one of which is across the
    thin side of a flat part. The points of the branch give the width in each direction. The open gripper approaches
    in a straight line, from as far away as the diagonal of the object, until its fingertips are past the axis by its
    reach, but not past the part. Approaches are left out if a finger or the palm would touch points or reach behind a
    table's plane, if no points are between the jaws, or if the surface is slanted where the jaws close. Unseen space
    counts as free. The quality ranks candidates; it does not measure force closure. Its formula, each step, and the
    sources (Vahrenkamp et al. 2018; ten Pas et al. 2017): docs/grasping.md.

    Parameters
    ----------
    skeleton : Skeleton
        With radii.
    gripper : Gripper or float
        Or its widest opening [cloud's units], with the other sizes in proportion.
    cloud : cloud, optional
        All points that the gripper must not touch, such as the whole scene; by default the skeleton's. With an empty
        tuple a finger may go through the object.
    mask : (N,) bool array, optional
        Which points of `cloud` are of the object; by default the skeleton's points are the object.
    plane : (4,) array_like, optional
        A table, as from Open3D's ``segment_plane``: solid behind it as seen from the object. It stands for the points
        that are up to a twentieth of the opening away from it.
    clearance : float, optional
        Opening beyond the width w [cloud's units], half on either side; twice or three times as much where that is
        free, as sides that nobody has seen may be wider. Half of it is also kept all around the gripper. By default a
        tenth of the widest opening.
    around : int
        Approach directions at each place, evenly around the axis; the first is as near as possible to -z, or turned by
        half a step where this is across the thin side.
    spacing : float, optional
        Distance of the places along the curve [cloud's units]; by default the median radius of the branch, at most the
        width of a finger. They keep a radius away from the ends of the branch.
    min_confidence : float
        Least confidence of the skeleton, from 0 to 1; 0 also takes unknown confidences.
    accept : Verdict or str
        Worst verdict of a skeleton that gets candidates: the axis of a sheet or a ball is no place to grasp. Its handle
        may be one; with ``"no curve skeleton"`` it is searched.
    outlier_factor : float
        As of `glsk_o3d.OutlierRemover`: outliers are no obstacles. 0 makes every point one.
    max_places : int, optional
        Places to search, the most promising ones by confidence, width and contact.
    seconds : float, optional
        Wall time after which no further place is searched, these most promising ones first. The first one is in any
        case, and so are the points prepared for it.

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
        There is no candidate, with the reason; the verdict is not accepted; or the gripper is so large that it may be
        in other units.

    Examples
    --------
    >>> from glsk_o3d import Skeleton
    >>> from glsk_o3d.samples import tube
    >>> straight = tube(length=1.0, radius=0.1)
    >>> axis = Skeleton(straight.nodes, straight.edges, straight.radii, (), (), (), confidence=[1, 1])
    >>> table = (0, 0, 1, 0.1)  # z = -0.1: the tube lies on it, and cannot be taken from below, nor from the side
    >>> grasp_candidates(axis, 0.4, cloud=straight.points, plane=table, clearance=0.05, around=4)
    GraspCandidates(10 at 10 places; not taken: 30 ways in behind the plane)
    """
    gripper = gripper if isinstance(gripper, Gripper) else Gripper(gripper)
    clearance = gripper.max_opening / 10 if clearance is None else clearance
    _check(skeleton, clearance, around, spacing, min_confidence, accept, max_places, seconds, outlier_factor)
    start, budget = time.monotonic(), np.inf if seconds is None else seconds
    plane = None if plane is None else checked_plane(plane)
    points, middle = _obstacles(skeleton, cloud, mask, outlier_factor)
    if plane is not None:  # it stands for the points of the table
        height = np.abs(points @ plane[:3] + plane[3]) / np.linalg.norm(plane[:3])
        points = points[height > TABLE_SHARE * gripper.max_opening]
    _check_units(gripper, middle)
    accepted = _is_accepted(skeleton, accept)
    skeleton = skeleton if accepted else replace(skeleton, edges=np.empty((0, 2), int))
    place, branch, approaches, rejected, n_places = _graspable_places(
        skeleton, gripper, clearance, around, spacing, min_confidence, start + SECTIONS_SHARE * budget
    )
    sections = approaches.sections
    confidence = np.nan_to_num(place[:, 8], nan=1.0)[:, None]
    quality = confidence * np.clip(1 - sections.width / gripper.max_opening, 0, None) * sections.contact
    ranked = np.argsort(-quality.max(axis=1, initial=0).round(9), kind="stable")[:max_places]
    distance = float(np.linalg.norm(np.ptp(middle, axis=0)))
    surface = surface_around(approaches.position, points, gripper, clearance, distance)
    around_it = (surface, plane, middle, gripper, clearance)
    opening, depth, seen, left_out = _searched(approaches, ranked, around_it, start + budget, rejected)
    free = np.flatnonzero(np.isfinite(opening))
    if len(points):
        quality = quality * seen / 3
    value = quality.ravel()[free].round(9)
    # the best of each place, then the second best of each; in each round the best first; equal ones in their order
    best = np.argsort(-value, kind="stable")
    free = free[best[np.argsort(group_rank(free[best] // around, len(place)), kind="stable")]]
    row = free // around
    closing = approaches.closing.reshape(-1, 3)[free]
    candidates = GraspCandidates(
        position=place[row, :3] + sections.shift.ravel()[free, None] * closing,
        approach=approaches.approach.reshape(-1, 3)[free],
        closing=closing,
        opening=opening.ravel()[free],
        depth=depth.ravel()[free],
        branch=branch[row],
        confidence=place[row, 8],
        contact=sections.contact.ravel()[free],
        quality=quality.ravel()[free],
        seen=seen.ravel()[free],
        gripper=gripper,
        places=n_places - left_out[UNSEARCHED],
        left_out=dict(left_out),
    )
    if len(candidates) == 0 and accepted:
        reason = in_words(candidates.left_out) or "the skeleton has no branch"
        warnings.warn(f"no grasp at {candidates.places} places: {reason}", SkeletonWarning, stacklevel=outside())
    return candidates


def _searched(
    approaches: Approaches, ranked: np.ndarray, around_it: tuple[Any, ...], stop: float, rejected: dict[str, int]
) -> tuple[np.ndarray, np.ndarray, np.ndarray, Counter[str]]:
    """Opening, depth and number of seen sides of approaches, by a check of places in their rank until a time.

    `around_it` is what `check_approaches` takes further.

    The opening is NaN of those that are not free. The obstacles are counted, and so are the places not searched, with
    those `rejected` before.
    """
    shape = approaches.approach.shape[:2]
    opening, depth, seen = np.full(shape, np.nan), np.zeros(shape), np.zeros(shape, int)
    blocked, unsearched = Counter[str](), shape[0]
    for row in in_time(ranked, stop):
        obstacles, opening[row], depth[row], seen[row] = check_approaches(approaches.of([row]), *around_it)
        blocked.update(_remaining(obstacles)[1])
        unsearched -= 1
    blocked[UNSEARCHED] = unsearched
    return opening, depth, seen, Counter(rejected) + blocked


def _check_units(gripper: Gripper, middle: np.ndarray) -> None:
    """Warn if a gripper is so large for the points of the object that it may be in other units."""
    if gripper.max_opening > UNLIKELY_OPENING * np.linalg.norm(np.ptp(middle, axis=0)):
        many = f"more than {UNLIKELY_OPENING:g} times as wide as the object is long"
        warnings.warn(f"the gripper opens {many}: are the units the same?", SkeletonWarning, stacklevel=outside())


def _is_accepted(skeleton: Skeleton, accept: Verdict | str) -> bool:
    """Whether the verdict is at least as good; if not, a warning says why."""
    verdict = skeleton.verdict
    if verdict >= accept:
        return True
    reason = "; ".join(it.text for it in skeleton.reasons if CODES[it.code] == verdict)
    advice = f"accept={verdict.value!r} takes it all the same"
    warnings.warn(f"{verdict.value} ({reason}): {advice}", SkeletonWarning, stacklevel=outside())
    return False


def _graspable_places(
    skeleton: Skeleton,
    gripper: Gripper,
    clearance: float,
    around: int,
    spacing: float | None,
    min_confidence: float,
    stop: float,
) -> tuple[np.ndarray, np.ndarray, Approaches, dict[str, int], int]:
    """Places that fit between the jaws: as of `_places_on`, with branch and approaches; the others are counted.

    The counts are those of the rejected places, by reason, and of all places. The time is over at `stop`.
    """
    places = [_places_on(skeleton, path, spacing, gripper.finger[1]) for path in skeleton.branches]
    counts = np.array(list(map(len, places)), int)
    place, branch = np.concatenate([np.empty((0, 9)), *places]), np.repeat(np.arange(len(places)), counts)
    finer = TURNS_PER_STEP if around > 1 else 1
    approach = _directions_around(place[:, 3:6], finer * around)
    closing = np.cross(place[:, None, 3:6], approach)
    confidence = place[:, 8]
    promise = np.nan_to_num(confidence, nan=1.0) * (1 - 2 * np.nan_to_num(place[:, 6]) / gripper.max_opening)
    rows = in_time(np.argsort(-promise, kind="stable"), stop)
    sections, is_examined = sections_at(skeleton, branch, place, (approach, closing), gripper, rows)
    turn = _turn_across(sections.width, around)
    columns = (finer * np.arange(around) + turn[:, None]) % (finer * around)
    every = np.arange(len(place))[:, None], columns
    approaches = Approaches(place[:, :3], place[:, 3:6], approach[every], closing[every], sections.of(every))
    width = approaches.sections.width.min(axis=1)
    reasons = {
        UNSEARCHED: ~is_examined,
        "unknown radius": np.isnan(width),
        "too wide": width + clearance > gripper.max_opening,
        "uncertain": ~(confidence >= min_confidence) if min_confidence > 0 else np.zeros(len(width), bool),
    }
    remaining, left_out = _remaining(reasons)
    if not counts.all():
        left_out["branches without a place between their margins"] = int((counts == 0).sum())
    return place[remaining], branch[remaining], approaches.of(remaining), left_out, len(place)


def _turn_across(width: np.ndarray, around: int) -> np.ndarray:
    """Columns by which the directions of each place are turned, so that one is across the thin side of a flat part."""
    finer = width.shape[1] // around
    if finer == 1:
        return np.zeros(len(width), int)
    turns = np.arange(-(finer // 2) + 1, finer // 2 + 1)
    columns = (finer * np.arange(around) + turns[:, None]) % (finer * around)
    narrowest = width[:, columns].min(axis=2)  # (P, turns)
    narrow = narrowest.min(axis=1) < FLAT_PART * narrowest[:, turns == 0][:, 0]
    return np.where(narrow, turns[narrowest.argmin(axis=1)], 0)


def _remaining(reasons: dict[str, np.ndarray]) -> tuple[np.ndarray, dict[str, int]]:
    """The rows without a reason to reject them, and for each reason how often it is the first."""
    first = np.select([reason.ravel() for reason in reasons.values()], list(reasons), "")
    return np.flatnonzero(first == ""), dict(Counter(first[first != ""].tolist()))


def _places_on(skeleton: Skeleton, path: np.ndarray, spacing: float | None, widest: float) -> np.ndarray:
    """Places along a branch, (n, 9): position, axis, radius, its slope, confidence."""
    curve, radii = skeleton.vertices[path], skeleton.radii[path]
    along = arc_lengths(curve)
    length = along[-1]
    if not length > 0:
        return np.empty((0, 9))
    closed = path[0] == path[-1] and skeleton.degree[path[0]] == 2
    median_radius = np.nanmedian(radii) if np.isfinite(radii).any() else 0.0
    step = spacing or min(median_radius or length / 10, widest)
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


def _obstacles(skeleton: Skeleton, cloud: Any, mask: Any, factor: float) -> tuple[np.ndarray, np.ndarray]:
    """Points that a gripper must not touch, none for an empty `cloud`, and those of the object or its vertices."""
    whole, none = skeleton.whole, isinstance(cloud, tuple | list) and len(cloud) == 0
    if cloud is None and (skeleton.lacks_sample or len(whole.points) == 0):
        raise InvalidParameterError(
            "this skeleton has no points of the object: give its cloud (--cloud), or cloud=() to check nothing"
        )
    points = np.empty((0, 3)) if none else whole.points if cloud is None else surface_points(cloud)
    chosen = None if mask is None else np.asarray(mask)
    if chosen is not None and (chosen.shape != (len(points),) or chosen.dtype != bool or not chosen.any()):
        raise InvalidParameterError(f"mask: must be a bool array of the {len(points)} points of the cloud, some True")
    thing = points[chosen] if chosen is not None else points if len(whole.points) == 0 else whole.points
    points, thing = (it[np.isfinite(it).all(axis=1)] for it in (points, thing))
    return points[~_outliers(points, factor)], thing if len(thing) else skeleton.vertices


def _outliers(points: np.ndarray, factor: float) -> np.ndarray:
    """Outliers among points, (N,) bool array, without those that form a sparse wall among themselves."""
    if not factor or len(points) <= MIN_POINTS:
        return np.zeros(len(points), bool)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SkeletonWarning)
        outlier = (Sampler() | OutlierRemover(outlier_factor=factor))(points).outlier.copy()
    rows = np.flatnonzero(outlier)
    if len(rows) > WALL_POINTS:
        third, _, first = principal(points[rows], nearest_neighbours(points[rows], WALL_POINTS)[1])[0].T
        outlier[rows[third < WALL_FLATNESS * first]] = False
    return outlier


def _check(
    skeleton: Skeleton,
    clearance: Any,
    around: Any,
    spacing: Any,
    min_confidence: Any,
    accept: Any,
    max_places: Any,
    seconds: Any,
    outlier_factor: Any,
) -> None:
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
    if accept not in list(Verdict):
        raise InvalidParameterError(f"accept = {accept!r}: must be one of {', '.join(it.value for it in Verdict)}")
    check_number("max_places", max_places, "int?", low=1)
    check_number("seconds", seconds, "float?", low=0)
    check_number("outlier_factor", outlier_factor, low=0)
