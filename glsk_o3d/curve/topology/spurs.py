"""Tell limbs from branches that hardly leave the parts they grow from, and cut these."""

from collections.abc import Iterator
from functools import partial
from typing import NamedTuple

import numpy as np

from ...data.decisions import QUESTIONS, Decision
from ..curve import Curve
from ...geometry.groups import quantile
from ...geometry.neighbourhoods import plane_axes
from ...geometry.polylines import arc_lengths, place_at, relative_distance
from ...geometry.vectors import TINY, cross, norm, unit
from ..axis.sections import VertexPoints, measure_sections
from .collapse import merge_into, with_fields
from .evidence import Evidence, ask_once
from .limbs import Limbs

SPUR_POINTS = 128  # speed: of a branch that are enough to say how far it reaches
SPUR_QUANTILE = 0.9  # fitted: share of a spur's points that its reach covers
LEAST_OUT = 0.3  # fitted: half widths below which a protrusion says no more
LONG_OUTSIDE = 4.0  # derived: half widths of a part that is twice as long as it is wide
NOT_BESIDE = 2.0  # fitted: half widths from a curve to where nothing is beside it, nor the cap of its end
SLENDEREST, STOUTEST = 0.2, 2.0  # derived: of radii, beyond which a branch is no more or less of a limb
OUTER_PLACES = np.linspace(1 / 3, 1, 5)  # measured: of the length; each but the first and last is asked
ACROSS = 16  # precision: directions across a branch; eight are enough for flat parts


def prune_spurs(curve: Curve, evidence: Evidence, least: float) -> tuple[Curve, list[Decision]]:
    """Cut branches whose points hardly stand out of the surface around the limbs that meet there.

    The points count, not the curve, since contraction shortens stubs as thick as they are long, and lets thin ones
    grow; and how far they leave the limbs that meet them, since along a part they may be anywhere. The limbs go on,
    straight, to where they meet: contraction draws them together in a sharp corner, and a spur into its tip is left.
    Another branch with an end may be a spur, too: it counts as no thicker than the junction.

    Of every junction the least probable limb goes first, until none is less probable than `least`; its points belong to
    the junction and have no normals any more. There is one decision for each branch that leaves a junction and has an
    end, cut or left; at its end.
    """
    decisions: list[Decision] = []
    given, known = curve, dict[bytes, dict[str, float]]()
    while True:
        found = _twigs(curve, evidence, known)
        worst: dict[int, _Twig] = {}
        for twig in found:
            before = worst.get(twig.junction)
            if twig.probability < (before.probability if before else least):
                worst[twig.junction] = twig
        if not worst:
            curve = curve.vertices, curve.radii
            decisions += [limb_decision(*curve, twig.probability, [twig.tip], pruned=False) for twig in found]
            return curve.changed(normals=given.normals), decisions
        group = np.arange(len(curve.vertices))
        for twig in worst.values():
            group[twig.body] = twig.junction
            path = [twig.junction, *twig.body.tolist()]
            decisions.append(limb_decision(curve.vertices, curve.radii, twig.probability, path, pruned=True))
        # points of a cut branch are farther from its junction than the surface there is: they have no say any more
        gone = np.isin(curve.vertex_of_point, np.concatenate([twig.body for twig in worst.values()]))
        normals = np.where(gone[:, None], np.nan, curve.normals)
        curve = merge_into(curve.changed(normals=normals), group)


def limb_decision(
    vertices: np.ndarray, radii: np.ndarray, probability: float, path: list[int], *, pruned: bool
) -> Decision:
    """The decision about a branch, a path of vertices from its junction to its tip; of a pruned one with its curve."""
    places = tuple(tuple(place) for place in vertices[path].tolist())
    curve = (places, tuple(radii[path].tolist())) if pruned else ()
    return Decision("limb", places[-1], probability, pruned, *curve)


def limb_facts(curve: Curve, evidence: Evidence) -> Iterator[tuple[int, dict[str, float]]]:
    """What speaks for every branch that leaves a junction and has an end: its leaf, and facts.

    The facts are: how far its points (all but a tenth, and of a long limb those outside of its body) stand out of the
    surface around the other limbs, over its own half width, as a logarithm, of which, if positive, the share is left
    out that has the object beside it; how certain it is, minus the logarithm of what its mean confidence lacks of 1;
    and how slender, minus the logarithm of its radius over the distance of the surface from the junction.
    """
    return ((twig.tip, twig.facts) for twig in _twigs(curve, evidence, {}))


class _Twig(NamedTuple):
    """A branch that leaves a junction and has an end."""

    junction: int
    body: np.ndarray  # its other vertices
    tip: int
    facts: dict[str, float]

    @property
    def probability(self) -> float:
        return QUESTIONS["limb"].probability(self.facts)


