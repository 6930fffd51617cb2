"""Obstacles of a gripper on a straight approach: points, and what lies behind a plane."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from ..errors import InvalidParameterError
from ..geometry.vectors import norm
from ..parameters import shown
from .grasp_sections import Sections
from .gripper import Gripper

CELL_NEIGHBOURS = 8  # measured: of 1230 approaches through sparse walls 11 seemed free with 4, 1 with 6, none with 8
# derived: eight neighbours within half a finger's thickness leave a hole as wide as a finger with probability e^-10
CLOSE_POINTS = 0.5
CLEARANCES = (3, 2, 1)  # measured: how many to try; the wider the jaws open, the fewer meet a side that nobody has seen
LEAST_CONTACT = 0.7  # fitted: cosine of the angle between jaws and surface; of steeper ones few hold
SIDE_BEGINS = np.sqrt(3) / 2  # derived: where a side begins, over the radius: the cosine of 30 degrees


class Surface(NamedTuple):
    """The pieces of surface around N points that a gripper must not touch."""

    pieces: np.ndarray  # (N, K, 3), places in each of them, of which the first is the point
    spread: np.ndarray  # (N,), of these from the point at most


class Approaches(NamedTuple):
    """Straight approaches to P places, A to each of them."""

    position: np.ndarray  # (P, 3), on the axis
    axis: np.ndarray  # (P, 3), of the part
    approach: np.ndarray  # (P, A, 3), perpendicular to the axis
    closing: np.ndarray  # (P, A, 3), from jaw to jaw
    sections: Sections  # (P, A) arrays: the part between the jaws

    def of(self, places: Any) -> Approaches:
        """Those to some of the places."""
        vectors = (self.position[places], self.axis[places], self.approach[places], self.closing[places])
        return Approaches(*vectors, self.sections.of(places))


def check_approaches(
    approaches: Approaches,
    surface: Surface | None,
    plane: np.ndarray | None,
    middle: np.ndarray,
    gripper: Gripper,
    clearance: float,
) -> tuple[dict[str, np.ndarray], np.ndarray, np.ndarray, np.ndarray]:
    """The obstacles of a gripper that is open by three clearances more than the part, or where it is not free, by less.

    `surface` is what `surface_around` gives, None if it is not to be checked; `middle`, (m, 3), are on this side of the
    plane, (4,), and an approach is as long as their diagonal. The obstacles, (P, A) bool arrays by name, are those
    at the least opening, for approaches that are free at none. Three (P, A) arrays follow: the widest opening at which
    the approach is free, the depth of the fingertips past the axis, and the number of sides of the part that have
    points, as in `GraspCandidates`.
    """
    distance = float(np.linalg.norm(np.ptp(middle, axis=0)))
    width, shape = approaches.sections.width, approaches.approach.shape[:2]
    depth = np.minimum(gripper.reach, approaches.sections.far)
    aside = approaches.sections.shift[..., None, None] * [1.0, 0, 0]
    too_wide = np.asarray(width + clearance > gripper.max_opening)
    slanted = approaches.sections.contact < LEAST_CONTACT
    opening, sides_seen, free = np.full(shape, np.nan), np.zeros(shape, int), np.zeros(shape, bool)
    for times in CLEARANCES:
        wide = np.minimum(width + times * clearance, gripper.max_opening)
        low, high = (corner + aside for corner in swept(gripper, wide, depth, clearance, distance))
        possible = ~(free | too_wide | slanted)
        obstacles: dict[str, Any] = {"ways in where it is too wide": too_wide, "ways in to slanted sides": slanted}
        if surface is not None:
            touching = hits(approaches, surface, low, high, possible).any(axis=2)
            possible &= ~touching
            first, last = (corner + aside for corner in sides(gripper, wide, depth, width))
            occupied = hits(approaches, surface, first, last, possible)
            sides_seen = np.where(possible, occupied.sum(axis=2), sides_seen)
            empty = possible & ~occupied[..., :2].any(axis=2)
            possible &= ~empty
            obstacles |= {"ways in that touch points": touching, "ways in with nothing between the jaws": empty}
        behind = possible & (plane is not None and hits_plane(approaches, plane, middle, low, high).any(axis=2))
        possible &= ~behind
        obstacles["ways in behind the plane"] = behind
        opening = np.where(possible, wide, opening)
        free |= possible
    blocked = {name: approach & ~free for name, approach in obstacles.items()}
    return blocked, opening, depth, sides_seen


def swept(
    gripper: Gripper, opening: np.ndarray, depth: np.ndarray, clearance: float, distance: float
) -> tuple[np.ndarray, np.ndarray]:
    """Corners, (P, A, 3, 3), of the boxes that the gripper sweeps on its approach, with half the clearance around them.

    The inner faces of the fingers stay: between them and the part is half the clearance already.
    """
    low, high = gripper.boxes(opening, depth)
    before, behind = np.full((2, 3, 3), clearance / 2)
    behind[0, 0] = before[1, 0] = 0
    before[:, 2] += distance
    return low - before, high + behind


def sides(gripper: Gripper, opening: np.ndarray, depth: np.ndarray, width: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Corners of the boxes around three sides of the part, (P, A, 3, 3) float arrays: those on which the jaws
    close, and the one towards the palm.

    Of a round section each has what is within 30 degrees of its direction; jaws close as far to either side of the axis
    as their tips reach past it.
    """
    jaw, core, across = opening / 2, SIDE_BEGINS * width / 2, np.full_like(opening, gripper.finger[1] / 2)
    low = [[-jaw, -across, -depth], [core, -across, -depth], [-jaw, -across, -jaw]]
    high = [[-core, across, depth], [jaw, across, depth], [jaw, across, -core]]
    return np.array(low).transpose(2, 3, 0, 1), np.array(high).transpose(2, 3, 0, 1)


