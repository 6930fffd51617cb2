"""Clouds of messages as arrays, skeletons as messages. Knows no ROS: whoever calls says how messages are made."""

from __future__ import annotations

from array import array
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from glsk_o3d import InvalidCloudError, Skeleton
from glsk_o3d.analysis.segmentation import branch_of_vertex
from glsk_o3d.io.colors import UNKNOWN_GREY, shades

Make = Callable[..., Any]
"""Makes a message: ``make("geometry_msgs/msg/Point", x=1.0)``. Fields that are not named have their defaults."""

REALS = {7: "f4", 8: "f8"}  # published: FLOAT32 and FLOAT64 of sensor_msgs/msg/PointField
FIELD_TYPES = {"<f4": 7, "<i4": 5}  # published: FLOAT32 and INT32
LINE_LIST, SPHERE_LIST, ADD, DELETEALL = 5, 7, 0, 3  # published: of visualization_msgs/msg/Marker
THINNER = 0.2  # fitted to the eye: width of lines over the median radius
UPRIGHT = 1e-6  # fitted: sine of the angle to the vertical below which a curve has no horizontal direction


def points_of(cloud: Any) -> np.ndarray:
    """The points of a ``sensor_msgs/msg/PointCloud2``.

    Parameters
    ----------
    cloud : PointCloud2
        Of rclpy, rosbags, or anything with its fields. x, y and z may stand anywhere in a point, as FLOAT32 or FLOAT64
        of either byte order; points and rows may be padded.

    Returns
    -------
    (N, 3) float64 array
        Row by row, in the units of the message; NaN and infinity pass through.

    Raises
    ------
    InvalidCloudError
        A field is missing or of another type, or sizes do not fit the data.
    """
    fields = {field.name: field for field in cloud.fields}
    missing = [name for name in "xyz" if name not in fields]
    if missing:
        raise InvalidCloudError(f"the cloud has no field {missing[0]}: its fields are {', '.join(fields) or 'none'}")
    other = [name for name in "xyz" if fields[name].datatype not in REALS]
    if other:
        raise InvalidCloudError(
            f"the field {other[0]} has the datatype {fields[other[0]].datatype}: it must be FLOAT32 (7) or FLOAT64 (8)"
        )
    size, row = cloud.point_step, cloud.row_step if cloud.height > 1 else cloud.width * cloud.point_step
    order = ">" if cloud.is_bigendian else "<"
    layout = {
        "names": list("xyz"),
        "formats": [order + REALS[fields[name].datatype] for name in "xyz"],
        "offsets": [fields[name].offset for name in "xyz"],
        "itemsize": size,
    }
    try:
        if row < cloud.width * size:
            raise ValueError("rows overlap")
        rows = np.ndarray((cloud.height, cloud.width), np.dtype(layout), buffer=cloud.data, strides=(row, size))
    except (TypeError, ValueError) as error:  # numpy checks offsets, steps and the length of the data
        raise InvalidCloudError(
            f"the cloud's sizes do not fit ({error}): {cloud.height} x {cloud.width} points, point_step {size}, "
            f"row_step {cloud.row_step}, {len(cloud.data)} bytes"
        ) from None
    return np.stack([rows[name] for name in "xyz"], axis=-1).reshape(-1, 3).astype(float)


def moved(points: np.ndarray, transform: Any) -> np.ndarray:
    """Points, (N, 3) float array, in the target frame of a ``geometry_msgs/msg/Transform``."""
    turn, shift = transform.rotation, transform.translation
    return Rotation.from_quat([turn.x, turn.y, turn.z, turn.w]).apply(points) + [shift.x, shift.y, shift.z]


def cloud_of(points: np.ndarray, header: Any, make: Make, branch: np.ndarray | None = None) -> Any:
    """Points as a ``sensor_msgs/msg/PointCloud2`` of one row, as FLOAT32, which all that show clouds read.

    Parameters
    ----------
    points : (N, 3) array_like
    header : std_msgs/msg/Header
    make : callable
        See `Make`.
    branch : (N,) int array, optional
        Of every point: a fourth field, as INT32.

    Returns
    -------
    PointCloud2
    """
    columns = dict(zip("xyz", np.asarray(points, "<f4").reshape(-1, 3).T, strict=True))
    if branch is not None:
        columns["branch"] = np.asarray(branch, "<i4")
    rows = np.rec.fromarrays(list(columns.values()), names=list(columns))
    fields = [
        make("sensor_msgs/msg/PointField", name=name, offset=4 * i, datatype=FIELD_TYPES[column.dtype.str], count=1)
        for i, (name, column) in enumerate(columns.items())
    ]
    return make(
        "sensor_msgs/msg/PointCloud2",
        header=header,
        height=1,
        width=len(rows),
        fields=fields,
        is_bigendian=False,
        point_step=rows.itemsize,
        row_step=rows.nbytes,
        data=array("B", rows.tobytes()),
        is_dense=bool(np.isfinite(points).all()),
    )


