"""Thinner: points -> fewer of them where there are more than it takes."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.sparse import csr_array

from ..data.points import POINTS, Points, default_k, default_size
from ..geometry.eigen import principal_parts
from ..geometry.neighbourhoods import nearest_left, principal, reach_next_rows, wide_covariances
from ..geometry.numbers import derived, fitted, measured, speed
from ..geometry.pairing import Pairs, merge_pairs
from ..geometry.vectors import TINY, norm
from ..parameters import documented, parameter
from ..pipeline import Filter, RunContext


@dataclass(frozen=True)
class ThinnerNumbers:
    """Numbers of the Thinner."""

    ask_again: float = speed(0.25, "share of the points, below which the neighbours are looked up anew")
    packed: float = measured(0.42, "points left on an area of 1 if none are to be nearer than 1")
    smoothing: int = fitted(8, "steps over which the thickness of parts is averaged")
    least_merged: float = measured(0.001, "share of the points that a round must merge: along a spiral it is one each")
    least_around: int = derived(3, "points around the thinnest part")
    wider_steps: int = measured(3, "steps between neighbours: fewer see noise alone, more see other parts")
    sheet_from: float = measured(0.4, "second over third variance of a sheet, at least; tubes of 10 have it")
    wider_bias: float = measured(1.25, "bias of points around on tubes with 18 to 80 of them in noise")


THIN_OUT = ThinnerNumbers()


@documented
@dataclass(frozen=True, kw_only=True)
class Thinner(Filter[Points, Points]):
    """Merge near points where a part has more points than a skeleton needs.

    No point moves, and the one that stays takes over the mass. Gaps stay smaller than in a random sample, and thin
    parts keep their points.

    Examples
    --------
    >>> from glsk_o3d import Sampler
    >>> from glsk_o3d.samples import torus
    >>> points = (Sampler() | Thinner())(torus(5000).points)
    >>> len(points) < 2500, len(points.cloud)
    (True, 5000)
    """

    around: float = parameter(
        20.0,
        "Points to keep around the circumference of a part; surplus near points are merged. 0 merges none.",
        unit="points",
        low=0,
        high=1000,
    )
    thin_to: int | Literal["auto", "all"] = parameter(
        "auto",
        "Most points to contract. 'auto' is 25000, or 64 times the square root of their number if that is more; 'all' "
        "merges none, whatever `around` says.",
        type="int",
        unit="points",
        low=8,
        choices=("auto", "all"),
    )

    def run(self, points: Points, context: RunContext) -> Points:
        if self.thin_to == "all":
            return points
        before = np.inf
        while self.around and POINTS.enough <= len(points) <= before / 2:
            before, places = len(points), points.cloud[points.survivors]
            spacing = spacing_enough(places, points.neighbours, points.spread, self.around)
            points = _merged(points, thin_nearer(places, points.neighbours, spacing))
        report = points.report
        if report.is_sampled and self.thin_to != "auto" and self.thin_to > report.n_sampled:
            warning = f"Thinner.thin_to = {self.thin_to}: the Sampler left {report.n_sampled} points: set Sampler.size"
            points = points.with_report(report.with_reason("option", warning))
        n = max(report.n_input - report.n_dropped, report.n_by_area)
        most = default_size(n) if self.thin_to == "auto" else self.thin_to
        if most < len(points):
            points = _merged(points, thin(points.cloud[points.survivors], points.neighbours, most))
        return points


def _merged(points: Points, representative: np.ndarray) -> Points:
    """What is left when survivors are merged into others."""
    kept, surface = representative == np.arange(len(representative)), points.cloud[points.survivors]
    neighbours = nearest_left(surface, points.neighbours, kept, default_k(int(kept.sum())))
    neighbours = reach_next_rows(surface[kept], neighbours)
    spread, normals = principal(surface[kept], neighbours)
    return points.merged_into(representative, neighbours=neighbours, spread=spread, ring_normals=normals)


def thin(points: np.ndarray, neighbours: np.ndarray, n: int) -> np.ndarray:
    """Merge mutual nearest neighbours, round by round, in the last one the nearest, until n >= 1 points are left.

    Gaps stay smaller than in a random sample, and dense parts stay dense: scanners and meshes have them where there is
    detail. No point moves. It does not depend on the order of the points, nor on how they are turned, but where
    distances are equal: on grids a point's nearest neighbour is any of several, and more than n points may be left
    because no two choose each other. Returned is the point that each was merged into, as by `merge_pairs`.
    """

    def choose(pairs: Pairs, mass: np.ndarray) -> Pairs:
        kept, swallowed = pairs
        too_many = np.count_nonzero(mass > 0) - n
        if len(kept) <= too_many:
            return pairs
        nearest = np.argsort(((points[kept] - points[swallowed]) ** 2).sum(axis=1), kind="stable")[:too_many]
        return kept[nearest], swallowed[nearest]

    representative = merge_pairs(points, neighbours, choose, least=max(n, THIN_OUT.ask_again * len(points)))
    remaining = representative == np.arange(len(points))
    rows = np.flatnonzero(remaining)
    if n < len(rows) < len(points):
        around = nearest_left(points, neighbours, remaining, min(neighbours.shape[1], len(rows)))
        representative = rows[thin(points[rows], around, n)][(np.cumsum(remaining) - 1)[representative]]
    return representative


def thin_nearer(points: np.ndarray, neighbours: np.ndarray, spread: np.ndarray) -> np.ndarray:
    """Merge mutual nearest neighbours that are nearer than they are to be, round by round, as long as it is worth it.

    Of two points the lesser distance `apart` (n,) counts, and the one stays that more were merged into, so that none
    wanders along rows of points that get ever denser. Returned is the point that each was merged into.
    """

    def choose(pairs: Pairs, mass: np.ndarray) -> Pairs:
        kept, swallowed = pairs
        reach = np.minimum(spread[kept], spread[swallowed])
        nearer = norm(points.take(kept, axis=0) - points.take(swallowed, axis=0)) < reach
        nearer &= np.count_nonzero(nearer) > THIN_OUT.least_merged * len(points)
        kept, swallowed = kept[nearer], swallowed[nearer]
        swap = mass[kept] < mass[swallowed]
        return np.where(swap, swallowed, kept), np.where(swap, kept, swallowed)

    return merge_pairs(points, neighbours, choose)


def spacing_enough(points: np.ndarray, neighbours: np.ndarray, spread: np.ndarray, around: float) -> np.ndarray:
    """How far apart points may be, (n,), so that `around` of them are around every part, and enough on the body.

    The circumference of the part that a point is on is its points around times their spacing, see `points_around`;
    measured point by point it is rough, and what is left would be as uneven. So its inverse is averaged over the
    surface. Flat and thick parts have no more than their share of 2400 points, spread evenly over all of the surface.
    Nowhere more than twice the spacing that there is: fewer points are measured again, with less noise.
    """
    k = neighbours.shape[1]
    # the variance of a disc is a quarter of R^2, that of a row of points a twelfth of its length squared
    disc = np.sqrt(4 * np.pi * np.sqrt(spread[:, 1] * spread[:, 2])) / k
    spacing = np.maximum(disc, np.sqrt(12 * spread[:, 2] / k) / k)
    average = mean_over(neighbours)
    bent = 1 / (np.maximum(points_around(points, average, spread), THIN_OUT.least_around) * np.maximum(spacing, TINY))
    for _ in range(THIN_OUT.smoothing):
        bent = average @ bent
    among = np.minimum(1 / (max(around, 1) * np.maximum(bent, TINY)), np.sqrt(spacing @ spacing / POINTS.enough))
    return np.minimum(np.sqrt(THIN_OUT.packed) * among, 2 * spacing)


def points_around(points: np.ndarray, average: csr_array, spread: np.ndarray) -> np.ndarray:
    r"""Points around the part that each point is on, its circumference over their spacing, whatever the noise.

    A disc of k points of a tube with N points around it rises above its plane by :math:`\sigma_1 / \sigma_3 =
    \pi k / (4 N^2)`, the least over the largest principal variance; and noise adds to :math:`\sigma_1`. In wider
    surroundings, where :math:`\sigma_3` is s times as large, noise adds the same, but the tube rises s^2 times as
    much: their difference, over :math:`s^2 - 1`, is free of noise. These are the surroundings of the neighbours of the
    neighbours, all together. In them edges, gaps and other parts look like thin parts. Where they are no sheet but a
    line, a part with less than ten points around it, all of :math:`\sigma_1` is its thickness.

    `average` is `mean_over` the neighbours, and `spread` as from `principal`. (n,) float array, infinite where nothing
    but noise is seen.
    """
    k = average.nnz // len(points)
    wider = principal_parts(wide_covariances(points, lambda values: average @ values, THIN_OUT.wider_steps)[0])[0]
    near = np.maximum(spread.T / k, TINY)
    sheet = np.clip(
        wider[1] / (THIN_OUT.sheet_from * np.maximum(wider[2], TINY)), 0, 1
    )  # rounding leaves less than nothing
    bent = np.maximum(wider[0] - near[0], 0) / np.maximum((wider[2] / near[2]) ** 2 - 1, TINY)
    bent = sheet * bent + (1 - sheet) * np.maximum(wider[0], 0)
    with np.errstate(divide="ignore"):
        return THIN_OUT.wider_bias * np.sqrt(np.pi * k / 4 * near[2] / bent)


def mean_over(neighbours: np.ndarray) -> csr_array:
    """The matrix that takes values to their means over the neighbours."""
    n, k = neighbours.shape
    return csr_array((np.full(neighbours.size, 1 / k), neighbours.ravel(), k * np.arange(n + 1)), shape=(n, n))
