"""Grow ends anew along their limbs, to where the limbs stop."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from ...geometry.groups import Members, quantile
from ...geometry.neighbourhoods import plane_axes
from ...geometry.numbers import derived, fitted, measured
from ...geometry.polylines import arc_lengths, place_at
from ...geometry.vectors import TINY, Floats, box, cross, dot, norm, unit
from ..axis.fit import axis_box
from ..axis.sections import VertexPoints
from ..curve import Curve
from ..numbers import CURVE


@dataclass(frozen=True)
class EndNumbers:
    """Numbers of `regrow_ends`."""

    cut: float = fitted(1.75, "half widths from where the points stop, within which a cap bends the curve")
    size: float = fitted(4.0, "radii behind the cut that show how wide a limb is, and how it tapers")
    reach: float = fitted(0.98, "share of an end's points within its reach: noise throws the others farther")
    bending: float = fitted(0.5, "weight of going straight on, twice lambda")
    rounds: int = measured(3, "rounds; from then on hardly anything moves")
    points: int = derived(4, "points; fewer cannot say where a limb turns")
    thinner: float = measured(2 / 3, "most radius of a neck over its limb's; a round cap seems to have .85")
    sides: float = derived(1 / 3, "least share of sides among the last points: 2/3 at a flat end, none on its face")
    one_sided: float = derived(1 / np.pi, "radii from the axis to the mean of points around it: of half a tube more")
    curve_samples: int = derived(64, "places along a parabola that say its length to 1e-3")
    direction_samples: int = derived(16, "places along a run that say its direction")
    cap_power: int = fitted(3, "power of c, the cosine of normals with the axis, by which points of a cap count")
    round_mean: float = derived(4 / 5, "mean of c on a round cap of radius 1, where all heights have the same area")
    round_variance: float = derived(2 / 75, "variance of c on a round cap")
    round_area: float = derived(1 / 2, "sum of the weights of a round cap over that of a flat one")


END = EndNumbers()


def regrow_ends(curve: Curve, to_surface: bool = False) -> Curve:
    r"""Cut every end where a cap may have bent it, and let it grow along its limb to where this stops.

    Contraction draws the end of a limb into an edge or a corner of the face that closes it, and the fit follows, since
    the normals of a cap do not say where the axis is. So vertices are cut that are in a corner, see `_last`, or within
    1.75 half widths of where the points stop, or within their own half width of the last one. The limb goes on in the
    direction t of the two radii behind, with the turn d and the bend k, across t, that the normals n of its sides ask
    for:

    .. math:: \sum_p w \left((b \cdot (s (t + d) + s^2 k / 2 - p))^2 + \lambda (s^2 |d|^2 + s^4 |k|^2 / 4)\right),
        \quad b = n \times t

    with p and its length s along t seen from the last vertex left. A point whose plane passes the curve by half a
    radius counts half, and those beyond the reach do not count. The fit is made three times, each along t + d of the
    one before. See `_End.tip` and `_End._cap` for where it stops, which may also be where the axis comes `to_surface`.
    No end is out of the box around all points, nor farther aside than its own: normals of walls that slope, as of a
    pan, meet far in front of its mouth, where the fit would lead.

    New vertices come behind all others, with the confidence of the run behind and the radii of their own sections.
    Points of a vertex that was cut belong to the nearest one of the same end. Loops and vertices without edges stay.
    """
    if not len(curve.leaves):
        return curve
    grown = [end_grown for end in _ends(curve) if (end_grown := _grow(curve, *end, to_surface))]
    return _replanted(curve, grown) if grown else curve


class _Grown(NamedTuple):
    """An end that has grown anew."""

    path: np.ndarray  # (p,) its branch, towards the leaf
    cut: int  # number along the path of the first vertex that goes
    places: np.ndarray  # (k, 3), of the new vertices, outwards
    run: np.ndarray  # vertices behind the cut


def _ends(curve: Curve) -> Iterator[tuple[np.ndarray, int, bool]]:
    """Every branch that has a leaf, seen towards it, the first vertex that may go, and whether it begins with a leaf.

    The vertex in the middle of a branch with two ends stays. Of another the first vertex out of the part that it grows
    from stays, which says where it leads; one that does not leave that part is none of them.
    """
    for branch in curve.branches:
        leaf, along = curve.degree[branch[[0, -1]]] == 1, arc_lengths(curve.vertices[branch])
        if not along[-1] > 0 or (leaf.all() and len(branch) < 3):
            continue
        middle = 1 + np.argmin(np.abs(along[1:-1] - along[-1] / 2)) if leaf.all() else 0
        for path, ends, stays in ((branch[::-1], leaf[0], len(branch) - 1 - middle), (branch, leaf[1], middle)):
            if ends and not leaf.all():
                away = norm(curve.vertices[path] - curve.vertices[path[0]])
                stays = np.flatnonzero(away <= curve.cloud.distance[path[0]])[-1] + 1
            if ends and stays < len(path):
                yield path, int(stays + 1), bool(leaf.all())


def _grow(curve: Curve, path: np.ndarray, first: int, other: bool, to_surface: bool) -> _Grown | None:
    """Cut the end of a path, and let it grow anew; None if too few points say where."""
    cloud, sections = curve.cloud, curve.sections
    places, radii, half_widths = curve.vertices[path], sections.radius[path], sections.half_width[path]
    along = arc_lengths(places)
    last = _last(cloud, path, along, first, other)
    length = along[last]
    run, cut, direction = _within(along, length, END.size * quantile(radii)), len(path), np.zeros(3)
    late = (length - along <= half_widths) & (other | (along >= half_widths))
    late[last + 1 :] = True
    stop = np.clip(along[np.argmax(late)] if late.any() else length, length / 2, length)
    for _ in range(2):  # how far the points reach is seen along a run that is no part of the cap itself
        radius, wide = quantile(radii[run]), quantile(half_widths[run])
        start = max(stop - CURVE.line_length * radius, 0)
        direction, anchor = _way(places, along, start, stop), place_at(places, along, stop)
        # the points of a junction are other limbs', too
        own = cloud.members.of(path[max(np.searchsorted(along, start), 0 if other else 1) :])
        if len(own) < END.points:
            return None
        reach = quantile((cloud.points[own] - anchor) @ direction, END.reach)
        close = ((places - anchor) @ direction > reach - END.cut * wide) | late
        close = np.flatnonzero(close & (along > start))
        cut = max(close[0] if len(close) else len(path), first)
        stop = along[cut - 1]
        run = _within(along, stop, END.size * radius)
    radius, anchor = quantile(radii[run]), places[cut - 1]
    if stop > radius / 2:  # of a stub there is no run: it goes on as it was
        direction = _way(places, along, max(stop - CURVE.line_length * radius, 0), stop)
    own = cloud.members.of(path[max(cut - 2, 0 if other else min(1, len(path) - 1)) :])
    points = cloud.points[own] - anchor
    ahead = points @ direction > 0
    if ahead.sum() < END.points:
        return None
    end = _End.of(points[ahead], cloud.normals[own[ahead]], direction, radius)
    behind = _within(along, stop, END.size * radius)
    tip = end.tip(_Taper.of(along[behind] - stop, radii[behind], radius), to_surface)
    steps = np.diff(along[run])
    step = quantile(steps) if len(steps) else length / last
    tip = max(tip, step / 2)
    # edges of no length are those of no limb
    number = max(round(min(tip / max(step, TINY), len(points))), 1)
    ahead = _between(points, direction, end.curve(np.arange(1, number + 1) / number * tip))
    return _Grown(path, cut, anchor + ahead, path[run])


def _between(points: np.ndarray, direction: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Places (k, 3) in the box around points (n, 3) and the origin across a direction, along their principal axes."""
    across = plane_axes(direction[None])[0]
    flat = (points - points.mean(axis=0)) @ across
    across = across @ np.linalg.eigh(flat.T @ flat)[1]
    low, high = box(np.concatenate([points @ across, np.zeros((1, 2))]))
    aside = places @ across
    return places + (np.clip(aside, low, high) - aside) @ across.T