def surface_around(
    positions: np.ndarray, points: np.ndarray, gripper: Gripper, clearance: float, distance: float
) -> Surface | None:
    """What a gripper can touch on approaches from a distance to positions (P, 3); None without points."""
    if len(points) == 0:
        return None
    pieces = cells(points, CLOSE_POINTS * min(gripper.finger[:2]))
    spread = norm(pieces - pieces[:, :1]).max(axis=1)
    if len(positions):
        low, high = swept(gripper, np.array(gripper.max_opening), np.array(gripper.reach), clearance, distance)
        reach = norm(np.maximum(-low, high)).max() + gripper.max_opening / 2 + spread
        near = cKDTree(positions).query(pieces[:, 0])[0] <= reach
        pieces, spread = pieces[near], spread[near]
    return Surface(pieces, spread)


def cells(points: np.ndarray, close: float) -> np.ndarray:
    """The piece of surface around each point: (N, K, 3) float array of places in it.

    Where points are no farther than `close` from all neighbours, no finger comes through between them: K is 1.
    Otherwise the piece reaches halfway to the neighbours. The box around its places, in the frame of the gripper, lies
    within the extent of the points: it makes the part no thicker, and leaves no gaps. Repeated points and those that
    are not finite do not count.
    """
    points = np.unique(points[np.isfinite(points).all(axis=1)], axis=0)
    k = min(CELL_NEIGHBOURS, len(points) - 1)
    if k < 1:
        return points[:, None]
    distance, neighbour = cKDTree(points).query(points, k + 1)
    if distance.max() <= close:
        return points[:, None]
    return (points[:, None] + points[neighbour]) / 2  # the nearest neighbour is the point itself


def hits(
    approaches: Approaches, surface: Surface, low: np.ndarray, high: np.ndarray, possible: np.ndarray
) -> np.ndarray:
    """Which boxes have pieces of surface in them, (P, A, B) bool array, of the approaches that are `possible`, (P, A).

    `low` and `high`, (P, A, B, 3), are corners in the frame of the gripper: x closing, y axis of the part, z approach.
    """
    hit = np.zeros((*possible.shape, low.shape[2]), bool)
    reach, across = norm(np.maximum(np.abs(low), np.abs(high))), np.maximum(-low[..., 1], high[..., 1])
    for place in np.flatnonzero(possible.any(axis=1)):
        rows, position, axis = np.flatnonzero(possible[place]), approaches.position[place], approaches.axis[place]
        centre = surface.pieces[:, 0] - position
        near = np.abs(centre @ axis) < across[place].max() + surface.spread
        near &= norm(centre) <= reach[place].max() + surface.spread
        offset = surface.pieces[near] - position
        first, last = _ends(offset @ axis)
        x, z = offset @ approaches.closing[place, rows].T, offset @ approaches.approach[place, rows].T
        least, most = zip(_ends(x), (first[:, None], last[:, None]), _ends(z), strict=True)
        for box in range(low.shape[2]):
            inside = [(most[i] > low[place, rows, box, i]) & (least[i] < high[place, rows, box, i]) for i in range(3)]
            hit[place, rows, box] = (inside[0] & inside[1] & inside[2]).any(axis=0)
    return hit


def _ends(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest along axis 1; quick where there is but one."""
    return (values[:, 0], values[:, 0]) if values.shape[1] == 1 else (values.min(axis=1), values.max(axis=1))


def hits_plane(
    approaches: Approaches, plane: np.ndarray, middle: np.ndarray, low: np.ndarray, high: np.ndarray
) -> np.ndarray:
    """Which boxes, as in `hits`, reach behind the plane a x + b y + c z + d = 0, seen from the points of the object."""
    size = np.linalg.norm(plane[:3])
    normal, shift = plane[:3] / size, plane[3] / size
    if np.median(middle @ normal + shift) < 0:
        normal, shift = -normal, -shift
    axis = np.broadcast_to(approaches.axis[:, None], approaches.approach.shape)
    slope = (np.stack([approaches.closing, axis, approaches.approach], axis=2) @ normal)[:, :, None]
    lowest = np.where(slope > 0, low, high)
    return (approaches.position @ normal + shift)[:, None, None] + (lowest * slope).sum(axis=3) < 0


def checked_plane(plane: Any) -> np.ndarray:
    """The plane as a (4,) float array; InvalidParameterError for anything else."""
    try:
        numbers = np.asarray(plane, float).reshape(4)
    except (TypeError, ValueError):
        numbers = np.zeros(4)
    if not (np.isfinite(numbers).all() and numbers[:3].any()):
        must = "must be four finite numbers a, b, c, d of ax + by + cz + d = 0, a, b, c not all 0"
        raise InvalidParameterError(f"plane = {shown(plane)}: {must}, such as 0, 0, 1, -0.5 for the table z = 0.5")
    return numbers