def markers_of(skeleton: Skeleton, header: Any, make: Make) -> Any:
    """A skeleton as a ``visualization_msgs/msg/MarkerArray``.

    Parameters
    ----------
    skeleton : Skeleton
    header : std_msgs/msg/Header
        Of the cloud: all markers have it.
    make : callable
        See `Make`.

    Returns
    -------
    MarkerArray
        First one that deletes all that were there before; then ``edges`` as a LINE_LIST, ``vertices`` and, larger and
        grey, ``junctions`` as SPHERE_LISTs, those that there are. Branches have colours in turn.
    """
    known = skeleton.radii[skeleton.radii > 0]
    width = THINNER * float(np.median(known)) if len(known) else 0.01
    ends = skeleton.vertices[skeleton.edges].reshape(-1, 3)
    lines = shades(skeleton, "branch", skeleton.branch_of_edge, skeleton.edges).repeat(2, axis=0)
    plain = np.flatnonzero(skeleton.degree < 3)
    balls = shades(skeleton, "branch", branch_of_vertex(skeleton)[plain], plain)
    forks = skeleton.vertices[skeleton.junctions]
    markers = [_marker(header, make, action=DELETEALL)]
    for name, kind, size, places, colors in (
        ("edges", LINE_LIST, width, ends, lines),
        ("vertices", SPHERE_LIST, 2 * width, skeleton.vertices[plain], balls),
        ("junctions", SPHERE_LIST, 4 * width, forks, np.tile(UNKNOWN_GREY, (len(forks), 1))),
    ):
        if len(places):
            points = [_point(make, row) for row in places.tolist()]
            shown = [make("std_msgs/msg/ColorRGBA", r=r, g=g, b=b, a=1.0) for r, g, b in colors.tolist()]
            scale = make("geometry_msgs/msg/Vector3", x=size, y=size, z=size)
            markers.append(
                _marker(header, make, ns=name, type=kind, action=ADD, scale=scale, points=points, colors=shown)
            )
    return make("visualization_msgs/msg/MarkerArray", markers=markers)


def frames_of(skeleton: Skeleton) -> np.ndarray:
    """A frame at every vertex: x along the curve, y horizontal, z as far up as it can be.

    Parameters
    ----------
    skeleton : Skeleton

    Returns
    -------
    (M, 4, 4) float array
        In the order of `skeleton.vertices`. x is that of `Skeleton.tangents`: in trees of the pipeline ``tree`` it
        leads away from the root. A vertex without edges is not turned, and on a vertical curve y is not.
    """
    x = np.where(skeleton.degree[:, None] > 0, skeleton.tangents, [1.0, 0, 0])
    y = np.column_stack([-x[:, 1], x[:, 0], 0 * x[:, 2]])
    flat = np.linalg.norm(y, axis=1, keepdims=True)
    y = np.divide(y, flat, out=np.tile([0.0, 1.0, 0.0], (len(y), 1)), where=flat > UPRIGHT)
    frames = np.tile(np.eye(4), (len(x), 1, 1))
    for column, vectors in enumerate((x, y, np.cross(x, y), skeleton.vertices)):
        frames[:, :3, column] = vectors
    return frames


def poses_of(frames: np.ndarray, header: Any, make: Make) -> Any:
    """Frames as a ``geometry_msgs/msg/PoseArray``.

    Parameters
    ----------
    frames : (P, 4, 4) float array
    header : std_msgs/msg/Header
    make : callable
        See `Make`.

    Returns
    -------
    PoseArray
    """
    turns = Rotation.from_matrix(frames[:, :3, :3]).as_quat() if len(frames) else np.empty((0, 4))
    poses = [_pose(make, place, turn) for place, turn in zip(frames[:, :3, 3].tolist(), turns.tolist(), strict=True)]
    return make("geometry_msgs/msg/PoseArray", header=header, poses=poses)


def _marker(header, make, **fields):
    pose = _pose(make, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
    return make("visualization_msgs/msg/Marker", header=header, pose=pose, **fields)


def _point(make, place):
    x, y, z = place
    return make("geometry_msgs/msg/Point", x=x, y=y, z=z)


def _pose(make, place, turn):
    x, y, z, w = turn
    turned = make("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w)
    return make("geometry_msgs/msg/Pose", position=_point(make, place), orientation=turned)
