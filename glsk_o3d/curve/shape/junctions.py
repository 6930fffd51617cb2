"""Move junctions to where limbs meet: their lines and the surface around say it, and not the contraction."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from ...geometry.numbers import derived, fitted, precision
from ...geometry.polylines import arc_lengths, place_at, relative_distance
from ...geometry.vectors import TINY, dot
from ..axis.fit import axis_box
from ..curve import Curve
from ..limbs import JunctionLimbs, Line
from ..merging import merge_into
from ..numbers import CURVE
from .handles import Handles


@dataclass(frozen=True)
class JunctionNumbers:
    """Numbers of `move_junctions`."""

    line_noise: float = fitted(0.05, "radii that a line is off at its middle, on a straight limb")
    line_step: float = derived(0.1, "radii from one place on a limb to the next that is asked")
    fade: float = derived(1.5, "lengths of its line, over the last of which a limb counts less and less")
    most_steps: int = derived(400, "places on a limb at most")
    least_steps: int = precision(8, "places on a limb at least")
    surface: float = fitted(12.0, "weight of the surface that fits a sphere, over that of a certain line")
    rounds: int = precision(10, "rounds; from then on hardly anything moves")
    radius_hold: float = precision(1e-6, "weight of the sphere's radius before, where no surface says it")


JUNCTION = JunctionNumbers()


class _Place(NamedTuple):
    """Where a junction belongs."""

    place: np.ndarray
    radius: float  # of the sphere that touches the surface there
    lines: list[Line]  # of its limbs, as in `JunctionLimbs.at`


def move_junctions(curve: Curve) -> Curve:
    """Move junctions to where their limbs meet, merge those within one radius, and make the limbs straight from there.

    The contraction draws limbs together before they meet: the junction of a sharp corner lies inside it, limbs that
    leave a part bend, and limbs that enter a thick part nearly at one place have junctions of their own, in any order.
    The lines of limbs where they are undisturbed, and the surface around, say where they meet, see `meet`; all by
    weights, so that the place moves little if the points do. Of two junctions that are then less than a radius apart,
    nearest first, one is made, unless a loop would close.

    Handles are followed to the wall of their body, see `Handles`, and go straight on from there to the place nearest to
    the junction. If two of them, or both ends of one, meet more than half the body's half width from the mean of its
    points, that is the junction's place. In a body without a junction, the vertex nearest to its middle takes that
    part. Points there belong to the vertex to which they are nearest, less its radius.
    """
    if not len(curve.junctions) and not curve.n_loops:
        return curve
    known = dict[bytes, _Place]()
    while True:
        limbs = JunctionLimbs(curve)
        places = _places(curve, limbs, known)
        merged = _merged(curve, limbs, places)
        if merged is None:
            break
        curve = merged
    if curve.n_loops and len(curve.supporting_points):
        handles = Handles(curve)
        limbs = JunctionLimbs(curve, handles.bodies)
        places = _places(curve, limbs, known, handles)
    return _straightened(curve, limbs, places)


def _places(
    curve: Curve, limbs: JunctionLimbs, known: dict[bytes, _Place], handles: Handles | None = None
) -> dict[int, _Place]:
    """Where every junction belongs, if that is not known of the same limbs from before others were merged."""
    cloud = handles.cloud if handles else curve.cloud
    low, high = axis_box(cloud.points if len(cloud.points) else curve.vertices)
    places = {}
    for junction in sorted(limbs.at):
        name, limbs_here = limbs.signature(junction), limbs.at[junction]
        paths = [limbs.paths[limb] for limb in limbs_here]
        body = handles.body(paths) if handles and any(map(handles.on_loop, paths)) else None
        follows = [handles.follow(path, body) if handles and body else None for path in paths]
        followed = sum(line is not None for line in follows)
        if name in known and not followed:
            places[junction] = known[name]
            continue
        lines, radius, around = [], 0.0, []
        for limb, path, line in zip(limbs_here, paths, follows, strict=True):
            along = arc_lengths(limbs.vertices[path])
            others = [limbs.paths[k] for k in limbs_here if limbs.branch[k] != limbs.branch[limb]]
            radius_of = limbs.radius[limbs.branch[limb]]
            line = line or limb_line(limbs.vertices, limbs.surface, path, radius_of, others)
            lines.append(line)
            radius = max(radius, float(np.interp(line.start, along, limbs.surface[path])))
            around.append(path[along <= along[-1] / 2])
        if len(lines) == 2 and followed < 2:  # no junction, but in a body of which a handle is not known
            continue
        own = cloud.members.of(np.unique(np.concatenate(around)))
        place, touching = meet(lines, curve.vertices[junction], radius, cloud.points[own], cloud.normals[own])
        if body and followed > 1:  # their lines pass each other
            near = np.linalg.norm(place - body.middle) < body.half_width / 2
            place = place if len(lines) > 2 and near else body.middle
        place = np.clip(place, low, high)  # normals that mean nothing may meet anywhere
        for k, line in enumerate(lines):
            if len(line.lead) > 1:  # a handle goes straight on through its body to the place nearest to the middle
                wall = line.lead[:1]
                way_in = wall + max((place - wall[0]) @ line.direction, 0) * line.direction
                lines[k] = line._replace(lead=np.concatenate([way_in, line.lead]))
        known[name] = places[junction] = _Place(place, touching, lines)
    return places


def _merged(curve: Curve, limbs: JunctionLimbs, places: dict[int, _Place]) -> Curve | None:
    """Merge pairs of junctions, each the other's nearest, that a branch joins and a radius parts; None if none are."""
    ends = [tuple(sorted(branch[[0, -1]].tolist())) for branch in limbs.branches]
    near: dict[int, tuple[float, int]] = {}
    for k in np.flatnonzero(limbs.inner).tolist():
        (a, b) = (places[v] for v in ends[k])
        distance = float(np.linalg.norm(a.place - b.place)) / max(a.radius, b.radius, TINY)
        if distance < 1 and ends.count(ends[k]) == 1:
            for v in ends[k]:
                near[v] = min(near.get(v, (np.inf, k)), (distance, k))
    pairs = [k for k in {k for _, k in near.values()} if all(near[v][1] == k for v in ends[k])]
    if not pairs:
        return None
    group, vertices, radii = np.arange(len(curve.vertices)), curve.vertices.copy(), curve.radii.copy()
    for k in pairs:
        stays = ends[k][0]
        group[limbs.branches[k]] = stays
        vertices[stays] = np.mean([places[v].place for v in ends[k]], axis=0)
        radii[stays] = radii[list(ends[k])].max()
    merged = merge_into(curve.changed(vertices=vertices, radii=radii), group)
    return merged if merged.n_loops == curve.n_loops else None


