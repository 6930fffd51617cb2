"""Fewer vertices, and smoother curves; ends, junctions and the topology stay."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np

from ..errors import InvalidParameterError
from ..numerics.polylines import arc_lengths
from ..numerics.vectors import TINY, norm
from ..refinement.merging import merge_into
from ..skeleton import Skeleton
from .graphs import check_number

SHRINK, SWELL = 0.5, -0.53  # published: factors of a pass there and back, which leave long waves as they are


def simplify(skeleton: Skeleton, *, tolerance: float | None = None, n: int | None = None) -> Skeleton:
    """Drop vertices where the curve is straight, branch by branch (Douglas and Peucker 1973).

    Parameters
    ----------
    skeleton : Skeleton
    tolerance : float, optional
        How far a dropped vertex may be from the simpler curve, in the cloud's units.
    n : int, optional
        How many vertices to keep, those first that matter most; one of the two is given. Ends, junctions, and what it
        takes to keep every loop always stay.

    Returns
    -------
    Skeleton
        Points of a dropped vertex belong to the nearest one left along the branch.

    Raises
    ------
    InvalidParameterError
        None of the two is given, or both, or one is out of its range.

    Examples
    --------
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import torus
    >>> ring = skeletonize(torus(2000).points)
    >>> simplify(ring, n=12)
    Skeleton(12 vertices, 12 edges, 1 components, 1 loops, 0 leaves, 0 junctions)
    """
    if (tolerance is None) == (n is None):
        raise InvalidParameterError("simplify needs either a tolerance or n")
    check_number("tolerance", tolerance, "float?")
    check_number("n", n, "int?", low=1)
    matters = np.full(len(skeleton.vertices), np.inf)
    twins = Counter(tuple(sorted((path[0], path[-1]))) for path in skeleton.branches)
    for path in skeleton.branches:
        here = _significance(skeleton.vertices[path])
        if path[0] == path[-1]:  # a ring is at least a triangle
            here[np.argsort(here[1:-1])[-2:] + 1] = np.inf
        elif twins[tuple(sorted((path[0], path[-1])))] > 1 and len(path) > 2:
            here[np.argmax(here[1:-1]) + 1] = np.inf
        matters[path[1:-1]] = here[1:-1]
    if n is None:
        stays = matters > tolerance
    else:
        stays = np.zeros(len(matters), bool)
        stays[np.argsort(-matters, kind="stable")[: max(n, np.isinf(matters).sum())]] = True
    group = np.arange(len(matters))
    for path in skeleton.branches:
        along, kept = arc_lengths(skeleton.vertices[path]), np.flatnonzero(stays[path])
        if len(kept):  # of a ring without a junction the first vertex may go, and is the last one too
            nearest = np.abs(along[:, None] - along[kept]).argmin(axis=1)
            group[path[1:-1]] = path[kept[nearest[1:-1]]]
    return merge_into(skeleton, group)


def _significance(curve: np.ndarray) -> np.ndarray:
    """Largest tolerance at which every place of a curve stays, infinite at its ends, (p,) float array."""
    found = np.full(len(curve), np.inf)
    parts = [(0, len(curve) - 1)]
    while parts:
        first, last = parts.pop()
        if last - first < 2:
            continue
        offset, chord = curve[first + 1 : last] - curve[first], curve[last] - curve[first]
        along = np.clip(offset @ chord / max(chord @ chord, TINY), 0, 1)
        away = norm(offset - along[:, None] * chord)
        farthest = first + 1 + int(away.argmax())
        # no more than that of the ends of its part, without which it would not be asked
        found[farthest] = min(float(away.max()), found[first], found[last])
        parts += [(first, farthest), (farthest, last)]
    return found


def smooth(skeleton: Skeleton, *, passes: int = 10) -> Skeleton:
    """Smooth the curves without shrinking them (Taubin 1995, "A signal processing approach to fair surface design").

    Parameters
    ----------
    skeleton : Skeleton
    passes : int
        There and back; more make longer waves disappear. Ends and junctions stay where they are.

    Returns
    -------
    Skeleton

    Examples
    --------
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import torus
    >>> ring = skeletonize(torus(2000, noise=0.01).points)
    >>> abs(smooth(ring).length / ring.length - 1) < 0.02
    True
    """
    check_number("passes", passes, "int")
    inner = np.flatnonzero(skeleton.degree == 2)
    ends = np.concatenate([skeleton.edges, skeleton.edges[:, ::-1]])
    ends = ends[np.argsort(ends[:, 0], kind="stable")]
    beside = ends[skeleton.degree[ends[:, 0]] == 2, 1].reshape(-1, 2)  # in the order of `inner`
    vertices = skeleton.vertices.copy()
    for factor in (SHRINK, SWELL) * passes:
        vertices[inner] += factor * (vertices[beside].mean(axis=1) - vertices[inner])
    return replace(skeleton, vertices=vertices)