def _last(cloud: VertexPoints, path: np.ndarray, along: np.ndarray, first: int, other: bool) -> int:
    """Number along a path of the last vertex before the curve is drawn into a corner.

    The vertices after it have at most a fiftieth of the branch's points, without those of a junction, and are no longer
    than what a cap bends.
    """
    count = cloud.count[path] * (other | (np.arange(len(path)) > 0))
    own = cloud.members.of(path[count > 0])
    thick = np.sqrt((cloud.offset[own] ** 2).sum() / max(len(own), 1))
    seen = np.cumsum(count[::-1])[::-1] > (1 - END.reach) * len(own)
    least = np.searchsorted(along, along[-1] - END.cut * thick)
    return int(min(max(np.flatnonzero(seen).max(initial=0), least, first), len(path) - 1))


def _within(along: np.ndarray, stop: float, length: float) -> np.ndarray:
    """Numbers of the vertices of a path in a run that ends at `stop`, at least one, int array."""
    last = max(np.searchsorted(along, stop, side="right") - 1, 0)
    return np.arange(min(np.searchsorted(along, stop - length), last), last + 1)


def _way(places: np.ndarray, along: np.ndarray, start: float, stop: float) -> np.ndarray:
    """Direction of a path from one length along it to another, (3,) float array, by least squares."""
    lengths = np.linspace(start, stop, END.direction_samples)
    direction: Floats = (lengths - lengths.mean()) @ place_at(places, along, lengths)
    return direction / max(np.linalg.norm(direction), TINY)


