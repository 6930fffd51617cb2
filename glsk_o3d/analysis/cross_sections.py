"""Cross-sections of a cloud along a skeleton."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..numerics.groups import group_median, group_sum
from ..numerics.neighbourhoods import plane_axes
from ..numerics.polylines import arc_lengths, place_at

# All fitted; what an arc has is derived.
POINTS_PER_SECTION, MOST_SECTIONS = 24, 1000  # points on average, and sections of a skeleton at most
# times the median distance of a section's points: those farther belong to no tube around the curve
FAR_FROM_SECTION = 3.0
# least variance of an outline across itself over that along it: arcs below about 130 degrees have less
MIN_ARC_VARIANCE = 0.1


@dataclass(frozen=True, eq=False)
class Sections:
    """What the cloud looks like around S pieces of a skeleton, all of about one length: arrays with a row for each."""

    places: np.ndarray  # (S, 3): the middles of the pieces
    lengths: np.ndarray
    counts: np.ndarray  # of points; where there are few, the other values mean little
    offsets: np.ndarray  # from the place to the centre of the section
    radii: np.ndarray  # root mean square distance from the points to the centre: the radius of a round tube
    open_angles: np.ndarray  # radians in which the place sees no points: the sum of the gaps of more than a right angle


def cross_sections(vertices, branches, points, shortest=0.0) -> Sections:
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
    count = np.bincount(section, minlength=n)
    total = np.maximum(count, 1)
    mean = group_sum(q, section, n) / total[:, None]
    u = q - mean[section]
    spread = group_sum(u[:, :, None] * u[:, None, :], section, n)
    skew = group_sum((u**2).sum(axis=1, keepdims=True) * u, section, n)
    # the pseudo-inverse leaves the centre where the mean is in directions in which the outline is flat
    centre = mean + np.einsum("sij,sj->si", np.linalg.pinv(spread, rcond=MIN_ARC_VARIANCE, hermitian=True), skew) / 2
    squared = group_sum(((q - centre[section]) ** 2).sum(axis=1), section, n) / total
    return Sections(places, lengths, count, np.linalg.norm(centre, axis=1), np.sqrt(squared), _open(q, section, n))


def _cut(vertices, branches, n_points, shortest):
    """Places, unit tangents and lengths of the pieces that the branches are cut into."""
    along = [arc_lengths(vertices[path]) for path in branches]
    total = sum(travelled[-1] for travelled in along)
    step = max(total / np.clip(n_points // POINTS_PER_SECTION, 1, MOST_SECTIONS), shortest)
    cuts, middles, lengths = [], [], []
    for path, travelled in zip(branches, along, strict=True):
        if travelled[-1] == 0:
            continue
        pieces = max(1, round(travelled[-1] / step))
        at = np.linspace(0, travelled[-1], 2 * pieces + 1)
        curve = place_at(vertices[path], travelled, at)
        middles.append(curve[1::2])
        cuts.append(curve[2::2] - curve[:-1:2])
        lengths.append(np.full(pieces, travelled[-1] / pieces))
    chord = np.concatenate(cuts)
    size = np.linalg.norm(chord, axis=1, keepdims=True)
    # a piece that comes back to where it began, such as a whole small loop, has no direction of its own
    tangent = np.where(size > 0, chord / np.where(size > 0, size, 1), [0.0, 0.0, 1.0])
    return np.concatenate(middles), tangent, np.concatenate(lengths)


def _open(q, section, n):
    """Sum of the gaps wider than a right angle between the directions to the points of each group."""
    angle = np.arctan2(q[:, 1], q[:, 0])
    order = np.lexsort((angle, section))
    angle, section = angle[order], section[order]
    last = np.r_[section[1:] != section[:-1], True][: len(section)]
    first = np.flatnonzero(np.r_[True, last[:-1]][: len(section)])
    gap = np.roll(angle, -1) - angle
    gap[last] = angle[first] + 2 * np.pi - angle[last]
    return np.bincount(section, np.where(gap > np.pi / 2, gap, 0), n)
