"""What a gripper would run into on its straight way in: points, and what lies behind a plane."""

from typing import Any, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from ..errors import InvalidParameterError
from ..geometry.vectors import norm
from .gripper import Gripper

CELL_NEIGHBOURS = 8  # measured: of 1230 ways through sparse walls 11 seemed free with 4, 1 with 6, none with 8
# derived: eight neighbours within half a finger's thickness leave a hole as wide as a finger with probability e^-10
CLOSE_POINTS = 0.5
WIDER = (1, 2, 3)  # measured: clearances to try; in noise of 0.5 % of the diagonal the first alone leaves few grasps
AT_THE_SIDE = np.sqrt(3) / 2  # derived: where a side begins, over the radius: the cosine of 30 degrees


class Ways(NamedTuple):
    """Straight ways in to P places, A to each of them."""

    position: np.ndarray  # (P, 3)
    axis: np.ndarray  # (P, 3), of the part
    approach: np.ndarray  # (P, A, 3), perpendicular to the axis
    closing: np.ndarray  # (P, A, 3), from jaw to jaw


def free_ways(
    ways: Ways,
    points: np.ndarray,
    plane: np.ndarray | None,
    middle: np.ndarray,
    gripper: Gripper,
    width: np.ndarray,
    clearance: float,
) -> tuple[dict[str, np.ndarray], np.ndarray, np.ndarray, np.ndarray]:
    """What keeps the gripper from coming in, open a little wider than the `width` of the part, (P,), or wider still.

    `points` are those of the object, if anybody is to look at them. Where the object is says `middle`, (m, 3): on this
    side of the plane, (4,), and the gripper comes from its diagonal away.

    The reasons, (P, A) bool arrays, are those at the least opening, for ways that are free at none. Three (P, A) arrays
    follow: the least opening at which the way is free, the depth of the fingertips past the axis, and the number of
    sides of the part that have points, as in `GraspCandidates`.
    """
    far = float(np.linalg.norm(np.ptp(middle, axis=0)))
    surface = cells(points, CLOSE_POINTS * min(gripper.finger[:2]))
    depth = np.minimum(gripper.reach, width / 2)
    shape = ways.approach.shape[:2]
    reasons: dict[str, Any] = {}
    opening, seen, free = np.full(shape, np.nan), np.zeros(shape, int), np.zeros(shape, bool)
    for times in WIDER:
        wide = np.minimum(width + times * clearance, gripper.max_opening)
        low, high = swept(gripper, wide, depth, clearance, far)
        asked, found = ~free, dict[str, Any]()
        if len(points):
            touched = hits(ways, surface, low, high, asked).any(axis=2)
            asked &= ~touched
            beside = hits(ways, surface, *sides(gripper, wide, depth, width), asked)
            seen = np.where(asked, beside.sum(axis=2), seen)
            empty = asked & ~beside[..., :2].any(axis=2)
            asked &= ~empty
            found |= {"ways in that touch points": touched, "ways in with nothing between the jaws": empty}
        behind = asked & (plane is not None and hits_plane(ways, plane, middle, low, high).any(axis=2))
        asked &= ~behind
        found["ways in behind the plane"] = behind
        opening = np.where(asked, wide[:, None], opening)
        free |= asked
        reasons = reasons or found
    met = {name: part & ~free for name, part in reasons.items()}
    return met, opening, np.broadcast_to(depth[:, None], shape), seen


def swept(
    gripper: Gripper, opening: np.ndarray, depth: np.ndarray, clearance: float, way: float
) -> tuple[np.ndarray, np.ndarray]:
    """Corners, (P, 3, 3), of what the gripper's boxes sweep on a straight way in, with half the clearance around them.

    The inner faces of the fingers stay: between them and the part is half the clearance already.
    """
    low, high = gripper.boxes(opening, depth)
    towards, away = np.full((2, 3, 3), clearance / 2)
    away[0, 0] = towards[1, 0] = 0
    towards[:, 2] += way
    return low - towards, high + away


