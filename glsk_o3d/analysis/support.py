"""Support by resampling: the share of samples whose skeletons show each branch, loop and end."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from ..api import PipelineChoice, chosen_pipeline
from ..data.decisions import Supported
from ..data.report import warn
from ..data.skeleton import Skeleton, of_input
from ..errors import InvalidCloudError, SkeletonWarning
from ..geometry.cycles import minimum_cycle_basis
from ..geometry.groups import component_labels
from ..geometry.polylines import arc_lengths, place_at
from ..geometry.vectors import TINY, norm
from ..parameters import check_number
from ..pipeline import Pipeline
from .comparison import matched
from .curves import places_along

SAMPLE_SHARE = 0.8  # fitted: of the points in each sample; halves doubt more parts that are right
NEAR = 1.0  # fitted: local radii within which a curve shows a place of another
NEAR_END = 2.0  # fitted: and an end another end
SHOWN_SHARE = 0.9  # fitted: share of the vertices of a branch that must be shown
NEAR_LOOP = 1.5  # fitted: and a loop another loop: all around it
STEP = 0.25  # derived: radii between places of a curve: distances of a radius are exact to a hundredth
MOST_PIECES = 1000  # derived: of an edge, where radii are near nothing
WORTH_A_WARNING = 0.7  # fitted: share of samples with the same graph up to which a skeleton is uncertain

_Missing: TypeAlias = tuple[str, int, np.ndarray, float]
"""A part that a sample shows and the skeleton lacks: its kind, the sample's number, the place, and its reach."""


def support(
    cloud: Any,
    draws: int = 8,
    pipeline: PipelineChoice = "default",
    *,
    seed: int = 0,
    on_draw: Callable[[int, int], object] | None = None,
    **options: Any,
) -> Skeleton:
    """Curve skeleton of a cloud, with the share of its samples whose skeletons show each part.

    Every sample leaves out a random fifth of the points, as in the delete-d jackknife. A part that few samples show
    depends on chance.

    Parameters
    ----------
    cloud, pipeline, **options
        As of `skeletonize`.
    draws : int
        Number of samples, at least 2. A sample takes about as long as the skeleton.
    seed : int
        Of the samples.
    on_draw : callable, optional
        Called with the number of the sample, from 1, and `draws`, before each.

    Returns
    -------
    Skeleton
        That of all points. ``Skeleton.support`` is the share of samples with the curve within a local radius of each
        vertex, or at an end with an end within two. ``Report.support`` has the share for every branch, loop and end,
        and for ends and loops of samples that this skeleton lacks.

    Raises
    ------
    InvalidCloudError, InvalidParameterError, RecipeError
        As of `skeletonize`; or `draws` is no whole number of at least 2.

    Warns
    -----
    SkeletonWarning
        At least three tenths of the samples have skeletons with other numbers of components, loops or ends. It names
        the place.

    References
    ----------
    Felsenstein, Confidence limits on phylogenies, Evolution 1985. Shao and Wu, A general theory for jackknife variance
    estimation, Annals of Statistics 1989.

    Examples
    --------
    >>> from glsk_o3d.samples import torus
    >>> ring = support(torus(1000).points, draws=2)
    >>> [(it.about, it.share) for it in ring.report.support], float(ring.support.min())
    ([('branch', 1.0), ('loop', 1.0)], 1.0)
    """
    check_number("draws", draws, "int", low=2)
    chosen = chosen_pipeline(pipeline, options)
    return with_support(chosen(cloud), chosen, draws, seed=seed, on_draw=on_draw)


def with_support(
    skeleton: Skeleton,
    pipeline: Pipeline[Any, Skeleton],
    draws: int,
    *,
    seed: int = 0,
    on_draw: Callable[[int, int], object] | None = None,
) -> Skeleton:
    """The skeleton of a pipeline, with the share of samples of its points whose skeletons show each part.

    The other arguments are those of `support`.
    """
    if skeleton.lacks_sample:
        raise InvalidCloudError("this skeleton of a mesh was changed and has no sample of its surface: make it anew")
    whole = skeleton.whole
    points = whole.points[whole.vertex_of_point >= 0][-skeleton.report.n_by_area :]  # of a mesh, those by area
    others, rng = [], np.random.default_rng(seed)
    for draw in range(draws):
        if on_draw is not None:
            on_draw(draw + 1, draws)
        rows = np.sort(rng.permutation(len(points))[: round(SAMPLE_SHARE * len(points))])
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SkeletonWarning)
            try:
                others.append(pipeline(points[rows]))
            except InvalidCloudError:  # too few points: they show nothing
                others.append(Skeleton((), (), (), (), (), ()))  # type: ignore[arg-type]
    return of_input(_supported(whole, others))


