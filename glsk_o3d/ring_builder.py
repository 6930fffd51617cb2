"""RingBuilder: cloud -> one-rings (Wen et al. 2024, section II-A)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from .errors import InvalidParameterError
from .interop.clouds import SearchParam, cloud_counts, cloud_points, search_parameters
from .numerics.neighbourhoods import plane_axes
from .numerics.rings import Rings, star_rings
from .parameters import documented, parameter, resolve_length
from .pipeline import Filter, Watch
from .preparation.denoising import average_noise, denoise
from .preparation.frame import finite_points
from .preparation.outliers import set_aside_outliers
from .preparation.sampling import Sample, sample_cloud
from .preparation.surface import Surface, Thinned, thin_surface
from .report import Report
from .state import Contraction, at_rest

LEAST_RING = 3  # derived: neighbours that a radius leaves, at least


def default_k(n: int) -> int:
    """Neighbours per point, itself included: 16 from 4096 points on, fewer by the cube root below, at least 8.

    In a sparse cloud 16 neighbours would reach across thin parts.
    """
    return int(np.clip(np.floor(16 * np.cbrt(n / 4096) + 0.5), 8, 16))


def published_k(n: int) -> int:
    """Neighbours per point, itself included: 1.2 % of the cloud, between 8 and 30 (Cao et al. 2010)."""
    return int(np.clip(np.floor(0.012 * n + 0.5), 8, 30))


def default_size(n: int) -> int:
    """Points to contract: at most 25000, but 64 times the square root of their number from 152588 points on.

    More points make the axis hardly more exact, since neither noise nor the thickness of parts shrinks with their
    spacing; they only cost time.
    """
    return min(n, max(25000, round(64 * np.sqrt(n))))


@documented
@dataclass(frozen=True, kw_only=True)
class RingBuilder(Filter[Contraction]):
    """Surround every point of a cloud with its one-ring.

    The ring of a point is its Delaunay star among its k nearest neighbours, projected on their principal plane. The
    cloud is taken in its own working frame (centred, longest side 1.6), in Morton order and without duplicates (points
    that differ by rounding are one); what comes out is mapped back to the user's order and units.

    For `k` Open3D's search parameters may be given: ``KDTreeSearchParamKNN(knn)`` is ``k=knn``,
    ``KDTreeSearchParamHybrid(radius, max_nn)`` is ``k=max_nn, radius=radius``, and ``KDTreeSearchParamRadius(radius)``
    is ``k=30, radius=radius``.

    Raises
    ------
    InvalidCloudError
        For points that are not finite (unless dropped), fewer than 8 distinct points, and anything that is no cloud.
    InvalidParameterError
        If the radius leaves more than half of the points without three neighbours.

    References
    ----------
    Wen et al. 2024, section II-A and figure 3; Cao et al. 2010, section 3.

    Examples
    --------
    >>> from glsk_o3d.samples import torus
    >>> state = RingBuilder(k=12, around=0)(torus(500).points)
    >>> len(state), bool(state.rings.closed.mean() > 0.9)
    (500, True)
    """

    k: int | Literal["auto", "published"] | SearchParam = parameter(
        "auto",
        "Neighbours per point, itself included; at most all. More bridge noise and gaps, fewer keep thin parts apart. "
        "'auto' is 8 to 16 and 'published' 8 to 30, by the number of points.",
        type="int",
        unit="points",
        low=4,
        high=256,
        choices=("auto", "published"),
    )
    radius: float | str | None = parameter(
        None,
        "Neighbours farther away than this are left out of the ring, but for the three nearest; None for no limit.",
        type="length?",
        unit="cloud's units, or % of the diagonal",
        low=0,
        open_low=True,
    )
    around: float = parameter(
        20.0,
        "Points around a part that are enough: where there are more, near ones are merged; with 0 or a `radius`, none.",
        unit="points",
        low=0,
        high=1000,
    )
    thin_to: int | Literal["auto", "all"] = parameter(
        "auto",
        "Most points to contract; others are merged into near ones, which take over their mass. 'auto' is 25000, or 64 "
        "times the square root of their number if that is more; 'all' merges none, whatever `around` says.",
        type="int",
        unit="points",
        low=8,
        choices=("auto", "all"),
    )
    outlier_factor: float = parameter(
        2.5,
        "A point this many times farther from its neighbours than these are from theirs is set aside: it goes to the "
        "nearest vertex but has no say. 0 keeps all.",
        low=0,
    )
    denoise: int = parameter(
        4,
        "Passes that draw the points of noisy neighbourhoods to the ridge of their density. 0 for none.",
        unit="passes",
        low=0,
    )
    frame: Literal["spread", "box"] = parameter(
        "spread",
        "What percentages and weights refer to: the box with the spread of the points, or the axis-aligned one.",
        choices=("spread", "box"),
    )
    drop_invalid: bool = parameter(False, "Drop points with NaN or infinite coordinates instead of refusing.")

    def __post_init__(self) -> None:
        # as plain numbers they can be compared, printed and written to files
        if not isinstance(self.k, (int, str)):
            given = search_parameters(self.k)
            if self.radius not in (None, given.get("radius", self.radius)):
                raise InvalidParameterError(
                    f"RingBuilder.radius = {self.radius!r}: the {type(self.k).__name__} already has one, "
                    f"{given['radius']!r}: give radius=None with it"
                )
            for name, value in given.items():
                object.__setattr__(self, name, value)

    def _run(self, cloud: Any, watch: Watch | None) -> Contraction:
        points = cloud_points(cloud)
        finite = finite_points(points, self.drop_invalid)
        given = points if finite.all() else points[finite]
        counts, n, dropped = cloud_counts(cloud, finite)
        most = self._most(n)
        sample = sample_cloud(given, self.sample_size(n), counts)
        surface = set_aside_outliers(given[sample.kept], sample.counts, self.frame, self._k, self.outlier_factor)
        if self.denoise and self._may_merge:
            surface = average_noise(surface, self._k)
        surface = denoise(surface, self.denoise, self.outlier_factor > 0)
        thinned = thin_surface(surface, self.around if self._may_merge else 0, most, self._k)
        report = Report(n_input=n + dropped, n_dropped=dropped)
        return _contraction(points, finite, sample, surface, thinned, self._rings(surface, thinned), report)

    def sample_size(self, n: int) -> int:
        """About how many of n points say where the surface is, if these are more than twice as many."""
        # a radius is in terms of the spacing that the cloud came with
        return 2 * self._most(n) if self.radius is None else n

    def _rings(self, surface: Surface, thinned: Thinned) -> Rings:
        """Delaunay stars among the neighbours within the radius, in the planes of the neighbourhoods."""
        positions, axes = surface.points[thinned.survivors], plane_axes(thinned.ring_normals)
        neighbours = thinned.neighbours[:, 1:]
        if self.radius is not None:
            frame = surface.frame
            radius = resolve_length(self.radius, frame.diagonal * frame.scale) / frame.scale
            neighbours = self._within(radius, positions, neighbours)
        return star_rings(positions, np.arange(len(positions)), neighbours, axes)

    def _within(self, radius: float, positions: np.ndarray, neighbours: np.ndarray) -> np.ndarray:
        """The neighbours without those beyond the radius, which become -1; but the nearest three stay."""
        far = ((positions[neighbours] - positions[:, None]) ** 2).sum(axis=2) > radius**2
        few = np.count_nonzero(far[:, LEAST_RING - 1])
        if 2 * few > len(positions):
            raise InvalidParameterError(
                f"RingBuilder.radius = {self.radius!r}: {few} of {len(positions)} points have fewer than {LEAST_RING} "
                "neighbours so near; is it in the cloud's units?"
            )
        far[:, :LEAST_RING] = False
        return np.where(far, -1, neighbours)

    @property
    def _may_merge(self) -> bool:
        return self.radius is None and self.thin_to != "all"

    def _k(self, n: int) -> int:
        chosen: Any = {"auto": default_k(n), "published": published_k(n)}.get(self.k, self.k)  # type: ignore[arg-type]
        return min(chosen, n)

    def _most(self, n: int) -> int:
        return {"auto": default_size(n), "all": n}[self.thin_to] if isinstance(self.thin_to, str) else self.thin_to


def _contraction(
    points: np.ndarray,
    finite: np.ndarray,
    sample: Sample,
    surface: Surface,
    thinned: Thinned,
    rings: Rings,
    report: Report,
) -> Contraction:
    """What flows on: nothing has moved yet."""
    representative, outlier, sampled = np.full(len(points), -1), *np.zeros((2, len(points)), bool)
    representative[finite] = surface.representative[sample.representative]
    outlier[finite] = surface.outlier[sample.representative]
    sampled[np.flatnonzero(finite)[sample.kept]] = ~surface.outlier
    n = len(rings)
    return Contraction(
        points=points,
        representative_of_point=representative,
        outlier=outlier,
        sampled=sampled,
        frame=surface.frame,
        cloud=surface.points,
        noise=surface.noise,
        normals=surface.normals,
        survivors=thinned.survivors,
        representative=thinned.representative,
        mass=np.bincount(thinned.representative, surface.merged) * (n / surface.merged.sum()),
        **at_rest(surface.points[thinned.survivors], rings),
        report=replace(
            report,
            n_outliers=int(outlier.sum()),
            n_sampled=len(sample.kept),
            n_distinct=int(surface.merged.sum()),
            n_contracted=n,
            noise=float(surface.noise.mean()),
        ),
    )