def sides(gripper: Gripper, opening: np.ndarray, depth: np.ndarray, width: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Corners of the boxes around three sides of the part, (P, 3, 3) float arrays: those on which the jaws close, and
    the one towards the palm.

    Of a round section each has what is within 30 degrees of its direction; jaws close as far to either side of the axis
    as their tips reach past it.
    """
    jaw, core, across = opening / 2, AT_THE_SIDE * width / 2, np.full_like(opening, gripper.finger[1] / 2)
    low = [[-jaw, -across, -depth], [core, -across, -depth], [-jaw, -across, -jaw]]
    high = [[-core, across, depth], [jaw, across, depth], [jaw, across, -core]]
    return np.moveaxis(np.array(low), 2, 0), np.moveaxis(np.array(high), 2, 0)


def cells(points: np.ndarray, close: float) -> np.ndarray:
    """The piece of surface that each point stands for: (N, K, 3) float array of places in it.

    Where points are no farther than `close` from all neighbours, no finger comes through between them: K is 1. Where
    they are, each stands for the surface halfway to its neighbours. The box around these places, in the frame of the
    gripper, lies within the extent of the points: it makes the part no thicker, and leaves no gaps. Repeated points and
    those that are not finite do not count.
    """
    points = np.unique(points[np.isfinite(points).all(axis=1)], axis=0)
    k = min(CELL_NEIGHBOURS, len(points) - 1)
    if k < 1:
        return points[:, None]
    distance, neighbour = cKDTree(points).query(points, k + 1)
    if distance.max() <= close:
        return points[:, None]
    return (points[:, None] + points[neighbour]) / 2  # each is its own nearest


def hits(ways: Ways, surface: np.ndarray, low: np.ndarray, high: np.ndarray, asked: np.ndarray) -> np.ndarray:
    """Which boxes have pieces of surface in them, (P, A, B) bool array, of the ways that are `asked`, (P, A).

    `surface` is what `cells` gives; `low` and `high`, (P, B, 3), are corners in the frame of the gripper: x closing, y
    axis of the part, z approach.
    """
    found = np.zeros((*asked.shape, low.shape[1]), bool)
    if not (len(surface) and asked.any()):
        return found
    reach = norm(np.maximum(np.abs(low), np.abs(high))).max() + norm(surface - surface[:, :1]).max()
    within = cKDTree(ways.position).query(surface[:, 0], distance_upper_bound=reach)[0] <= reach
    surface = surface[within]
    for place in np.flatnonzero(asked.any(axis=1)):
        some = np.flatnonzero(asked[place])
        first, last = _ends(surface @ ways.axis[place] - ways.position[place] @ ways.axis[place])
        near = np.flatnonzero((last > low[place, :, 1].min()) & (first < high[place, :, 1].max()))
        offset = surface[near] - ways.position[place]
        x, z = offset @ ways.closing[place, some].T, offset @ ways.approach[place, some].T
        least, most = zip(_ends(x), (first[near, None], last[near, None]), _ends(z), strict=True)
        for box in range(low.shape[1]):
            inside = [(most[i] > low[place, box, i]) & (least[i] < high[place, box, i]) for i in range(3)]
            found[place, some, box] = (inside[0] & inside[1] & inside[2]).any(axis=0)
    return found


def _ends(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest along axis 1; quick where there is but one."""
    return (values[:, 0], values[:, 0]) if values.shape[1] == 1 else (values.min(axis=1), values.max(axis=1))


def hits_plane(ways: Ways, plane: np.ndarray, middle: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Which boxes, as in `hits`, reach behind the plane a x + b y + c z + d = 0, seen from the points of the object."""
    size = np.linalg.norm(plane[:3])
    normal, shift = plane[:3] / size, plane[3] / size
    if np.median(middle @ normal + shift) < 0:
        normal, shift = -normal, -shift
    frame = np.stack([ways.closing, np.broadcast_to(ways.axis[:, None], ways.approach.shape), ways.approach], axis=2)
    slope = (frame @ normal)[:, :, None]
    lowest = np.where(slope > 0, low[:, None], high[:, None])
    return (ways.position @ normal + shift)[:, None, None] + (lowest * slope).sum(axis=3) < 0


def checked_plane(plane: Any) -> np.ndarray:
    """The plane as a (4,) float array; InvalidParameterError if it is none."""
    try:
        found = np.asarray(plane, float).reshape(4)
    except (TypeError, ValueError):
        found = np.zeros(4)
    if not (np.isfinite(found).all() and found[:3].any()):
        must = "must be finite a, b, c, d of ax + by + cz + d = 0, a, b, c not all 0"
        raise InvalidParameterError(f"plane = {plane!r}: {must}")
    return found
