"""What flows between the filters before there is a graph."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..geometry.rings import Rings
from ..geometry.vectors import Ints
from ..interop.clouds import to_point_cloud
from .points import WorkingCloud


def at_rest(positions: np.ndarray, rings: Rings) -> dict[str, Any]:
    """What a Contraction says of (n, 3) points that have not moved yet, as keywords."""
    _, ring_size = rings.nearest(positions)
    return dict(
        positions=positions,
        previous=positions,
        laplacian_coordinates=np.zeros((len(positions), 3)),
        rings=rings,
        ring_size0=ring_size,
        ring_size=ring_size,
        ring_ratio_drop=0.0,
        mean_ring_edge=float(rings.mean_lengths(positions).mean()),
        contraction_weight=0.0,
    )


@dataclass(frozen=True, eq=False)
class Contraction(WorkingCloud):
    """A cloud on its way to its skeleton.

    It has the attributes of `Points` except the neighbourhoods, the arrays over the survivors, and:

    Attributes
    ----------
    positions, previous : (n, 3) float64 array
        Contracted positions, and those before the last solve.
    laplacian_coordinates : (n, 3) float64 array
        L P before the last solve.
    rings : Rings
        Over the survivors; they keep their indices while the points move.
    mass : (n,) float64 array
        The number of distinct points that a survivor represents, over its mean before the contraction: all 1 unless
        points were merged before. It grows in reductions that conserve it.
    ring_size0, ring_size : (n,) float64 array
        Distance to the nearest ring neighbour in the uncontracted and in the contracted cloud: s(0), s(t).
    ring_ratio_drop : float
        psi: a(t-1) - a(t), the drop of the ring ratio in the last solve; a(1) after the first, 0 before it.
    mean_ring_edge, contraction_weight : float
        Mean over the points of the mean ring edge of the uncontracted cloud, and w_L of the last solve, 0 before it.
    thinned : (r,) int array
        The rows of `cloud` that have had a ring, survivors and those merged since.

    Examples
    --------
    >>> from glsk_o3d import Contractor, RingBuilder
    >>> from glsk_o3d.samples import torus
    >>> state = (RingBuilder() | Contractor())(torus(500).points)
    >>> state.contracted.shape == (len(state), 3), state.survivor_of_point.shape
    (True, (500,))
    """

    positions: np.ndarray
    previous: np.ndarray
    laplacian_coordinates: np.ndarray
    rings: Rings
    mass: np.ndarray
    ring_size0: np.ndarray
    ring_size: np.ndarray
    ring_ratio_drop: float
    mean_ring_edge: float
    contraction_weight: float
    thinned: Ints

    def __repr__(self) -> str:
        return f"Contraction({len(self)} of {len(self.points)} points left after {len(self.report.iterations)} solves)"

    @property
    def contracted(self) -> np.ndarray:
        """Contracted positions of the survivors in the user's units, (n, 3) float64 array."""
        return self.frame.out_of(self.positions)

    @property
    def surface_representatives(self) -> Ints:
        """For every input point that which shows the surface there, (N,) int array; -1 where it is not known.

        Points represent themselves at every place that had a ring, since these are evenly apart; and all do where there
        is noise, or was before they were averaged, since it is their mean. Others are represented by that of the sample
        which stands for them, if it is another one.
        """
        sampled, first = self.map.sampled, self.map.point_of_row
        several = np.bincount(self.map.row_of_point[sampled], minlength=len(self.cloud)) > 1
        shows = sampled & (self.map.to_points((self.noise > 0) | several) > 0)
        shows[first[self.thinned]] = True
        points, others = np.arange(len(self.points)), self.map.to_points(first)
        return np.where(shows, points, np.where(others == points, -1, others))

    @property
    def ring_ratio(self) -> float:
        """a(t): sum of the ring sizes over that of the uncontracted cloud."""
        return float(self.ring_size.sum() / self.ring_size0.sum())

    def to_point_cloud(self) -> Any:
        """The contracted points as an ``open3d.geometry.PointCloud``."""
        return to_point_cloud(self.contracted)
