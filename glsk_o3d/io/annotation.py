"""Results as attributes of Open3D's tensor clouds, which keep them through selections, sampling and files."""

from typing import Any

import numpy as np

from ..analysis.branches import branch_table
from ..analysis.segmentation import branch_of_point, vertex_of_cloud
from ..data.skeleton import Skeleton
from ..interop.clouds import open3d_class
from ..interop.packages import import_open3d
from .colors import ColorChoice, shades


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
    found = labels(skeleton, points, vertex, color)
    given: Any = points if cloud is None else cloud
    o3d = import_open3d()
    name, tensor = open3d_class(given)
    if name in ("PointCloud", "TriangleMesh"):
        kind = getattr(o3d.t.geometry, name)
        geometry = given.clone() if tensor else kind.from_legacy(given, o3d.core.float64)
    else:
        array = given.cpu().numpy() if name == "Tensor" else np.asarray(given)
        array = np.array(array, np.float32 if array.dtype == np.float32 else np.float64, order="C")
        geometry = o3d.t.geometry.PointCloud(o3d.core.Tensor(array))
    held = geometry.vertex if name == "TriangleMesh" else geometry.point
    positions = held.positions
    own = positions.dtype if positions.dtype in (o3d.core.float32, o3d.core.float64) else o3d.core.float64
    if "colors" in found and name == "TriangleMesh":
        found["colors"] = found["colors"] / 255  # Open3D writes meshes in other colours than floats white
    for key, values in found.items():
        values = np.ascontiguousarray(values).reshape(len(values), -1)
        held[key] = o3d.core.Tensor(values, own if values.dtype.kind == "f" else None, positions.device)
    return geometry


def labels(
    skeleton: Skeleton, points: np.ndarray, vertex: np.ndarray, color: ColorChoice | None = None
) -> dict[str, np.ndarray]:
    """What `annotate` says of points that belong to vertices, -1 for none: (N,) arrays by name; integers are int32, and
    ``colors`` (N, 3) uint8, if asked for.
    """
    branch = branch_of_point(skeleton, points, vertex)
    orders = np.where(branch >= 0, branch_table(skeleton).order[branch], -1)
    whole = {"skeleton_vertex": vertex, "branch": branch, "order": orders}
    found = {name: values.astype(np.int32) for name, values in whole.items()}
    for name, values in (("radius", skeleton.radii), ("confidence", skeleton.confidence)):
        found[name] = np.where(vertex >= 0, values[vertex], np.nan)
    if color is not None:
        found["colors"] = np.round(255 * shades(skeleton, color, branch, vertex)).astype(np.uint8)
    return found
