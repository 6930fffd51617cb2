"""The points of anything that carries points; Open3D is imported when it is first needed, never for an array."""

import os
from typing import Any, NamedTuple

import numpy as np

from ..errors import InvalidCloudError
from .packages import import_open3d

__all__ = ["Cloud", "cloud_points"]

ACCEPTED = "an Open3D point cloud or triangle mesh (legacy or tensor) or an (N, 3) array of real numbers"
SAMPLE_COUNT = "sample_count"
"""The attribute of a tensor cloud that says how many points of a larger one each stands for."""
NO_ROWS = np.empty((0, 3))
MOST_COUNTED = np.nextafter(2.0**63, 0)  # derived: the last float that int64 holds


class Cloud:
    """What a filter of clouds `consumes` or `produces`: anything that `cloud_points` takes. It has no instances.

    Examples
    --------
    >>> from glsk_o3d import Sampler
    >>> Sampler.consumes is Cloud
    True
    """


class CountedPoints(NamedTuple):
    """A sample without Open3D: points, and how many points of a larger cloud each of them stands for."""

    points: np.ndarray  # (N, 3)
    counts: np.ndarray  # (N,)


class SurfaceMesh(NamedTuple):
    """A mesh without Open3D: vertices, and triangles between them; without triangles it is a cloud."""

    vertices: np.ndarray  # (N, 3)
    triangles: np.ndarray  # (T, 3) int


class _Content(NamedTuple):
    """The arrays of what carries points, unchecked."""

    points: Any
    triangles: Any = ()
    counts: Any = None


def surface_mesh(cloud: Any) -> SurfaceMesh:
    """The points as of `cloud_points`, and the triangles; InvalidCloudError also for a corner that is no vertex."""
    points, triangles = cloud_points(cloud), np.asarray(_content(cloud).triangles, np.int64).reshape(-1, 3)
    if not ((triangles >= 0) & (triangles < len(points))).all():
        raise InvalidCloudError(f"a triangle has a corner that is none of the {len(points)} vertices of its mesh")
    return SurfaceMesh(points, triangles)


def cloud_points(cloud: Any) -> np.ndarray:
    """The points of anything that carries points.

    Parameters
    ----------
    cloud : open3d.geometry.PointCloud, TriangleMesh, open3d.t.geometry.PointCloud, TriangleMesh or (N, 3) array_like
        Of a mesh the vertices are taken. Tensors may have any real dtype and live on any device.

    Returns
    -------
    (N, 3) float64 array
        C-contiguous and in the units of `cloud`: always a copy. NaN and infinity pass through.

    Raises
    ------
    InvalidCloudError
        `cloud` is something else, has no points, or is no (N, 3) array of real numbers.

    Examples
    --------
    >>> cloud_points([[0, 0, 1], [2, 3, 4]])
    array([[0., 0., 1.],
           [2., 3., 4.]])
    """
    if isinstance(cloud, (str, bytes, os.PathLike)):
        raise InvalidCloudError(f"a cloud is not a file name ({cloud!r}): read it first with glsk_o3d.read_cloud")
    if isinstance(cloud, np.ma.MaskedArray):
        raise InvalidCloudError("a cloud cannot be a masked array: drop the masked points, or fill them with NaN")
    points = _content(cloud).points
    try:
        array = np.asarray(points)
    except Exception as error:  # ragged lists, and whatever a foreign __array__ raises
        raise InvalidCloudError(f"a {type(cloud).__name__} is no cloud ({error}): give {ACCEPTED}") from error
    if array.size == 0 and array.dtype.kind in "iuf":
        raise InvalidCloudError(f"the cloud ({type(cloud).__name__}) is empty")
    if array.dtype.kind not in "iuf" or array.ndim != 2 or array.shape[1] != 3:
        raise InvalidCloudError(
            f"a {type(cloud).__name__} of shape {array.shape} and dtype {array.dtype} is no cloud: give {ACCEPTED}"
        )
    return np.array(array, np.float64, order="C")


def cloud_counts(cloud: Any, finite: np.ndarray) -> tuple[np.ndarray | None, int, int]:
    """How many points of a larger cloud each of the `finite` points, (N,) bool array, of a sample stands for.

    (n,) float array, the attribute ``sample_count`` of a tensor cloud, or those of CountedPoints, None if there are
    none; and two ints, the sums for the finite points and for all others. InvalidCloudError if they are no counts.
    """
    counts, n = _content(cloud).counts, len(finite)
    if counts is None:
        return None, int(finite.sum()), int((~finite).sum())
    counts = counts.astype(float)
    if not (counts.shape in ((n, 1), (n,)) and (counts >= 1).all() and counts.sum() <= MOST_COUNTED):
        raise InvalidCloudError(
            f"the cloud's attribute {SAMPLE_COUNT} of shape {counts.shape} must be the number of points that each "
            f"of the {n} represents: at least 1, and less than 2^63 together; rename an attribute of another meaning"
        )
    counts = counts.reshape(-1)
    return counts[finite], int(counts[finite].sum()), int(counts[~finite].sum())


def _content(cloud: Any) -> _Content:
    """The arrays in a cloud, which may be `cloud` itself; Open3D's classes by name, so as not to import it."""
    if isinstance(cloud, CountedPoints):
        return _Content(cloud.points, counts=cloud.counts)
    if isinstance(cloud, SurfaceMesh):
        return _Content(*cloud)
    name, tensor = open3d_class(cloud)
    if name == "" or name.endswith("Vector"):
        return _Content(cloud)
    if name == "Tensor":
        return _Content(cloud.cpu().numpy())
    if name not in ("PointCloud", "TriangleMesh"):
        raise InvalidCloudError(f"an Open3D {name} is no cloud: give {ACCEPTED}")
    if not tensor:
        return _Content(cloud.points) if name == "PointCloud" else _Content(cloud.vertices, cloud.triangles)
    if name == "PointCloud":
        return _Content(_array(cloud.point, "positions", NO_ROWS), counts=_array(cloud.point, SAMPLE_COUNT, None))
    return _Content(_array(cloud.vertex, "positions", NO_ROWS), _array(cloud.triangle, "indices", NO_ROWS))


def _array(attributes: Any, name: str, default: np.ndarray | None) -> np.ndarray | None:
    """An attribute of a tensor geometry, or the default if it has none of this name."""
    return attributes[name].cpu().numpy() if name in attributes else default


def open3d_class(thing: Any) -> tuple[str, bool]:
    """The name of something's Open3D class, empty if it has none, and whether that is of the tensor API."""
    for cls in type(thing).__mro__:
        package, *_ = parts = cls.__module__.split(".")
        if package == "open3d":
            return cls.__name__, "t" in parts or "core" in parts
    return "", False


def to_point_cloud(points: np.ndarray) -> Any:
    """Points, (N, 3) array_like, as an ``open3d.geometry.PointCloud``."""
    o3d = import_open3d()
    return o3d.geometry.PointCloud(o3d.utility.Vector3dVector(np.ascontiguousarray(points, float).reshape(-1, 3)))
