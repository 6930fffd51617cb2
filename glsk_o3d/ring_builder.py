"""RingBuilder: cloud -> one-rings (Wen et al. 2024, section II-A)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from .errors import InvalidCloudError, InvalidParameterError
from .interop.clouds import cloud_points, search_parameters
from .numerics.morton import morton_order
from .numerics.neighbourhoods import isolation, nearest_left, nearest_neighbours, plane_axes, principal
from .numerics.rings import star_rings
from .parameters import documented, parameter, resolve_length
from .pipeline import Filter
from .preparation.denoising import noise_share, to_ridges
from .preparation.frame import Frame
from .preparation.outliers import without_outliers
from .preparation.sampling import _sample, usual_number
from .preparation.thinning import average_noisy, thin, thin_smooth
from .report import Report
from .state import Contraction, at_rest

MIN_POINTS = 8
LEAST_RING = 3
SMALLEST, LARGEST = 1e-120, 1e120  # extents whose squares and products a float64 holds
ALONE, FAIRLY_NOISY = 1.8, 0.2  # isolation of a denoised point that is set aside, and its least noise
FEW, ENOUGH = 1000, 8192  # points from which on, and down to which, more than enough are merged
STEADY = 0.9  # share of the points left at which that ends
PLENTY = 4096  # noisy points that are enough: down to about so many they are averaged
COINCIDENT = 4e-15  # points nearer than this in the working frame, a few roundings, are duplicates


def usual_k(n: int) -> int:
    """Neighbours per point, itself included: 16 from 4096 points on, fewer by the cube root below, at least 8.

    In a sparse cloud 16 neighbours would reach across thin parts.
    """
    return int(np.clip(np.floor(16 * np.cbrt(n / 4096) + 0.5), 8, 16))


def published_k(n: int) -> int:
    """Neighbours per point, itself included: 1.2 % of the cloud, between 8 and 30 (Cao et al. 2010)."""
    return int(np.clip(np.floor(0.012 * n + 0.5), 8, 30))


@dataclass(frozen=True)
class _Surface:
    """Points in the working frame that say where the surface is, and what their neighbourhoods are like."""

    points: np.ndarray
    neighbours: np.ndarray
    weight: np.ndarray  # points of the cloud that each stands for
    merged: np.ndarray  # distinct points that each is the mean of
    noise: np.ndarray
    normals: np.ndarray
    spread: np.ndarray
    across: np.ndarray  # normals of the planes that the rings lie in

    @classmethod
    def of(cls, points, neighbours, weight, merged):
        spread, normals = principal(points, neighbours)
        return cls(points, neighbours, weight, merged, noise_share(spread, neighbours), normals, spread, normals)


@documented
@dataclass(frozen=True, kw_only=True)
class RingBuilder(Filter[Contraction]):
    """Surround every point of a cloud with its one-ring.

    The ring of a point is its Delaunay star among its k nearest neighbours, projected on their principal plane. The
    cloud is taken in its own working frame (centred, longest side 1.6), in Morton order and without duplicates (points
    that differ by rounding are one); what comes out is mapped back to the user's order and units.

    For `k` Open3D's own search parameters may be given: ``KDTreeSearchParamKNN(knn)`` is ``k=knn``,
    ``KDTreeSearchParamHybrid(radius, max_nn)`` is ``k=max_nn, radius=radius``, and ``KDTreeSearchParamRadius(radius)``,
    which has no limit of its own, is ``k=30, radius=radius``.

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

    k: int | str | Any = parameter(
        "auto",
        "Neighbours per point, itself included; at most all points. More bridge noise and gaps, fewer keep thin parts "
        "apart. 'auto' is 16 from 4096 points on and fewer below, by the cube root, at least 8; 'published' is 1.2 % "
        "of the points, at least 8 and at most 30.",
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
        25.0,
        "Points around a part that are enough: where the surface has more, near ones are merged, at most four into "
        "one at a time, which takes over their mass. Fewer are faster; edges, thin and noisy parts, and clouds of less "
        "than 1000 points stay as they are. 0 merges none for this, and so does a `radius`.",
        type="float",
        unit="points",
        low=0,
        high=1000,
    )
    thin_to: int | str = parameter(
        "auto",
        "Most points to contract; the others are merged into a near one, which takes over their mass. Of more than "
        "four times as many, a sample from a grid says where the surface is, and the others only belong to a vertex. "
        "'auto' is 25000, but 64 times the square root of their number from 152588 on; 'all' merges none, whatever "
        "`around` says, as published.",
        type="int",
        unit="points",
        low=8,
        choices=("auto", "all"),
    )
    outlier_factor: float = parameter(
        2.5,
        "A point this many times farther from its neighbours than these are from theirs is set aside: it goes to the "
        "nearest vertex but has no say; so do many that float in space together, and one that denoising leaves alone. "
        "0 keeps all.",
        type="float",
        low=0,
    )
    denoise: int = parameter(
        4,
        "Passes that draw the points of noisy neighbourhoods to the ridge of their density before the rings are made. "
        "Where there are 8192 or more, these are averaged first, unless there is a `radius` or `thin_to` is 'all'. "
        "Clean points stay. 0 for none.",
        type="int",
        unit="passes",
        low=0,
    )
    frame: str = parameter(
        "spread",
        "What lengths in percent refer to, and the frame in which the weights are stated: the box with the spread of "
        "the points, which turns with them, or the axis-aligned bounding box, as published.",
        type="choice",
        choices=("spread", "box"),
    )
    drop_invalid: bool = parameter(
        False, "Drop points with NaN or infinite coordinates instead of refusing.", type="bool"
    )

    def __post_init__(self):
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

    def _run(self, cloud, watch):
        points = cloud_points(cloud)
        finite = self._finite(points)
        good = points if finite.all() else points[finite]
        most = self._number(len(good))
        # a radius is in terms of the spacing that the cloud came with
        sample, stands_for, counts = _sample(good, 2 * most if self.radius is None else len(good))
        frame, surface, row, stray = self._without_outliers(good[sample], counts)
        surface, into = self._averaged(surface)
        row = into[row]
        surface, into, alone = self._denoised(surface)
        row, stray = into[row], stray | alone[row]
        survivors, owner, neighbours = self._thinned(surface, most)
        n, positions, axes = len(survivors), surface.points[survivors], plane_axes(surface.across[survivors])
        rings = star_rings(positions, np.arange(n), self._within(positions, neighbours[:, 1:], frame), axes)
        row_of_point, outlier, witness = (
            np.full(len(points), -1),
            np.zeros(len(points), bool),
            np.zeros(len(points), bool),
        )
        row_of_point[finite], outlier[finite] = row[stands_for], stray[stands_for]
        witness[np.flatnonzero(finite)[sample]] = ~stray
        return Contraction(
            points=points,
            row_of_point=row_of_point,
            outlier=outlier,
            witness=witness,
            frame=frame,
            cloud=surface.points,
            noise=surface.noise,
            normals=surface.normals,
            survivors=survivors,
            owner=owner,
            mass=np.bincount(owner, surface.merged) * (n / surface.merged.sum()),
            **at_rest(positions, rings),
            report=Report(
                n_input=len(points),
                n_dropped=int((~finite).sum()),
                n_outliers=int(outlier.sum()),
                n_sampled=len(sample),
                n_distinct=int(surface.merged.sum()),
                n_contracted=n,
            ),
        )

    def _without_outliers(self, points, counts):
        """Frame and surface of the distinct points but outliers, the row of or nearest to each point, the outliers."""
        frame, cloud, row, weight, distance, neighbours = self._distinct(points, counts)
        stray = np.zeros(len(points), bool)
        if self.outlier_factor:
            found = np.ones(len(cloud), bool)
            found[without_outliers(cloud, weight, distance, neighbours, self.outlier_factor, MIN_POINTS)] = False
            stray = found[row]
        if stray.any():
            frame, cloud, row[~stray], weight, _, neighbours = self._distinct(points[~stray], counts[~stray])
            row[stray] = cKDTree(cloud).query(frame.into(points[stray]))[1]
        return frame, _Surface.of(cloud, neighbours, weight, np.ones(len(cloud))), row, stray

    def _averaged(self, surface):
        """The surface with means in the place of noisy points while there are plenty, and the row each went into."""
        row = np.arange(len(surface.points))
        while self.denoise and self._may_merge and np.count_nonzero(surface.noise) >= 2 * PLENTY:
            noisy = surface.points, surface.neighbours, surface.noise, surface.weight
            into, mean, weight = average_noisy(*noisy, PLENTY)
            if len(mean) > STEADY * len(into):
                break
            neighbours = nearest_neighbours(mean, self._neighbours(len(mean)))[1]
            surface, row = _Surface.of(mean, neighbours, weight, np.bincount(into, surface.merged)), into[row]
        return surface, row

    def _denoised(self, surface):
        """The surface drawn to its ridges, without points that now stand alone; the row nearest to each; the alone."""
        everybody, alone = np.arange(len(surface.points)), np.zeros(len(surface.points), bool)
        if not (self.denoise and surface.noise.any()):
            return surface, everybody, alone
        calm, k = to_ridges(surface.points, surface.noise, self.denoise, surface.weight), surface.neighbours.shape[1]
        distance, neighbours = nearest_neighbours(calm, k)
        found = isolation(distance[:, 1:].mean(axis=1), neighbours) > ALONE
        found &= (surface.noise > FAIRLY_NOISY) & (self.outlier_factor > 0)
        if 0 < found.sum() <= len(calm) - max(k, MIN_POINTS):
            alone = found
        left, nearest = np.flatnonzero(~alone), np.cumsum(~alone) - 1
        if len(left) < len(calm):
            nearest[alone] = cKDTree(calm[left]).query(calm[alone])[1]
            calm, neighbours = calm[left], nearest_left(calm, neighbours, ~alone, k)
        spread, across = principal(calm, neighbours)
        # a ridge has no normals: those of the surface as it came
        noise, normals = surface.noise[left], surface.normals[left]
        ridge = _Surface(calm, neighbours, surface.weight[left], surface.merged[left], noise, normals, spread, across)
        return ridge, nearest, alone

    def _thinned(self, surface, most):
        """Rows of the points to contract, the one of these that stands for each point, and their neighbours."""
        cloud, neighbours, spread = surface.points, surface.neighbours, surface.spread
        left, owner = np.arange(len(cloud)), np.arange(len(cloud))

        def merge(into, kept):
            rows, rank = left[kept], np.cumsum(kept) - 1
            return rows, rank[into][owner], nearest_left(cloud[left], neighbours, kept, self._neighbours(len(rows)))

        while self.around and self._may_merge and len(left) >= FEW:
            into = thin_smooth(cloud[left], neighbours, spread, self.around)
            kept = into == np.arange(len(into))
            if np.count_nonzero(kept) > STEADY * len(into):
                break
            left, owner, neighbours = merge(into, kept)
            if len(left) < ENOUGH:
                break
            spread = principal(cloud[left], neighbours)[0]
        if most < len(left):
            into = thin(cloud[left], neighbours, most)
            left, owner, neighbours = merge(into, into == np.arange(len(into)))
        return left, owner, neighbours

    def _within(self, cloud, neighbours, frame):
        """The neighbours without those beyond the radius, which become -1."""
        if self.radius is None:
            return neighbours
        radius = resolve_length(self.radius, frame.diagonal * frame.scale) / frame.scale
        far = ((cloud[neighbours] - cloud[:, None]) ** 2).sum(axis=2) > radius**2
        alone = np.count_nonzero(far[:, LEAST_RING - 1])
        if 2 * alone > len(cloud):
            raise InvalidParameterError(
                f"RingBuilder.radius = {self.radius!r}: {alone} of {len(cloud)} points have fewer than {LEAST_RING} "
                "neighbours so near; is it in the cloud's units?"
            )
        far[:, :LEAST_RING] = False
        return np.where(far, -1, neighbours)

    @property
    def _may_merge(self):
        return self.radius is None and self.thin_to != "all"

    def _neighbours(self, n):
        return min({"auto": usual_k, "published": published_k}[self.k](n) if isinstance(self.k, str) else self.k, n)

    def _number(self, n):
        return {"auto": usual_number(n), "all": n}[self.thin_to] if isinstance(self.thin_to, str) else self.thin_to

    def _finite(self, points):
        finite = np.isfinite(points).all(axis=1)
        dropped = int(len(points) - finite.sum())
        if dropped and not self.drop_invalid:
            raise InvalidCloudError(
                f"{dropped} of {len(points)} points have NaN or infinite coordinates, the first at index "
                f"{int(np.argmin(finite))}: drop them with RingBuilder(drop_invalid=True), or remove them first"
            )
        return finite

    def _distinct(self, points, counts):
        """Frame, distinct points in Morton order, row of each point, counts, distances and rows of their neighbours."""
        if len(points) < MIN_POINTS:
            raise InvalidCloudError(
                f"{len(points)} finite points: a skeleton needs at least {MIN_POINTS} distinct ones"
            )
        with np.errstate(over="ignore"):
            extent = np.ptp(points, axis=0).max()
        if extent == 0:
            raise InvalidCloudError(f"all {len(points)} points coincide: there is nothing to skeletonise")
        if not SMALLEST < extent < LARGEST:
            raise InvalidCloudError(f"the cloud is {extent:g} long, too extreme for its squares: rescale it")
        frame = Frame.of(points, self.frame)
        scaled = frame.into(points)
        order = morton_order(scaled)
        cloud, row = scaled[order], np.empty(len(points), int)
        row[order] = np.arange(len(points))
        k = self._neighbours(len(cloud))
        distance, neighbours = nearest_neighbours(cloud, k)
        if distance[:, 1].min() < COINCIDENT:
            cells = np.round(cloud / COINCIDENT).astype(np.int64)
            first, inverse = np.unique(cells, axis=0, return_index=True, return_inverse=True)[1:]
            if len(first) < MIN_POINTS:
                raise InvalidCloudError(
                    f"{len(points)} points but only {len(first)} distinct ones: a skeleton needs at least {MIN_POINTS}"
                )
            # Anew: the frame is that of the distinct points, however often they came.
            distinct = points[order[first]]
            frame = Frame.of(distinct, self.frame)
            cloud = frame.into(distinct)
            order = morton_order(cloud)
            position = np.empty(len(cloud), int)
            position[order] = np.arange(len(cloud))
            cloud, row = cloud[order], position[inverse.reshape(-1)[row]]
            distance, neighbours = nearest_neighbours(cloud, self._neighbours(len(cloud)))
        weight = np.empty(len(cloud))
        weight[row] = counts
        return frame, cloud, row, weight, distance, neighbours