class _Taper(NamedTuple):
    """The radius of a limb as it goes on: it may get smaller, but nobody knows of a limb that it gets thicker."""

    radius: float  # where the limb is cut
    slope: float

    @classmethod
    def of(cls, along: np.ndarray, radii: np.ndarray, radius: float) -> _Taper:
        """From radii behind the cut, (k,) float arrays, and that of the run."""
        away = along - along.mean()
        spread = away @ away
        # a run shorter than its radius says nothing
        slope = (away @ radii) / spread if len(along) > 3 and np.ptp(along) > radius else 0.0
        slope = float(np.clip(slope, -1, 0))
        return cls(radius * (1 + slope * CURVE.line_length / 2), slope)

    def at(self, length: float) -> float:
        return max(self.radius + self.slope * length, 0.0)


class _End(NamedTuple):
    """What lies ahead of the last vertex that is left of a limb, seen from there."""

    points: np.ndarray  # (n, 3)
    normals: np.ndarray  # (n, 3), of either sign
    direction: Floats  # (3,), slope of the parabola at the origin
    bend: Floats  # (3,), and how fast it changes along it
    length: np.ndarray  # (n,), along the curve to the place nearest to each point
    steps: np.ndarray  # (s,), of the parabola,
    along: np.ndarray  # (s,), and its length up to them

    @classmethod
    def of(cls, points: np.ndarray, normals: np.ndarray, direction: np.ndarray, radius: float) -> _End:
        """The curve through the origin in a direction that suits the points best."""
        turn = bend = np.zeros(3)
        for _ in range(END.rounds):  # the axis of the parabola is the limb behind: where this turns, so must the axis
            direction = unit((direction + turn)[None])[0]
            turn, bend = _turn_and_bend(points, normals, direction, bend, radius)
        step, direction = points @ direction, direction + turn
        # the nearest place of the curve: one step of Newton from the one abreast, by a radius at most
        slope = direction + step[:, None] * bend
        off = points - step[:, None] * direction - (step**2 / 2)[:, None] * bend
        step = step + np.clip(dot(off, slope) / np.maximum(dot(slope, slope) - off @ bend, 0.5), -radius, radius)
        steps = np.linspace(0, max(2 * step.max(), TINY), END.curve_samples)
        along = arc_lengths(np.stack([steps, steps**2 / 2], axis=1) @ np.stack([direction, bend]))
        return cls(points, normals, direction, bend, np.interp(step, steps, along), steps, along)

    def curve(self, length: np.ndarray) -> np.ndarray:
        """Places so far ahead, (k, 3) float array."""
        step: Floats = np.interp(length, self.along, self.steps) + np.maximum(length - self.along[-1], 0)
        return step[:, None] * self.direction + (step**2 / 2)[:, None] * self.bend

    def slope(self, length: np.ndarray) -> np.ndarray:
        """Directions of the curve so far ahead, (k, 3) float array."""
        return self.direction + np.interp(length, self.along, self.steps)[:, None] * self.bend

    def tip(self, taper: _Taper, to_surface: bool) -> float:
        """How far the limb goes on, or its axis within it.

        Where its last points are much nearer to the axis than it is thick, as on the neck of a bottle, it has the cap
        of that thinner limb.
        """
        reach, farthest = quantile(self.length, END.reach), float(self.length.max())
        if to_surface and 2 * taper.at(farthest) < taper.radius:  # hardly any points say where a cone has its apex
            return min(taper.radius / -taper.slope, farthest)
        return self._cap(self._thinner(taper, reach), reach, to_surface)

    def _thinner(self, taper: _Taper, reach: float) -> _Taper:
        """The limb of the last points, if they are much nearer to the axis than it is thick, and all around it."""
        radius = given = taper.at(reach - taper.radius)
        centre = np.zeros(3)
        for _ in range(END.rounds):
            late = self.length > reach - radius
            if late.sum() < END.points:
                break
            length = self.length[late]
            tangent = unit(self.slope(length))
            normals = self.normals[late] - dot(self.normals[late], tangent)[:, None] * tangent
            away = self.points[late] - self.curve(length)
            centre = away.mean(axis=0)
            sides = dot(normals, normals).sum()
            if sides < END.sides * late.sum():
                return taper
            across = norm(normals) @ np.abs(dot(away, normals)) / max(sides, TINY)
            radius = min(radius, float(across))
        around = np.linalg.norm(centre) < END.one_sided * radius
        return _Taper(radius, 0.0) if around and radius < END.thinner * given else taper

    def _cap(self, taper: _Taper, reach: float, to_surface: bool) -> float:
        """How far it is to half a radius inside a flat cap, or to the centre of a round one; or to the cap itself.

        Let c be the cosine of an outward normal with the axis. The mean length s with the weights c^3 is on a flat cap,
        and .8 radii beyond the centre of a round one; the variance is 0 there and 2/75 squared radii here, so mean - r
        / 2 - 45/4 variance / r is right in both. Averages do not follow single points, as extremes do in noise. What is
        missing of the cap, of an open pipe all of it, counts as if it were where the sides stop: twice as far as their
        mean. The cap itself is at mean + 15/2 variance / r.
        """
        start = max(reach - taper.at(reach - taper.radius), 0.0)
        late = self.length > start
        if late.sum() < END.points:
            return reach if to_surface else max(reach - taper.at(reach) / 2, 0.0)
        length = self.length[late] - start
        tangent = self.slope(self.length[late])
        normals, points = self.normals[late], self.points[late] - self.curve(np.array([start]))
        outward = np.where(dot(normals, points) < 0, -1, 1) * dot(normals, tangent) / norm(tangent)
        # those of a cone lean outwards, too
        cap = np.maximum(outward + taper.slope / np.hypot(1, taper.slope), 0) ** END.cap_power
        side = np.maximum(1 - outward**2, 0)
        stop = 2 * (side @ length) / max(side.sum(), TINY)
        weight, radius = float(cap.sum()), taper.at(start + stop)
        mean = cap @ length / max(weight, TINY)
        variance = max(cap @ length**2 / max(weight, TINY) - mean**2, 0)
        # the cap of a tube has half a radius times the area of a unit of its length
        owed = END.round_area * side.sum() * taper.radius / (2 * max(stop, TINY))
        seen = weight / max(owed, weight, TINY)
        round_share = min(variance / max(END.round_variance * radius**2, TINY), 1)
        if to_surface:
            tip = start + seen * (mean + (1 - END.round_mean) * round_share * radius) + (1 - seen) * stop
            return min(max(tip, 0.0), float(self.length.max()))
        inside = (END.round_mean - 1 / 2) * round_share
        tip = start + seen * mean + (1 - seen) * stop - (1 / 2 + seen * inside) * radius
        return min(max(tip, 0.0), reach)