def _straightened(curve: Curve, limbs: JunctionLimbs, places: dict[int, _Place]) -> Curve:
    """Put junctions in their places, and the disturbed parts of limbs on straight lines from there."""
    vertices, radii = curve.vertices.copy(), curve.radii.copy()
    confidence, owner = curve.confidence.copy(), curve.vertex_of_point.copy()
    for junction, (place, _, lines) in places.items():
        vertices[junction] = place
        radii[junction], entering = 0, list[np.ndarray]()
        for limb, line in zip(limbs.at[junction], lines, strict=True):
            path = limbs.paths[limb]
            along = arc_lengths(curve.vertices[path])
            start, lead = line.start, line.lead
            # the place lies ahead of where the limb is joined: it would turn back
            if len(lead) == 1 and (lead[0] - place) @ line.direction > 0:
                ahead = np.flatnonzero((along > start) & ((curve.vertices[path] - place) @ line.direction < 0))
                if len(ahead):
                    start, lead = along[ahead[0]], curve.vertices[path[ahead[:1]]]
            moved = np.flatnonzero((along > 0) & (along < start))
            lead = np.concatenate([[place], lead])
            lengths = arc_lengths(lead)
            new_length = along[moved] / max(start, TINY) * lengths[-1]
            if len(lead) > 2 and len(moved):  # the wall is a corner
                new_length[np.abs(new_length - lengths[2]).argmin()] = lengths[2]
            vertices[path[moved]] = place_at(lead, lengths, new_length)
            # a junction owns points of everything around: what it measured itself does not count
            radius = np.interp(start, along, curve.radii[path])
            radii[path[moved]] = radius
            if len(lead) > 2:  # but what a body measured does
                inside, radius = path[moved[new_length < lengths[1]]], curve.radii[junction]
                confidence[path[moved]] = np.interp(start, along, curve.confidence[path])
                radii[inside], confidence[inside] = radius, curve.confidence[junction]
                entering.append(path[moved])
            radii[junction] = max(radii[junction], radius)
        if entering:
            chain = np.concatenate([[junction], *entering])
            own = np.flatnonzero(np.isin(owner, chain))
            away = cdist(curve.points[own], vertices[chain]) - radii[chain]
            owner[own] = chain[away.argmin(axis=1)]
    moved = curve.changed(vertices=vertices, radii=radii, confidence=confidence, vertex_of_point=owner)
    return moved.with_gaps(_through_air(curve, places))


def _through_air(curve: Curve, places: dict[int, _Place]) -> np.ndarray:
    """Ends of the ways from junctions to their limbs that no point is beside, (g, 2, 3): those of handles in a bowl.

    There, none is within two radii of the thickest limb.
    """
    if not places:
        return np.empty((0, 2, 3))
    ends = np.array(
        [(junction.place, line.lead[:2][-1]) for junction in places.values() for line in junction.lines]
    ).reshape(-1, 2, 3)
    thickest = [max(line.radius for line in junction.lines) for junction in places.values() for _ in junction.lines]
    away = cKDTree(curve.points[curve.vertex_of_point >= 0]).query(ends.mean(axis=1))[0]
    return ends[np.isfinite(away) & (away > CURVE.line_length * np.array(thickest))]


