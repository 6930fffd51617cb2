"""How thick parts are where their points are: over how far these are apart."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..numerics.neighbourhoods import nearest_neighbours
from ..refinement.thin_parts import SCALE_NEIGHBOUR
from .segmentation import vertex_of_cloud

if TYPE_CHECKING:
    from ..skeleton import Skeleton


def thickness(skeleton: Skeleton, cloud: Any = None) -> np.ndarray:
    """Radius of the part that every point belongs to, over the distance to the eighth nearest point.

    Well above 1 the cloud shows the surface of the part. Below 1 the part is thinner than its points are far apart, and
    its radius is hardly more than a guess.

    Parameters
    ----------
    skeleton : Skeleton
    cloud : cloud, optional
        As for `segment`; how far its own points are apart counts.

    Returns
    -------
    (N,) float64 array
        NaN for points that are not finite, and infinite for those with eight others in their place.

    Raises
    ------
    InvalidCloudError
        There is no cloud, or it is none.
    InvalidParameterError
        The skeleton is empty.

    Examples
    --------
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import torus
    >>> dense, sparse = (thickness(skeletonize(torus(n).points)) for n in (4000, 500))
    >>> bool(np.median(dense) > 2 * np.median(sparse) > 1)
    True
    """
    return thickness_of_points(skeleton, *vertex_of_cloud(skeleton, cloud))


def thickness_of_points(skeleton: Skeleton, points: np.ndarray, vertex: np.ndarray) -> np.ndarray:
    """The same for points, (N, 3) float array, whose vertices are known, (N,) int array."""
    some = np.flatnonzero(vertex >= 0)
    found = np.full(len(points), np.nan)
    if len(some):
        apart = nearest_neighbours(points[some], min(SCALE_NEIGHBOUR + 1, len(some)))[0][:, -1]
        with np.errstate(divide="ignore", invalid="ignore"):
            found[some] = skeleton.radii[vertex[some]] / apart
    return found
