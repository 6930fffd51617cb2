"""Spurs: which branches are limbs, and which hardly leave the part that they grow from?"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import ClassVar

import numpy as np

from ...data.decisions import logistic
from ...geometry.groups import quantile
from ...geometry.neighbourhoods import plane_axes
from ...geometry.numbers import derived, fitted, precision, speed
from ...geometry.polylines import arc_lengths, place_at, relative_distance
from ...geometry.vectors import TINY, Ints, cross, norm, unit
from ..curve import Curve
from ..limbs import JunctionLimbs
from ..merging import merge_into
from ..numbers import CURVE
from ..surface import Evidence, Memo, Surface
from .question import Candidate, Question


@dataclass(frozen=True)
class LimbNumbers:
    """Numbers of `Limbs`."""

    points: int = speed(128, "points of a branch that are enough to say how far it reaches")
    quantile: float = fitted(0.9, "share of a spur's points that its reach covers")
    least_out: float = fitted(0.3, "half widths below which a protrusion says no more")
    long: float = derived(4.0, "half widths of a part that is twice as long as it is wide")
    sure_sine: float = precision(1e-6, "sine of the angle between branch and width, below which the width is chance")
    directions: int = precision(16, "directions across a branch; eight are enough for flat parts")


LIMB = LimbNumbers()

OUTER_PLACES = np.linspace(1 / 3, 1, 5)  # measured: of the length; each but the first and last is asked


class Limbs(Question):
    """Which branches that leave a junction and end are limbs? Others, spurs, are cut.

    The points count, not the curve, since contraction shortens stubs as thick as they are long, and lets thin ones
    grow; and how far they leave the limbs that meet them, since along a part they may be anywhere. The limbs go on,
    straight, to where they meet: contraction draws them together in a sharp corner, and a spur into its tip remains.
    Another branch with an end may be a spur, too: it counts as no thicker than the junction.

    Of every junction the least probable limb goes first; its points belong to the junction, and say nothing any more.
    There is one decision for each branch, cut or not; at its end.
    """

    about, repeats = "limb", True
    weights: ClassVar[Mapping[str, float]] = dict(  # fitted
        constant=-4.9, protrusion=3.9, certainty=2.5, crease=5.1
    )

    def __init__(self) -> None:
        self._known = Memo[dict[str, float]]()
        self._mute = np.array(False)  # points that say nothing any more, of all

    def candidates(self, evidence: Evidence, least: float) -> list[Candidate]:
        """One for each branch that leaves a junction and ends; its facts are known from before others were cut.

        The facts are: how far its points (all but a tenth, and of a long limb those outside of its body) stand out of
        the surface around the other limbs, over its own half width, as a logarithm, of which, if positive, the share is
        left out that has the object beside it; how certain it is, minus the logarithm of what its mean confidence lacks
        of 1; and how much of a crease the surface has where it leaves the others, see `_creases`.
        """
        curve = evidence.curve
        if self._mute.any():
            curve = curve.changed(normals=np.where(self._mute[:, None], np.nan, curve.normals))
        limbs, degree = JunctionLimbs(curve), curve.degree
        paths = enumerate(branch[::-1] if degree[branch[0]] == 1 else branch for branch in limbs.branches)
        asked = [(k, path) for k, path in paths if degree[path[0]] > 2 and degree[path[-1]] == 1]
        keys = [limbs.signature(int(path[0])) + curve.vertices[path].tobytes() for _, path in asked]
        facts = self._known.of(keys, asked, partial(_facts, curve, evidence.surface, limbs))
        probabilities = [logistic(self.weights, values) for values in facts]
        worst: dict[int, int] = {}
        for i, (_, path) in enumerate(asked):
            junction = int(path[0])
            if probabilities[i] < (probabilities[worst[junction]] if junction in worst else least):
                worst[junction] = i
        spurs = [*worst.values()]
        return [
            limb_candidate(curve.vertices, curve.radii, asked[i][1], facts[i], probabilities[i], i in spurs)
            for i in [*spurs, *(i for i in range(len(asked)) if i not in spurs)]
        ]

    def change(self, evidence: Evidence, chosen: Sequence[Candidate]) -> Curve:
        """Merge spurs into the junctions that they leave: their points are farther from there than the surface is."""
        curve, group = evidence.curve, np.arange(len(evidence.curve.vertices))
        for path in (candidate.part for candidate in chosen):
            group[path[1:]] = path[0]
        self._mute = self._mute | np.isin(curve.vertex_of_point, np.flatnonzero(group != np.arange(len(group))))
        return merge_into(curve, group)


def limb_candidate(
    vertices: np.ndarray, radii: np.ndarray, path: Ints, facts: Mapping[str, float], probability: float, pruned: bool
) -> Candidate:
    """A branch, a path of vertices from its junction to its tip; a pruned one with its curve."""
    branch = ((vertices[path], radii[path]),) if pruned else ()
    return Candidate(path, vertices[path[-1]], facts, probability, pruned, *branch)


def _facts(
    curve: Curve, surface: Surface, limbs: JunctionLimbs, asked: list[tuple[int, np.ndarray]]
) -> Iterator[dict[str, float]]:
    """What speaks for some branches, given by their numbers and as paths from their junctions."""
    degree, cloud, sections = curve.degree, curve.cloud, curve.sections
    count, wide, confidence = cloud.mass, sections.half_width, np.nan_to_num(curve.confidence)
    ending = np.zeros(len(degree), bool)
    for branch in limbs.branches:
        if 1 in degree[branch[[0, -1]]]:
            ending[branch] = degree[branch] < 3
    distance = cloud.distance
    outside = [_outside(curve.vertices, path, distance[path[0]], wide) for _, path in asked]
    half = np.array([np.average(wide[part], weights=count[part]) for part in outside])
    beside = _beside(surface, curve.vertices, sections.across, [path for _, path in asked], half)
    creases = _creases(curve, surface, [path for _, path in asked], half)
    for (k, path), part, own_half, shared, crease in zip(asked, outside, half, beside, creases, strict=True):
        junction, body = int(path[0]), path[1:]
        own = cloud.points[cloud.members.of(part)]
        # by how far they are, and not as they come, which depends on how the object is turned
        points = own[np.argsort(norm(own - curve.vertices[junction]))][:: len(own) // LIMB.points + 1]
        out = max(_standing_out(limbs, k, junction, points, ending), 0.0) if own_half > 0 else 0.0
        protrusion = float(np.log(out / max(own_half, TINY) + LIMB.least_out))
        yield dict(
            protrusion=protrusion - float(shared) * max(protrusion, 0),
            certainty=-float(np.log1p(-np.average(confidence[body], weights=count[body]))),
            crease=crease,
        )


def _outside(vertices: np.ndarray, path: np.ndarray, surface: float, wide: np.ndarray) -> np.ndarray:
    """The part of a branch that is farther from its junction than the surface there, if it is long; else all of it.

    The curve of a spout or a leg begins at the axis of the body, and up to its surface the points are the body's.
    """
    body = path[1:]
    away = norm(vertices[body] - vertices[path[0]])
    part = body[np.flatnonzero(away <= surface).max(initial=-1) + 1 :]
    return part if len(part) and away[-1] - surface > LIMB.long * quantile(wide[part]) else body


def _creases(curve: Curve, surface: Surface, paths: list[np.ndarray], half: np.ndarray) -> list[float]:
    """The concave share of all turns of the surface along some branches, up to their caps: 0 of a corner of a box.

    A limb leaves a body in a crease, which a spur into an edge or a corner lacks. Every link of a point to one near it
    turns by the difference of their normals along it, and counts by how far it leads along the branch, cos^2. The cap
    is as long as the half width `half` (b,) of the branch.
    """
    vertex, tangent = curve.vertex_of_point[surface.supporting], np.zeros_like(curve.vertices)
    for path in paths:
        tangent[path[1:]] = np.gradient(curve.vertices[path], axis=0)[1:]
    to = surface.neighbours[:, 1:]
    link = unit((surface.points[to] - surface.points[:, None]).reshape(-1, 3)).reshape(*to.shape, 3)
    turn = np.einsum("nkj,nkj->nk", surface.normals[to] - surface.normals[:, None], link)
    turn *= np.einsum("nkj,nj->nk", link, unit(tangent)[vertex]) ** 2
    concave, convex = (np.bincount(vertex, np.maximum(sign * turn, 0).sum(axis=1), len(tangent)) for sign in (-1, 1))
    creases = []
    for path, cap in zip(paths, half, strict=True):
        along = arc_lengths(curve.vertices[path])
        stem = path[1 : max(np.searchsorted(along, along[-1] - cap, "right"), 2)]
        creases.append(float(concave[stem].sum() / max((concave + convex)[stem].sum(), TINY)))
    return creases


def _beside(
    surface: Surface, vertices: np.ndarray, width: np.ndarray, paths: list[np.ndarray], half: np.ndarray
) -> np.ndarray:
    """How much of the object is beside the outer half of each branch, (b,): of a limb 0, of a strand in a flat part 1.

    At a place of the curve it is the largest winding number, from 0 to 1, at two half widths across the branch; of
    three places the mean counts. `paths` are branches, as numbers of `vertices` (m, 3), whose sections are widest in
    the directions `width` (m, 3); and `half` (b,) the half widths.
    """
    along_branches, near = [], []
    for path in paths:
        along = arc_lengths(vertices[path])
        asked = along[-1] * OUTER_PLACES
        along_branches.append(place_at(vertices[path], along, asked))
        near.append(path[np.searchsorted(along, asked[1:-1])])
    places = np.array(along_branches)
    # the first direction is the section's, so that the others turn with the object
    tangent = unit((places[:, 2:] - places[:, :-2]).reshape(-1, 3))
    second = cross(tangent, width[np.concatenate(near)])
    # the width of a vertex without points is any direction, also along the branch
    second = unit(np.where(norm(second)[:, None] > LIMB.sure_sine, second, plane_axes(tangent)[:, :, 0]))
    turn = np.linspace(0, 2 * np.pi, LIMB.directions, endpoint=False)[:, None, None]
    across = np.cos(turn) * cross(second, tangent) + np.sin(turn) * second
    away = CURVE.beside * half[:, None, None] * across.reshape(LIMB.directions, len(paths), -1, 3)
    beside = places[:, 1:-1] + away
    winding = surface.winding(beside.reshape(-1, 3)).reshape(beside.shape[:-1])
    inside: np.ndarray = np.clip(winding.max(axis=0), 0, 1).mean(axis=1)
    return inside


def _standing_out(limbs: JunctionLimbs, k: int, junction: int, points: np.ndarray, ending: np.ndarray) -> float:
    """How far the points of branch k stand out of the surface around the other limbs."""
    if len(points) == 0:
        return 0.0
    around = [i for i in limbs.at[junction] if limbs.branch[i] != k]
    anchor, foot, fits = limbs.meeting(around, limbs.vertices[junction])
    longer = np.flatnonzero(fits)
    radius = limbs.radius[[limbs.branch[around[i]] for i in longer]]
    surface = np.where(ending, np.minimum(limbs.surface, limbs.surface[junction]), limbs.surface)
    vertices = np.concatenate([limbs.vertices, anchor[longer], foot[longer]])
    more = len(limbs.vertices) + np.arange(2 * len(longer)).reshape(2, -1).T
    paths = [*(limbs.paths[i] for i in around), *more]
    ratio, thickness = relative_distance(points, vertices, np.r_[surface, radius, radius], paths)
    return quantile((ratio - 1) * thickness, LIMB.quantile)