def limb_line(
    vertices: np.ndarray, surface: np.ndarray, path: np.ndarray, radius: float, others: Sequence[np.ndarray]
) -> Line:
    """The straight line through the part of a limb that is undisturbed by others, and nearest to its junction.

    Nothing is decided: every place counts by how far it has left the others, from 0 at their surface on, and less and
    less from one undisturbed radius on, to 0 at three. The half towards the limb's other end counts as undisturbed,
    whatever is there.
    All paths are numbers of `vertices` (M, 3), the limb's from its junction on; the surface is `surface` (M,) away from
    these.
    """
    places = vertices[path]
    along = arc_lengths(places)
    step = max(JUNCTION.line_step * radius, along[-1] / JUNCTION.most_steps, TINY)
    n = max(int(np.ceil(along[-1] / step)), JUNCTION.least_steps)
    step, half = along[-1] / n, n // 2
    positions = (np.arange(n) + 0.5) * step
    middles, clear = place_at(places, along, positions), np.ones(n)
    if others:
        ratio, _ = relative_distance(middles, vertices, surface, others)
        clear = np.clip((ratio - 1) / (2 * (CURVE.undisturbed - 1)), 0, 1)
        clear[:half] = np.minimum.accumulate(clear[:half][::-1])[::-1]  # what left and came back had not left
    start = float((1 - clear[:half]).sum() * step)
    anchor = place_at(places, along, start)
    weight = clear * np.clip(JUNCTION.fade - np.cumsum(clear) * step / max(CURVE.line_length * radius, TINY), 0, 1)
    total = weight.sum()
    if total * step <= 0:
        return Line(anchor, np.zeros(3), 0.0, 0.0, start, anchor[None], radius)
    weight /= total
    middle, mean = weight @ middles, weight @ positions
    direction = (weight * (mean - positions)) @ (middles - middle)  # towards the junction
    direction /= max(np.linalg.norm(direction), TINY)
    off = middles - middle - (mean - positions)[:, None] * direction
    spread, bend = np.sqrt(weight @ (positions - mean) ** 2), np.sqrt(weight @ dot(off, off))
    return Line(middle, direction, float(spread), float(bend), start, anchor[None], radius)


def meet(
    lines: Sequence[Line], near: np.ndarray, radius: float, points: np.ndarray, normals: np.ndarray
) -> tuple[np.ndarray, float]:
    r"""The place that some lines and the surface around agree on, in the sense of least squares.

    .. math:: \sum_i w_i |(x - m_i)_{\perp i}|^2 + W \sum_p u_p (|n_p \cdot (p - x)| - r)^2 / \sum_p g_p
        + \epsilon |x - x_0|^2

    over x and r, the radius of the sphere, which is returned, too. A line counts by how far it may be off at x, as far
    ahead of the middle of its part as D: the bend b of the part, and a twentieth of the limb's radius, grow with the
    square of that over the part's spread s, so that :math:`w = 1 / (1 + ((b / r_i + 0.05) (1 + D^2 / s^2))^2)`, and by
    how far aside of x it passes. The rest says what is the middle of the surface there, the centre of a sphere that
    touches as many tangent planes as possible, where limbs are too short to say anything: :math:`g_p` falls like a
    Gaussian with the distance of a point, and :math:`u_p` with how far its plane is from the sphere, too, so that a
    surface without such a sphere has no say. The junction was `near`, and `radius` is that of the thickest limb there.
    """
    place, touching, radius = near, radius, max(radius, TINY ** (1 / 3))  # its square is a divisor
    known = [line for line in lines if line.spread > 0 and line.radius > 0]
    middle, direction = np.array([(line.middle, line.direction) for line in known]).reshape(-1, 2, 3).transpose(1, 0, 2)
    spread, noise = (
        np.array([(line.spread, line.bend / line.radius + JUNCTION.line_noise) for line in known]).reshape(-1, 2).T
    )
    across = np.eye(3) - direction[:, :, None] * direction[:, None]
    for _ in range(JUNCTION.rounds):
        matrix, right = np.diag([CURVE.stay] * 3 + [JUNCTION.radius_hold]), np.zeros(4)
        right[:3] = CURVE.stay * (near - place)
        right[3] = JUNCTION.radius_hold * touching
        offset = middle - place
        ahead = dot(offset, direction)
        aside, error = offset - ahead[:, None] * direction, noise * (1 + (ahead / spread) ** 2)
        weight = 1 / ((1 + error**2) * (1 + dot(aside, aside) / radius**2))
        matrix[:3, :3] += (weight[:, None, None] * across).sum(axis=0)
        right[:3] += weight @ aside
        if len(points):
            offset = points - place
            window, height = np.exp(-dot(offset, offset) / (2 * radius**2)), dot(offset, normals)
            high = np.abs(height)
            fits = window / (1 + ((high - touching) / (CURVE.touching * radius)) ** 2)
            fits *= JUNCTION.surface / max(window.sum(), JUNCTION.surface * TINY)  # nothing near, no say
            # of n with the sign of its height, and 1
            matrix[:3, :3] += (fits[:, None] * normals).T @ normals
            matrix[3, :3] = matrix[:3, 3] = np.copysign(fits, height) @ normals
            matrix[3, 3] += fits.sum()
            right += [*((fits * height) @ normals), fits @ high]
        *step, touching = np.linalg.solve(matrix, right)
        touching = min(max(touching, 0.0), 2 * radius)
        place = place + step
    return place, touching
