"""The things on a table, each with its skeleton: Open3D's plane and clusters, and ours."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..api import PipelineChoice, chosen_pipeline
from ..data.skeleton import Skeleton
from ..errors import InvalidCloudError
from ..geometry.vectors import finite_rows
from ..interop.clouds import cloud_points, to_point_cloud
from ..interop.packages import import_open3d
from ..parameters import check_number


@dataclass(frozen=True, eq=False)
class SceneObject:
    """A thing of a scene.

    Attributes
    ----------
    mask : (N,) bool array
        Which points of the scene are of it.
    skeleton : Skeleton
        With its verdict; of these points in their order.
    """

    mask: np.ndarray
    skeleton: Skeleton


def scene_objects(
    cloud: Any, *, height: float, gap: float, min_points: int = 100, pipeline: PipelineChoice = "default"
) -> tuple[np.ndarray, list[SceneObject]]:
    """The largest plane of a scene, and the things that do not lie in it, the largest first, each with its skeleton.

    Parameters
    ----------
    cloud : open3d.geometry.PointCloud, open3d.t.geometry.PointCloud or (N, 3) array_like
        Points that are not finite are of nothing.
    height : float
        Distance from the plane up to which a point is of it [cloud's units].
    gap : float
        Distance between things, and a few times the spacing of the points [cloud's units].
    min_points : int
        Smaller things, and those that cannot be skeletonised, are left out.
    pipeline : Pipeline, str or dict
        As of `skeletonize`.

    Returns
    -------
    plane : (4,) float array
        a x + b y + c z + d = 0.
    objects : list of SceneObject

    Raises
    ------
    InvalidCloudError, InvalidParameterError
        There are fewer than three finite points, or a length is not positive.
    """
    check_number("height", height, low=0, open_low=True)
    check_number("gap", gap, low=0, open_low=True)
    check_number("min_points", min_points, "int", low=4)
    run = chosen_pipeline(pipeline, {})
    places = cloud_points(cloud)
    finite = np.flatnonzero(finite_rows(places))
    if len(finite) < 3:
        raise InvalidCloudError(f"{len(finite)} of {len(places)} points are finite: three make a plane")
    import_open3d().utility.random.seed(0)
    scene = to_point_cloud(places[finite])
    plane, of_plane = scene.segment_plane(distance_threshold=height, ransac_n=3, num_iterations=500)
    rows = np.setdiff1d(np.arange(len(finite)), of_plane)
    if not len(rows):
        return np.asarray(plane), []
    above = scene.select_by_index(rows)
    label = np.array(above.cluster_dbscan(eps=gap, min_points=10), int)
    counts = np.bincount(label[label >= 0])
    objects = []
    for number in np.argsort(-counts, kind="stable"):
        mask = np.zeros(len(places), bool)
        mask[finite[rows[label == number]]] = True
        if counts[number] >= min_points:
            try:
                objects.append(SceneObject(mask, run(places[mask])))
            except InvalidCloudError:
                continue
    return np.asarray(plane), objects
