"""Results as attributes of Open3D's tensor clouds, which keep them through selections, sampling and files."""

from typing import Any

import numpy as np

from ..analysis.branches import branch_table
from ..analysis.segmentation import branch_of_point, vertex_of_cloud
from ..data.skeleton import Skeleton
from ..interop.clouds import open3d_class
from ..interop.packages import import_open3d
from .colors import ColorChoice, shades
from .scan import color_bytes


def annotate(skeleton: Skeleton, cloud: Any = None, *, color: ColorChoice | None = None) -> Any:
    """A copy of a cloud with the vertex, branch and radius of every point.

    Beside the attributes of the original it has

    - ``skeleton_vertex`` (N, 1) int32: the vertex it belongs to, as in `Skeleton.vertex_of_point`;
    - ``branch`` (N, 1) int32: the row of `glsk_o3d.analysis.branch_table`, as from `glsk_o3d.analysis.segment`;
    - ``order`` (N, 1) int32: that of the branch in that table, 0 for axes at the root;
    - ``radius`` and ``confidence`` (N, 1), of the type of the positions: those of the vertex.

    Points that are not finite have -1 or NaN. Attributes of these names are replaced.

    Parameters
    ----------
    skeleton : Skeleton
    cloud : cloud, optional
        By default that of the skeleton. Points of another cloud have the attributes of its nearest point, or of the
        nearest place on the curve if the skeleton's file held no cloud.
    color : {"branch", "order", "radius", "confidence", "support"} or three floats in [0, 1], optional
        What the colours of the points show, or the one colour of all.

    Returns
    -------
    open3d.t.geometry.PointCloud or TriangleMesh
        On the device of `cloud` and of its type. Legacy clouds cannot hold attributes: they and arrays become tensor
        clouds (float32 if the array was, else float64), with normals and colours; ``.to_legacy()`` leads back.

    Raises
    ------
    InvalidCloudError
    InvalidParameterError
        The skeleton is empty, or the colour is unknown.
    MissingPackageError

    Examples
    --------
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import torus
    >>> ring = skeletonize(torus(1000).points)
    >>> annotate(ring).point.branch.shape
    SizeVector[1000, 1]
    """
    points, vertex = vertex_of_cloud(skeleton, cloud)
    named = labels(skeleton, points, vertex, color)
    geometry = _tensor_geometry(points if cloud is None else cloud)
    core = import_open3d().core
    attributes, is_mesh = (geometry.vertex, True) if "Mesh" in type(geometry).__name__ else (geometry.point, False)
    positions = attributes.positions
    real = positions.dtype if positions.dtype in (core.float32, core.float64) else core.float64
    if "colors" in named and is_mesh:
        named["colors"] = named["colors"] / 255  # Open3D writes meshes in other colours than floats white
    for key, values in named.items():
        values = np.ascontiguousarray(values).reshape(len(values), -1)
        attributes[key] = core.Tensor(values, real if values.dtype.kind == "f" else None, positions.device)
    return geometry


def _tensor_geometry(cloud: Any) -> Any:
    """A cloud or mesh as a tensor cloud or mesh of its own."""
    o3d, (name, tensor) = import_open3d(), open3d_class(cloud)
    if name in ("PointCloud", "TriangleMesh"):
        return cloud.clone() if tensor else getattr(o3d.t.geometry, name).from_legacy(cloud, o3d.core.float64)
    array = cloud.cpu().numpy() if name == "Tensor" else np.asarray(cloud)
    kind = np.float32 if array.dtype == np.float32 else np.float64
    return o3d.t.geometry.PointCloud(o3d.core.Tensor(np.array(array, kind, order="C")))


def labels(
    skeleton: Skeleton, points: np.ndarray, vertex: np.ndarray, color: ColorChoice | None = None
) -> dict[str, np.ndarray]:
    """The attributes of `annotate` for points that belong to vertices, -1 for none: (N,) arrays by name.

    Integers are int32; ``colors`` are (N, 3) uint8, if asked for.
    """
    branch = branch_of_point(skeleton, points, vertex)
    orders = np.where(branch >= 0, branch_table(skeleton).order[branch], -1)
    integers = {"skeleton_vertex": vertex, "branch": branch, "order": orders}
    named = {name: values.astype(np.int32) for name, values in integers.items()}
    for name, values in (("radius", skeleton.radii), ("confidence", skeleton.confidence)):
        named[name] = np.where(vertex >= 0, values[vertex], np.nan)
    if color is not None:
        named["colors"] = color_bytes(shades(skeleton, color, branch, vertex))
    return named
