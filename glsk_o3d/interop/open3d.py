"""Between Open3D and arrays. Open3D itself is imported when it is first needed, never to handle an array."""

from __future__ import annotations

import importlib
import os
import re
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, requires
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InvalidCloudError, MissingPackageError

if TYPE_CHECKING:
    from ..skeleton import Skeleton

ACCEPTED = "an Open3D point cloud or triangle mesh (legacy or tensor) or an (N, 3) array of real numbers"
MOST_NEIGHBOURS = 30  # within a radius without a limit of its own: as many as Open3D's KDTreeSearchParamKNN has

_DEBIAN = {  # shared library -> Debian package, where the one does not follow from the other
    "libGL": "libgl1",
    "libEGL": "libegl1",
    "libGLX": "libglx0",
    "libOpenGL": "libopengl0",
    "libgomp": "libgomp1",
    "libusb-1.0": "libusb-1.0-0",
    "libX11": "libx11-6",
    "libXext": "libxext6",
    "libXrender": "libxrender1",
    "libSM": "libsm6",
    "libICE": "libice6",
    "libglib-2.0": "libglib2.0-0",
    "libc++": "libc++1",
    "libc++abi": "libc++abi1",
}


def require(package: str, install: str | None = None) -> Any:
    """Import an optional package, or say what to install: it by itself, in the version that this package asks for.

    Parameters
    ----------
    package : str
        Name of the module.
    install : str, optional
        What pip calls it, if it is not the module's name.

    Returns
    -------
    module

    Raises
    ------
    MissingPackageError
        The package is not there, or it needs a shared library which is not; the message names the Debian package.
    """
    asked = install or package
    try:
        return importlib.import_module(package)
    except (ImportError, OSError) as error:
        library = re.search(r"(lib[\w.+-]+?)\.so[\w.]*: cannot open shared object file", str(error))
        if library:
            debian = _DEBIAN.get(library[1])
            cure = f"apt-get install {debian}" if debian else f"install the system library {library[1]}"
        elif isinstance(error, ModuleNotFoundError) and error.name == package.partition(".")[0]:
            cure = f'pip install "{_versioned(asked)}"'
        else:
            cure = f'its installation is damaged ({error}): pip install --force-reinstall "{_versioned(asked)}"'
        need = f"needs {library[0].partition(':')[0]}, which this machine lacks" if library else "cannot be imported"
        raise MissingPackageError(f"{package} {need}: {cure}", name=package) from error


def _versioned(package: str) -> str:
    with suppress(PackageNotFoundError):  # run from a folder, not installed
        for line in requires("glsk-o3d") or ():
            if re.split(r"[^\w.-]", line)[0] == package:
                return line.partition(";")[0].strip()
    return package


def import_open3d() -> Any:
    """The module ``open3d``.

    Returns
    -------
    module

    Raises
    ------
    MissingPackageError
        Open3D or a shared library that it needs is not installed; the message says what to install.
    """
    return require("open3d")


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
    try:
        array = np.asarray(_held(cloud))
    except InvalidCloudError:
        raise
    except Exception as error:  # ragged lists, and whatever a foreign __array__ raises
        raise InvalidCloudError(f"a {type(cloud).__name__} is no cloud ({error}): give {ACCEPTED}") from error
    if array.size == 0 and array.dtype.kind in "iuf":
        raise InvalidCloudError(f"the cloud ({type(cloud).__name__}) is empty")
    if array.dtype.kind not in "iuf" or array.ndim != 2 or array.shape[1] != 3:
        raise InvalidCloudError(
            f"a {type(cloud).__name__} of shape {array.shape} and dtype {array.dtype} is no cloud: give {ACCEPTED}"
        )
    return np.array(array, np.float64, order="C")


def _held(cloud):
    """The array-like in an Open3D object, or `cloud` itself; knows Open3D's classes by name, so as not to import it."""
    name, tensor = open3d_class(cloud)
    if name == "Tensor":
        return cloud.cpu().numpy()
    if name in ("PointCloud", "TriangleMesh"):
        field = "point" if name == "PointCloud" else "vertex"
        if not tensor:
            return cloud.points if field == "point" else cloud.vertices
        attributes = getattr(cloud, field)
        return attributes.positions.cpu().numpy() if "positions" in attributes else np.empty((0, 3))
    if name == "" or name.endswith("Vector"):
        return cloud
    raise InvalidCloudError(f"an Open3D {name} is no cloud: give {ACCEPTED}")