def _twigs(curve: Curve, evidence: Evidence, known: dict[bytes, dict[str, float]]) -> list[_Twig]:
    """Branches that leave a junction and have an end, with their facts, which are asked for where they are not known.

    What is known is that of the same limbs, from before other branches were cut.
    """
    limbs, degree = Limbs(curve), curve.degree
    paths = enumerate(branch[::-1] if degree[branch[0]] == 1 else branch for branch in limbs.branches)
    found = [(k, path) for k, path in paths if degree[path[0]] > 2 and degree[path[-1]] == 1]
    names = [limbs.signature(int(path[0])) + curve.vertices[path].tobytes() for _, path in found]
    facts = ask_once(known, names, found, partial(_facts, curve, evidence, limbs))
    return [_Twig(int(path[0]), path[1:], int(path[-1]), each) for (_, path), each in zip(found, facts, strict=True)]


def _facts(
    curve: Curve, evidence: Evidence, limbs: Limbs, found: list[tuple[int, np.ndarray]]
) -> Iterator[dict[str, float]]:
    """What speaks for some branches, given by their numbers and as paths from their junctions."""
    degree, cloud, sections = curve.degree, curve.cloud, curve.sections
    count, wide = cloud.mass, sections.half_width
    radius, confidence = sections.radius, np.nan_to_num(curve.confidence)
    ending = np.zeros(len(degree), bool)
    for branch in limbs.branches:
        if 1 in degree[branch[[0, -1]]]:
            ending[branch] = degree[branch] < 3
    surface = cloud.distance
    outside = [_outside(curve.vertices, path, surface[path[0]], wide) for _, path in found]
    half = np.array([np.average(wide[part], weights=count[part]) for part in outside])
    beside = _beside(evidence, curve.vertices, sections.across, [path for _, path in found], half)
    for (k, path), part, own_half, shared in zip(found, outside, half, beside, strict=True):
        junction, body = int(path[0]), path[1:]
        own = cloud.points[cloud.members.of(part)]
        # by how far they are, and not as they come, which depends on how the object is turned
        points = own[np.argsort(norm(own - curve.vertices[junction]))][:: len(own) // SPUR_POINTS + 1]
        out = max(_standing_out(limbs, k, junction, points, ending), 0.0) if own_half > 0 else 0.0
        thickness = np.average(radius[part], weights=count[part]) / max(surface[junction], TINY)
        ratio = np.clip(thickness, SLENDEREST, STOUTEST)
        protrusion = float(np.log(out / max(own_half, TINY) + LEAST_OUT))
        yield dict(
            protrusion=protrusion - float(shared) * max(protrusion, 0),
            certainty=-float(np.log1p(-np.average(confidence[body], weights=count[body]))),
            slenderness=-float(np.log(ratio)),
        )


def _outside(vertices: np.ndarray, path: np.ndarray, surface: float, wide: np.ndarray) -> np.ndarray:
    """The part of a branch that is farther from its junction than the surface there, if it is long; else all of it.

    The curve of a spout or a leg begins at the axis of the body, and up to its surface the points are the body's.
    """
    body = path[1:]
    away = norm(vertices[body] - vertices[path[0]])
    part = body[np.flatnonzero(away <= surface).max(initial=-1) + 1 :]
    return part if len(part) and away[-1] - surface > LONG_OUTSIDE * quantile(wide[part]) else body


def _beside(
    evidence: Evidence, vertices: np.ndarray, width: np.ndarray, paths: list[np.ndarray], half: np.ndarray
) -> np.ndarray:
    """How much of the object is beside the outer half of each branch, (b,): of a limb 0, of a strand in a flat part 1.

    At a place of the curve it is the largest winding number, from 0 to 1, at two half widths across the branch; of
    three places the mean counts. `paths` are branches, as numbers of `vertices` (m, 3), whose sections are widest in
    the directions `width` (m, 3); and `half` (b,) the half widths.
    """
    found, near = [], []
    for path in paths:
        along = arc_lengths(vertices[path])
        asked = along[-1] * OUTER_PLACES
        found.append(place_at(vertices[path], along, asked))
        near.append(path[np.searchsorted(along, asked[1:-1])])
    places = np.array(found)
    # the first direction is the section's, so that the others turn with the object
    tangent = unit((places[:, 2:] - places[:, :-2]).reshape(-1, 3))
    second = cross(tangent, width[np.concatenate(near)])
    # the width of a vertex without points is any direction, also along the branch
    second = unit(np.where(norm(second)[:, None] > 1e-6, second, plane_axes(tangent)[:, :, 0]))
    turn = np.linspace(0, 2 * np.pi, ACROSS, endpoint=False)[:, None, None]
    across = np.cos(turn) * cross(second, tangent) + np.sin(turn) * second
    away = NOT_BESIDE * half[:, None, None] * across.reshape(ACROSS, len(paths), -1, 3)
    beside = places[:, 1:-1] + away
    winding = evidence.winding(beside.reshape(-1, 3)).reshape(beside.shape[:-1])
    inside: np.ndarray = np.clip(winding.max(axis=0), 0, 1).mean(axis=1)
    return inside


def _standing_out(limbs: Limbs, k: int, junction: int, points: np.ndarray, ending: np.ndarray) -> float:
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
    ratio, there = relative_distance(points, vertices, np.r_[surface, radius, radius], paths)
    return quantile((ratio - 1) * there, SPUR_QUANTILE)
