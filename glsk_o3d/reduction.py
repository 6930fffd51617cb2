"""Local point reduction for Open3D pipelines: a cloud in, a smaller cloud and the indices of its points out."""

from __future__ import annotations

from typing import Any

import numpy as np

from .contractor import Contractor
from .errors import InvalidCloudError, InvalidParameterError
from .interop.open3d import import_open3d, open3d_class
from .lpr_reducer import LPRReducer
from .ring_builder import RingBuilder


def remove_redundant_points(
    cloud: Any, *, passes: int = 1, rings: RingBuilder | None = None, reducer: LPRReducer | None = None
) -> tuple[Any, Any]:
    """Remove points that say little more about the skeleton than their neighbours, by local point reduction.

    The points are contracted, those that have become redundant are merged into their neighbours, and so on; what is
    left of them is returned where it was. One pass takes about two fifths of the points, near and alike ones first, so
    that the gaps are smaller than in a random sample. Used like ``remove_statistical_outlier``.

    Parameters
    ----------
    cloud : open3d.geometry.PointCloud, open3d.t.geometry.PointCloud or (N, 3) array_like
        Not modified.
    passes : int
        Solves, each with a merging pass after it. They cost as much as the contraction of a skeleton.
    rings : RingBuilder, optional
        How the neighbourhoods are made. By default points are neither set aside nor denoised: outliers are for
        ``remove_statistical_outlier``.
    reducer : LPRReducer, optional

    Returns
    -------
    reduced : like cloud
        With colours, normals and all other attributes of the points that are left.
    kept : list of int, open3d.core.Tensor or (n,) int array
        Their indices in `cloud`, ascending: a list for a legacy cloud, an int64 tensor on its device for a tensor
        cloud. ``cloud.select_by_index(kept)`` is `reduced`, and with ``invert=True`` the points that were removed.

    Raises
    ------
    InvalidCloudError
        The cloud is a mesh, or the points cannot be skeletonised.
    InvalidParameterError

    Examples
    --------
    >>> from glsk_o3d.samples import torus
    >>> points = torus(1000).points
    >>> reduced, kept = remove_redundant_points(points)
    >>> bool((reduced == points[kept]).all()), 500 < len(kept) < 700
    (True, True)
    """
    if isinstance(passes, bool) or not isinstance(passes, (int, np.integer)) or passes < 1:
        raise InvalidParameterError(f"passes = {passes!r}: must be an int of at least 1")
    name, tensor = open3d_class(cloud)
    if name == "TriangleMesh":
        raise InvalidCloudError("points cannot be removed from a mesh: make a cloud of its vertices first")
    rings = RingBuilder(thin_to="all", outlier_factor=0, denoise=0) if rings is None else rings
    contractor = Contractor(
        reducer=LPRReducer() if reducer is None else reducer,
        reduce_above=0,
        max_iterations=int(passes),
        stop=lambda iterations: None,
    )
    state = (rings | contractor)(cloud)
    kept = np.sort(state.point_of_survivor)
    if name == "PointCloud" and not tensor:
        return cloud.select_by_index(kept), kept.tolist()
    if tensor:
        o3d = import_open3d()
        kept = o3d.core.Tensor(kept.astype(np.int64), device=cloud.device)
        return (cloud.select_by_index(kept) if name == "PointCloud" else cloud[kept]), kept
    return np.asarray(cloud)[kept], kept
