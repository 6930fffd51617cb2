"""RingBuilder: points -> one-rings (Wen et al. 2024, section II-A)."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ..data.contraction import Contraction, at_rest
from ..data.derived import fields_of
from ..data.points import Points, WorkingCloud
from ..errors import InvalidParameterError
from ..geometry.neighbourhoods import nearest_neighbours, plane_axes, principal
from ..geometry.rings import star_rings
from ..parameters import documented, parameter, resolve_length
from ..pipeline import Filter, RunContext

PUBLISHED_SHARE, PUBLISHED_RINGS = 0.012, (8, 30)  # published: neighbours over points, and their limits
LEAST_RING = 3  # derived: neighbours that a radius leaves, at least


def published_k(n: int) -> int:
    """Neighbours per point, itself included: 1.2 % of the cloud, between 8 and 30 (Cao et al. 2010)."""
    return int(np.clip(np.floor(PUBLISHED_SHARE * n + 0.5), *PUBLISHED_RINGS))


@documented
@dataclass(frozen=True, kw_only=True)
class RingBuilder(Filter[Points, Contraction]):
    """Give every point its one-ring.

    The ring of a point is its Delaunay star among its k nearest neighbours, projected on their principal plane. A cloud
    is treated as by ``Sampler(size="all")``.

    Raises
    ------
    InvalidCloudError
        As of `Sampler`.
    InvalidParameterError
        If the radius leaves more than half of the points without three neighbours.

    References
    ----------
    Wen et al. 2024, section II-A and figure 3; Cao et al. 2010, section 3.

    Examples
    --------
    >>> from glsk_o3d.samples import torus
    >>> state = RingBuilder(k=12)(torus(500).points)
    >>> len(state), bool(state.rings.closed.mean() > 0.9)
    (500, True)
    """

    k: int | Literal["auto", "published"] = parameter(
        "auto",
        "Neighbours per point, itself included; at most all. More bridge noise and gaps, fewer keep thin parts apart. "
        "'auto' is 8 to 16, more where points lie in rows, and 'published' 8 to 30, by the number of points.",
        type="int",
        unit="points",
        low=4,
        high=256,
        choices=("auto", "published"),
    )
    radius: float | str | None = parameter(
        None,
        "Neighbours farther away than this are left out of the ring, except the three nearest; None for no limit.",
        type="length?",
        unit="cloud's units, or % of the diagonal",
        low=0,
        open_low=True,
    )

    def run(self, points: Points, context: RunContext) -> Contraction:
        cloud = points.cloud[points.survivors]
        neighbours, normals = self.neighbourhoods(points, cloud)
        if np.array_equal(points.ring_normals, points.normals):  # no point was moved or merged
            points = replace(points, normals=normals)
        if self.radius is not None:
            radius = resolve_length(self.radius, points.frame.diagonal * points.frame.scale) / points.frame.scale
            neighbours = self._within(radius, cloud, neighbours)
        rings = star_rings(cloud, np.arange(len(cloud)), neighbours, plane_axes(normals))
        n = len(rings)
        report = replace(
            points.report,
            n_outliers=int(points.outlier.sum()),
            n_distinct=int(points.merged.sum()),
            n_contracted=n,
            noise=float(points.noise.mean()),
        )
        mass = np.bincount(points.map.survivor_of_row, points.merged) * (n / points.merged.sum())
        known = dict(report=report, mass=mass, thinned=points.survivors)
        return Contraction(**(fields_of(points, WorkingCloud) | known | at_rest(cloud, rings)))

    def neighbourhoods(self, points: Points, cloud: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The neighbours of every point but itself, (n, k - 1), and the unit normals of their planes, (n, 3)."""
        known = points.neighbours.shape[1]
        k = {"auto": known, "published": published_k(len(cloud))}[self.k] if isinstance(self.k, str) else self.k
        k = min(k, len(cloud))
        if k == known:
            return points.neighbours[:, 1:], points.ring_normals
        neighbours = nearest_neighbours(cloud, k)[1]
        return neighbours[:, 1:], principal(cloud, neighbours)[1]

    def _within(self, radius: float, cloud: np.ndarray, neighbours: np.ndarray) -> np.ndarray:
        """The neighbours without those beyond the radius, which become -1; but the nearest three stay."""
        far = ((cloud[neighbours] - cloud[:, None]) ** 2).sum(axis=2) > radius**2
        few = np.count_nonzero(far[:, LEAST_RING - 1])
        if 2 * few > len(cloud):
            raise InvalidParameterError(
                f"RingBuilder.radius = {self.radius!r}: {few} of {len(cloud)} points have fewer than {LEAST_RING} "
                "neighbours so near; is it in the cloud's units?"
            )
        far[:, :LEAST_RING] = False
        return np.where(far, -1, neighbours)