def _turn_and_bend(
    points: np.ndarray, normals: np.ndarray, direction: np.ndarray, bend: np.ndarray, radius: float
) -> np.ndarray:
    """How a limb from the origin in a direction turns aside there, and how it bends, (2, 3) float array."""
    length, across = points @ direction, cross(normals, direction)
    powers, miss = np.stack([length, length**2 / 2], axis=1), dot(across, points)
    residual = miss - powers[:, 1] * (across @ bend)
    weight = (length <= quantile(length, END.reach)) * radius**2 / (radius**2 + 4 * residual**2 + TINY)
    frame: Floats = plane_axes(direction[None])[0].T
    rows = (powers[:, :, None] * (across @ frame.T)[:, None]).reshape(-1, 4)
    stiff = END.bending / 2 * (weight @ powers**2).repeat(2)
    solution: Floats = np.linalg.solve(
        (weight[:, None] * rows).T @ rows + np.diag(stiff + TINY), (weight * miss) @ rows
    )
    return solution.reshape(2, 2) @ frame


def _replanted(curve: Curve, grown: list[_Grown]) -> Curve:
    """With new ends instead of those that were cut."""
    m = len(curve.vertices)
    members = Members(curve.vertex_of_point, m)  # those without a normal, too
    keep, owner = np.ones(m, bool), curve.vertex_of_point.copy()
    low, high = axis_box(curve.points[curve.supporting_points])
    edges, known = [curve.edges], {name: [getattr(curve, name)] for name in ("radii", "confidence")}
    planted = [np.clip(end.places, low, high) for end in grown]
    for (path, cut, _, run), places in zip(grown, planted, strict=True):
        gone, names = path[cut:], m + np.arange(len(places))
        m += len(places)
        keep[gone] = False
        chain = np.concatenate([path[cut - 1 : cut], names])
        edges.append(np.column_stack([chain[:-1], chain[1:]]))
        for values in known.values():
            values.append(np.full(len(places), quantile(values[0][run])))
        lost = members.of(gone)
        near = cKDTree(np.concatenate([curve.vertices[chain[:1]], places])).query(curve.points[lost])[1]
        owner[lost] = chain[near]
    keep = np.concatenate([keep, np.ones(m - len(keep), bool)])
    number, links = np.cumsum(keep) - 1, np.concatenate(edges)
    links = number[links[keep[links].all(axis=1)]]
    known["vertices"] = [curve.vertices, *planted]
    of_vertices = {name: np.concatenate(values)[keep] for name, values in known.items()}
    replanted = curve.rewired(links, **of_vertices, vertex_of_point=np.append(number, -1)[owner])
    section = replanted.sections.radius
    new = np.flatnonzero(keep) >= len(curve.vertices)
    # without points a vertex has no section, and keeps the radius of the run
    return replanted.changed(radii=np.where(new & (section > 0), section, replanted.radii))