def _supported(skeleton: Skeleton, others: list[Skeleton]) -> Skeleton:
    """A skeleton with the share of others that show each part of it."""
    whole, curves = _Curve(skeleton), [_Curve(other) for other in others]
    near = np.array([curve.shows(whole.vertices, NEAR * whole.reach) for curve in curves])  # (samples, M)
    supported = []
    for branch in skeleton.branches:
        path = skeleton.vertices[branch]
        lengths = arc_lengths(path)
        shares = near[:, branch].mean(axis=1)
        supported.append(_part("branch", place_at(path, lengths, lengths[-1] / 2), np.mean(shares >= SHOWN_SHARE)))
    for loop in whole.loops:
        shares = [curve.shows_loop(whole, loop) for curve in curves]
        supported.append(_part("loop", whole.vertices[loop].mean(axis=0), np.mean(shares)))
    ends = np.zeros((len(curves), len(whole.ends)), bool)
    missing: list[_Missing] = []
    for draw, curve in enumerate(curves):
        pairs = matched(curve.vertices[curve.ends], whole.vertices[whole.ends], NEAR_END * whole.reach[whole.ends])
        ends[draw, [row for _, row in pairs]] = True
        for end in np.delete(curve.ends, [row for row, _ in pairs]).tolist():
            missing.append(("end", draw, curve.vertices[end], NEAR_END * curve.reach[end]))
        for loop in curve.loops:
            if not whole.shows_loop(curve, loop):
                middle = curve.vertices[loop].mean(axis=0)
                missing.append(("loop", draw, middle, norm(curve.vertices[loop] - middle).mean()))
    shares = ends.mean(axis=0)
    supported += [_part("end", whole.vertices[end], share) for end, share in zip(whole.ends, shares, strict=True)]
    support = near.mean(axis=0)
    support[whole.ends] = np.minimum(support[whole.ends], shares)
    same = sum(curve.counts == whole.counts for curve in curves)
    supported += _lacking(missing, len(curves))
    report = replace(skeleton.report, n_draws=len(curves), n_agreeing=same, support=tuple(supported))
    if same <= WORTH_A_WARNING * len(curves):
        weak = f", above all {report.unsupported[0]}: look there" if report.unsupported else ""
        others = f"{len(curves) - same} of {len(curves)} samples of the cloud"
        text, place = f"uncertain: {others} have a skeleton with another graph{weak}", ()
        if report.unsupported:
            place = report.unsupported[0].place
        report = report.with_reason("other samples", text, place, draws=len(curves), agreeing=same)
        warn(report.warnings[-1:])
    return replace(skeleton, support=support, report=report)


def _part(about: str, place: np.ndarray, share: float | np.floating, present: bool = True) -> Supported:
    x, y, z = place.tolist()
    return Supported(about, (x, y, z), float(share), present)


def _lacking(missing: list[_Missing], draws: int) -> Iterator[Supported]:
    """Ends and loops of samples that the skeleton lacks, those of several samples in one place as one."""
    for about in dict.fromkeys(row[0] for row in missing):
        rows = [row[1:] for row in missing if row[0] == about]
        draw, place, reach = (np.array(column) for column in zip(*rows, strict=True))
        near = cdist(place, place) <= np.maximum(reach[:, None], reach)
        group = component_labels(len(place), np.argwhere(near))
        for number in range(group.max() + 1):
            members = group == number
            share = len(np.unique(draw[members])) / draws
            yield _part(about, place[members].mean(axis=0), share, present=False)


class _Curve:
    """A skeleton as places along its curves."""

    def __init__(self, skeleton: Skeleton) -> None:
        self.vertices, self.edges, self.ends = skeleton.vertices, skeleton.edges, skeleton.leaves
        self.reach = np.maximum(np.nan_to_num(skeleton.radii), TINY)  # local radius of every vertex
        self.counts = skeleton.n_components, skeleton.n_loops, len(skeleton.leaves)
        self.loops = minimum_cycle_basis(len(self.vertices), self.edges, skeleton.edge_lengths)
        self._lengths = skeleton.edge_lengths
        step = np.maximum(STEP * self.reach[self.edges].min(axis=1, initial=np.inf), self._lengths / MOST_PIECES)
        self._places = cKDTree(np.concatenate([self.vertices, places_along(skeleton, step)[1]]))

    def shows(self, places: np.ndarray, reach: np.ndarray) -> np.ndarray:
        """Whether the curve comes within reach of places, (k,) bool array."""
        return self._places.query(places)[0] <= reach

    def shows_loop(self, other: _Curve, loop: np.ndarray) -> bool:
        """Whether the part of this curve near a loop of another one has a loop, too, along most of it."""
        around = cKDTree(other.vertices[loop])
        distance, nearest = around.query(self.vertices)
        near = distance <= NEAR_LOOP * other.reach[loop][nearest]
        edges = near[self.edges].all(axis=1)
        cycles = minimum_cycle_basis(len(self.vertices), self.edges[edges], self._lengths[edges])
        if not cycles:
            return False
        closed = cKDTree(self.vertices[np.unique(np.concatenate(cycles))])
        along_it = closed.query(other.vertices[loop])[0] <= NEAR_LOOP * other.reach[loop]
        return bool(along_it.mean() >= SHOWN_SHARE)
