"""How well a skeleton fits its cloud, without a known axis."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from ..data.points import surface_points
from ..data.skeleton import Skeleton
from ..errors import InvalidCloudError, InvalidParameterError
from ..geometry.cycles import inscribed_circle, minimum_cycle_basis
from ..geometry.frame import check_extent
from ..geometry.groups import component_labels, group_median, group_sum
from ..geometry.neighbourhoods import nearest_neighbours, plane_axes
from ..geometry.polylines import arc_lengths, place_at
from ..geometry.vectors import Floats, Ints

CLUSTER_NEIGHBOURS = 16  # fitted: of each point, in the graph whose components are the clusters of a cloud
MIN_SECTION_POINTS = 6  # fitted: below which a place counts as outside
# fitted: without points in so wide an angle a place is outside; a scan from one side leaves a little over pi open
OPEN_ANGLE = 4 * np.pi / 3
POINTS_PER_SECTION, MOST_SECTIONS = 24, 1000  # fitted: points on average, and sections of a skeleton at most
# fitted: times the median distance of a section's points; those farther away belong to no tube around the curve
FAR_FROM_SECTION = 3.0
# derived: least variance of an outline across itself over that along it: arcs below about 130 degrees have less
MIN_ARC_VARIANCE = 0.1


@dataclass(frozen=True)
class Assessment:
    """How well a skeleton fits its cloud: three measures without units, from 0 to 1. 1 is best.

    They need no truth, so they miss some errors: parts of the cloud without a branch, and missing loops, cost little
    or nothing. Noise and one-sided scans cost something even on the true axis. So compare skeletons of one cloud.
    The properties are those of Wen et al. 2025, arXiv 2504.00032; the formulas, which are ours, and what they give
    on closed forms: docs/evaluation.md.

    Attributes
    ----------
    centredness : float
        Mean over the length of max(0, 1 - d / r), with d from the curve to the centre of its cross-section and r that
        section's radius.
    boundedness : float
        Share of the length from which the cross-section is seen in more than a third of all directions.
    topology : float
        min(components, clusters) / max(components, clusters), times the share of the loops that open wider than their
        tube; 1 without loops, and on a medial axis, ``report.on_medial_axis``, whose loops are those of the solid.
    components, clusters : int
        Connected parts of the skeleton, and of the cloud when every point is joined to its 15 nearest.
    loops, wide_loops : int
        Loops of a minimum cycle basis of the skeleton; those that open wider than their tube: the largest circle inside
        has a larger radius than the median of the nearest cross-sections. Around a narrow hole it may be smaller.
    """

    centredness: float
    boundedness: float
    topology: float
    components: int
    clusters: int
    loops: int
    wide_loops: int


def assess(skeleton: Skeleton, points: Any) -> Assessment:
    """Measure how well a skeleton fits its cloud, without a known axis.

    Parameters
    ----------
    skeleton : Skeleton
        Only `vertices`, `edges` and ``report.on_medial_axis`` count.
    points : cloud
        Anything with points, in the units of the skeleton. Points that are not finite are ignored.

    Returns
    -------
    Assessment

    Raises
    ------
    InvalidParameterError
        The skeleton has no edge with a length.
    InvalidCloudError
        `points` is no cloud, or no part of the skeleton has six points around it.

    Examples
    --------
    >>> from glsk_o3d import Skeleton
    >>> from glsk_o3d.samples import tube
    >>> straight = tube(2000)
    >>> axis = Skeleton(straight.nodes, straight.edges, straight.radii, (), (), ())
    >>> assessment = assess(axis, straight.points)
    >>> assessment.boundedness, assessment.topology
    (1.0, 1.0)
    """
    cloud = surface_points(points)
    cloud = np.unique(cloud[np.isfinite(cloud).all(axis=1)], axis=0)
    if not skeleton.length > 0:
        raise InvalidParameterError("the skeleton has no edge with a length: there is no curve to assess")
    if len(cloud) > 1:
        check_extent(cloud)
    check_extent(np.concatenate([cloud, skeleton.vertices]))  # also of a single point far from the skeleton
    reach, clusters = _neighbourhood(cloud)
    sections = cross_sections(skeleton.vertices, skeleton.branches, cloud, shortest=reach)
    occupied = sections.counts >= MIN_SECTION_POINTS
    if not occupied.any():
        raise InvalidCloudError(
            f"no part of the skeleton has {MIN_SECTION_POINTS} points around it: is this the cloud it was made from?"
        )
    # places in the largest ball around a junction that holds no point do not count
    junctions = skeleton.vertices[skeleton.junctions]
    beyond_junctions = (cdist(sections.places, junctions) >= cKDTree(cloud).query(junctions)[0]).all(axis=1)
    counted = beyond_junctions if (beyond_junctions & occupied).any() else np.ones_like(occupied)
    occupied &= counted
    offsets, radii = sections.offsets[occupied], sections.radii[occupied]
    centred = 1 - np.divide(offsets, radii, out=np.sign(offsets), where=offsets < radii)
    bounded = occupied & (sections.open_angles < OPEN_ANGLE)
    radius = radii[cKDTree(sections.places[occupied]).query(skeleton.vertices)[1]]
    cycles = minimum_cycle_basis(len(skeleton.vertices), skeleton.edges, skeleton.edge_lengths)
    wide = sum(inscribed_circle(skeleton.vertices[cycle])[1] > np.median(radius[cycle]) for cycle in cycles)
    sound = wide / len(cycles) if cycles and not skeleton.report.on_medial_axis else 1
    components = skeleton.n_components
    agreement = min(components, clusters) / max(components, clusters)
    return Assessment(
        centredness=float(np.average(centred, weights=sections.lengths[occupied])),
        boundedness=float(np.average(bounded[counted], weights=sections.lengths[counted])),
        topology=float(agreement * sound),
        components=components,
        clusters=clusters,
        loops=len(cycles),
        wide_loops=int(wide),
    )


def _neighbourhood(cloud: np.ndarray) -> tuple[float, int]:
    """Median distance to the last of the neighbours, and the connected components of the neighbour graph."""
    k = min(CLUSTER_NEIGHBOURS, len(cloud))
    if k < 2:
        return 0.0, len(cloud)
    distance, neighbour = nearest_neighbours(cloud, k)
    pairs = np.column_stack([np.repeat(np.arange(len(cloud)), k), neighbour.ravel()])
    return float(np.median(distance[:, -1])), int(component_labels(len(cloud), pairs).max()) + 1


class Sections(NamedTuple):
    """Sections of a cloud around S pieces of a skeleton, all of about one length: arrays with a row for each."""

    places: np.ndarray  # (S, 3): the middles of the pieces
    lengths: np.ndarray
    counts: np.ndarray  # of points; with few of them the other values mean little
    offsets: np.ndarray  # from the place to the centre of the section
    radii: np.ndarray  # root mean square distance from the points to the centre: the radius of a round tube
    open_angles: np.ndarray  # radians without points as seen from the place: sum of gaps of more than a right angle


def cross_sections(vertices: Floats, branches: Sequence[Ints], points: Floats, shortest: float = 0.0) -> Sections:
    """Cut a cloud into sections along a curve.

    Every point goes to the nearest place on the curve and is projected into the plane across the curve there; points
    more than three times as far away as the median one are left out. So parts of the object that cross the plane
    elsewhere do not count if the skeleton has branches in them.

    The centre of a section is that of the circle with least sum of (|q - c|^2 - r^2)^2 (Kasa 1976), which is exact on
    a round tube however unevenly its outline is covered. In directions in which the outline is flat, or seen from
    below a third of its circumference, it is the mean of the points.

    There is about one section per 24 points or fewer, at most about 1000, at least one per branch that has a length;
    one branch must have a length. Pieces are no shorter than `shortest`, unless the branch is.
    """
    places, tangents, lengths = _cut(vertices, branches, len(points), shortest)
    n = len(places)
    distance, section = cKDTree(places).query(points)
    kept = distance <= FAR_FROM_SECTION * group_median(distance, section, n)[section]
    section = section[kept]
    q = np.einsum("nij,ni->nj", plane_axes(tangents)[section], points[kept] - places[section])
    size = 2.0 ** np.frexp(np.abs(q).max(initial=0))[1]  # so that no power of a length overflows
    q, count = q / size, np.bincount(section, minlength=n)
    total = np.maximum(count, 1)
    mean = group_sum(q, section, n) / total[:, None]
    u = q - mean[section]
    spread = group_sum(u[:, :, None] * u[:, None, :], section, n)
    skew = group_sum((u**2).sum(axis=1, keepdims=True) * u, section, n)
    # the pseudo-inverse leaves the centre where the mean is in directions in which the outline is flat
    centre = mean + np.einsum("sij,sj->si", np.linalg.pinv(spread, rcond=MIN_ARC_VARIANCE, hermitian=True), skew) / 2
    squared = group_sum(((q - centre[section]) ** 2).sum(axis=1), section, n) / total
    offsets, radii = size * np.linalg.norm(centre, axis=1), size * np.sqrt(squared)
    return Sections(places, lengths, count, offsets, radii, _open_angles(q, section, n))


def _cut(vertices: Floats, branches: Sequence[Ints], n_points: int, shortest: float) -> tuple[Floats, Floats, Floats]:
    """Places, unit tangents and lengths of the pieces that the branches are cut into."""
    along = [arc_lengths(vertices[path]) for path in branches]
    total = sum(arc_length[-1] for arc_length in along)
    step = max(total / np.clip(n_points // POINTS_PER_SECTION, 1, MOST_SECTIONS), shortest)
    cuts, middles, lengths = [], [], []
    for path, arc_length in zip(branches, along, strict=True):
        if arc_length[-1] == 0:
            continue
        pieces = max(1, round(arc_length[-1] / step))
        curve = place_at(vertices[path], arc_length, np.linspace(0, arc_length[-1], 2 * pieces + 1))
        middles.append(curve[1::2])
        cuts.append(curve[2::2] - curve[:-1:2])
        lengths.append(np.full(pieces, arc_length[-1] / pieces))
    chord = np.concatenate(cuts)
    size = np.linalg.norm(chord, axis=1, keepdims=True)
    # a closed piece, such as a whole small loop, has no direction of its own
    tangent = np.where(size > 0, chord / np.where(size > 0, size, 1), [0.0, 0.0, 1.0])
    return np.concatenate(middles), tangent, np.concatenate(lengths)


def _open_angles(q: np.ndarray, section: np.ndarray, n: int) -> np.ndarray:
    """Sum of the gaps wider than a right angle between the directions to the points of each group."""
    angle = np.arctan2(q[:, 1], q[:, 0])
    order = np.lexsort((angle, section))
    angle, section = angle[order], section[order]
    last = np.r_[section[1:] != section[:-1], True][: len(section)]
    first = np.flatnonzero(np.r_[True, last[:-1]][: len(section)])
    gap = np.roll(angle, -1) - angle
    gap[last] = angle[first] + 2 * np.pi - angle[last]
    return np.bincount(section, np.where(gap > np.pi / 2, gap, 0), n)