def open3d_class(thing: Any) -> tuple[str, bool]:
    """The name of the Open3D class that something is of, and whether it is one of the tensor API.

    Parameters
    ----------
    thing : object

    Returns
    -------
    name : str
        Empty if it is not Open3D's.
    tensor : bool
    """
    for cls in type(thing).__mro__:
        package, *_ = parts = cls.__module__.split(".")
        if package == "open3d":
            return cls.__name__, "t" in parts or "core" in parts
    return "", False


def search_parameters(given: Any) -> dict[str, Any]:
    """The number of neighbours and the radius in Open3D's ``KDTreeSearchParam*``.

    Parameters
    ----------
    given : object

    Returns
    -------
    dict
        With ``k``, and with ``radius`` (float) if there is one; for a radius alone, `k` is `MOST_NEIGHBOURS`. Empty for
        anything else.
    """
    name, _ = open3d_class(given)
    if name == "KDTreeSearchParamKNN":
        return {"k": int(given.knn)}
    if name == "KDTreeSearchParamHybrid":
        return {"k": int(given.max_nn), "radius": float(given.radius)}
    if name == "KDTreeSearchParamRadius":
        return {"k": MOST_NEIGHBOURS, "radius": float(given.radius)}
    return {}


def to_point_cloud(points: np.ndarray) -> Any:
    """Points as an ``open3d.geometry.PointCloud``.

    Parameters
    ----------
    points : (N, 3) array_like

    Returns
    -------
    open3d.geometry.PointCloud

    Raises
    ------
    MissingPackageError
    """
    o3d = import_open3d()
    return o3d.geometry.PointCloud(o3d.utility.Vector3dVector(_rows(points, float, 3)))


def to_line_set(skeleton: Skeleton, color: Any = (0.85, 0.1, 0.1)) -> Any:
    """A skeleton as a legacy line set, ready for ``draw_geometries``.

    Parameters
    ----------
    skeleton : Skeleton
    color : {"branch", "radius", "confidence"} or three floats in [0, 1]
        What the colours of the edges show, or the one colour of all; see `glsk_o3d.interop.colors.shades`.

    Returns
    -------
    open3d.geometry.LineSet
        Points and lines in the order of `skeleton.vertices` and `skeleton.edges`.

    Raises
    ------
    InvalidParameterError
        The colour is unknown.
    MissingPackageError
    """
    o3d = import_open3d()
    lines = o3d.geometry.LineSet()
    lines.points = o3d.utility.Vector3dVector(_rows(skeleton.vertices, float, 3))
    lines.lines = o3d.utility.Vector2iVector(_rows(skeleton.edges, np.int32, 2))
    lines.colors = o3d.utility.Vector3dVector(_edge_colors(skeleton, color))
    return lines


def to_tensor_line_set(skeleton: Skeleton, color: Any = None) -> Any:
    """A skeleton as a tensor line set.

    Parameters
    ----------
    skeleton : Skeleton
    color : {"branch", "radius", "confidence"} or three floats in [0, 1], optional
        As for `to_line_set`; by default there are no colours.

    Returns
    -------
    open3d.t.geometry.LineSet
        On the CPU: ``point.positions`` (M, 3), ``point.radius`` and ``point.confidence`` (M, 1) float64, and
        ``line.indices`` (E, 2) int64 and ``line.branch`` (E, 1) int32; with a color, ``line.colors`` (E, 3) float64.

    Raises
    ------
    InvalidParameterError
        The colour is unknown.
    MissingPackageError
    """
    from ..analysis.segmentation import branch_of_edge

    o3d = import_open3d()
    lines = o3d.t.geometry.LineSet()
    lines.point.positions = o3d.core.Tensor(_rows(skeleton.vertices, float, 3))
    lines.point.radius = o3d.core.Tensor(_rows(skeleton.radii, float, 1))
    lines.point.confidence = o3d.core.Tensor(_rows(skeleton.confidence, float, 1))
    lines.line.indices = o3d.core.Tensor(_rows(skeleton.edges, np.int64, 2))
    lines.line.branch = o3d.core.Tensor(_rows(branch_of_edge(skeleton), np.int32, 1))
    if color is not None:
        lines.line.colors = o3d.core.Tensor(_rows(_edge_colors(skeleton, color), float, 3))
    return lines


def _edge_colors(skeleton, color):
    from ..analysis.segmentation import branch_of_edge
    from .colors import shades

    return shades(skeleton, color, branch_of_edge(skeleton), skeleton.edges)


def _rows(array, dtype, columns):
    return np.ascontiguousarray(array, dtype).reshape(-1, columns)
