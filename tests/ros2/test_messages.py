"""Clouds of messages as arrays, skeletons as messages; messages are those of rosbags, as they come out of CDR."""

import math
import struct
from dataclasses import replace

import numpy as np
import pytest
from glsk_o3d_ros.messages import cloud_of, frames_of, markers_of, moved, points_of, poses_of
from scipy.spatial.transform import Rotation

from glsk_o3d import InvalidCloudError, pipelines, samples
from glsk_o3d.editing import reroot

CLOUD, MARKERS, POSES = (
    "sensor_msgs/msg/PointCloud2",
    "visualization_msgs/msg/MarkerArray",
    "geometry_msgs/msg/PoseArray",
)


@pytest.fixture
def packed(make_message, header):
    """A cloud of points, byte by byte: fields are (name, offset, datatype)."""

    def pack(points, fields, step, *, height=1, padding=0, big=False, **changes):
        points = np.asarray(points, float)
        width = len(points) // height
        row = width * step + padding
        data = bytearray(b"\xa5" * (height * row))
        for i, point in enumerate(points):
            for axis, value in zip("xyz", point, strict=True):
                for name, offset, datatype in fields:
                    if name == axis:
                        place = i // width * row + i % width * step + offset
                        struct.pack_into(("<>"[big]) + ("d" if datatype == 8 else "f"), data, place, value)
        fields = [
            make_message("sensor_msgs/msg/PointField", name=name, offset=offset, datatype=datatype, count=1)
            for name, offset, datatype in fields
        ]
        facts = dict(header=header, height=height, width=width, fields=fields, is_bigendian=big, point_step=step)
        facts |= dict(row_step=row, data=np.frombuffer(data, np.uint8), is_dense=False)
        return make_message(CLOUD, **(facts | changes))

    return pack


PLAIN = [("x", 0, 7), ("y", 4, 7), ("z", 8, 7)]
CAMERA = [("rgb", 16, 7), ("z", 8, 7), ("x", 0, 7), ("y", 4, 7)]
MIXED = [("intensity", 0, 2), ("y", 1, 8), ("x", 13, 7), ("z", 19, 8)]


@pytest.mark.parametrize(
    ("fields", "step", "height", "padding", "big"),
    [(PLAIN, 12, 1, 0, False), (CAMERA, 32, 3, 0, True), (MIXED, 29, 3, 5, False)],
)
def test_points_are_read_from_any_layout(packed, sent, make_message, fields, step, height, padding, big):
    points = np.random.default_rng(1).integers(-999, 999, (12, 3)) / 64  # exact in FLOAT32
    points[4] = np.nan
    points[7, 1] = np.inf
    cloud = packed(points, fields, step, height=height, padding=padding, big=big)
    actual = points_of(sent(cloud, CLOUD))
    assert actual.dtype == np.float64
    np.testing.assert_array_equal(actual, points)
    for data in (cloud.data.tobytes(), bytearray(cloud.data)):  # as rclpy and others have it
        np.testing.assert_array_equal(points_of(replace(cloud, data=data)), points)
    assert points_of(packed(np.empty((0, 3)), PLAIN, 12)).shape == (0, 3)
    back = sent(cloud_of(points, cloud.header, make_message), CLOUD)
    np.testing.assert_array_equal(points_of(back), points)
    assert (back.width, back.height, back.is_dense, back.header) == (12, 1, False, cloud.header)
    labelled = sent(cloud_of(points, cloud.header, make_message, np.arange(12) - 1), CLOUD)
    np.testing.assert_array_equal(points_of(labelled), points)
    assert [(it.name, it.offset, it.datatype, it.count) for it in labelled.fields[2:]] == [
        ("z", 8, 7, 1),
        ("branch", 12, 5, 1),
    ]
    assert labelled.data.view("<i4")[3::4].tolist() == list(range(-1, 11))


def test_points_move_to_the_target_frame(make_message):
    quarter = make_message("geometry_msgs/msg/Quaternion", z=math.sqrt(0.5), w=math.sqrt(0.5))
    shift = make_message("geometry_msgs/msg/Vector3", x=1.0, y=2.0, z=3.0)
    transform = make_message("geometry_msgs/msg/Transform", rotation=quarter, translation=shift)
    np.testing.assert_allclose(moved(np.eye(3), transform), [[1, 3, 3], [0, 2, 3], [1, 2, 4]], atol=1e-15)
    assert moved(np.empty((0, 3)), transform).shape == (0, 3)


@pytest.mark.parametrize(
    ("fields", "changes", "message"),
    [
        ([("x", 0, 7), ("y", 4, 7)], {}, "no field z"),
        ([("x", 0, 7), ("y", 4, 5), ("z", 8, 7)], {}, "datatype 5"),
        (PLAIN, dict(width=9), "sizes"),
        (PLAIN, dict(row_step=12), "rows"),
    ],
)
def test_clouds_that_cannot_be_read_say_why(packed, fields, changes, message):
    with pytest.raises(InvalidCloudError, match=message):
        points_of(packed(np.zeros((4, 3)), fields, 12, height=2, **changes))


# ------------------------------------------------------------------------------------------------------------- markers


def test_markers_show_edges_vertices_and_junctions(skeleton, make_message, header, sent, rows):
    markers = sent(markers_of(skeleton, header, make_message), MARKERS).markers
    first, *shown = markers
    assert (first.action, first.ns, first.points) == (3, "", [])  # without a namespace it deletes all
    assert all(marker.header == header and marker.action == 0 for marker in shown)
    assert all((marker.pose.orientation.w, marker.pose.position.x) == (1, 0) for marker in markers)
    actual = {marker.ns: rows(marker.points) for marker in shown}
    expected = {
        "edges": skeleton.vertices[skeleton.edges].reshape(-1, 3),
        "vertices": skeleton.vertices[skeleton.degree < 3],
        "junctions": skeleton.vertices[skeleton.junctions],
    }
    assert list(actual) == [name for name, places in expected.items() if len(places)]
    for name, places in actual.items():
        np.testing.assert_array_equal(places, expected[name])
    assert [marker.type for marker in shown] == [5 if marker.ns == "edges" else 7 for marker in shown]
    for marker in shown:
        assert len(marker.colors) == len(marker.points)
        assert all(color.a == 1 for color in marker.colors)
        assert marker.scale.x == marker.scale.y == marker.scale.z > 0


# --------------------------------------------------------------------------------------------------------------- poses


def test_frames_are_right_handed_and_level(skeleton):
    frames = frames_of(skeleton)
    turns = frames[:, :3, :3]
    np.testing.assert_allclose(turns @ turns.transpose(0, 2, 1), np.tile(np.eye(3), (len(turns), 1, 1)), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(turns), 1)
    np.testing.assert_array_equal(frames[:, :3, 3], skeleton.vertices)
    assert (frames[:, 2, 1] == 0).all()  # y is level
    assert (frames[:, 2, 2] >= 0).all()  # z is up


def test_x_is_along_the_curve_at_a_junction_along_its_longest_branch(make, dot):
    line = make(np.array([[0, 0, 0], [1, 1, 0], [2, 2, 0], [3, 3, 0.0]]), [[0, 1], [1, 2], [2, 3]])
    half = math.sqrt(0.5)
    np.testing.assert_allclose(frames_of(line)[:, :3, :2], np.tile([[half, -half], [half, half], [0, 0]], (4, 1, 1)))
    upright = replace(line, vertices=line.vertices[:, [2, 2, 0]])
    np.testing.assert_allclose(frames_of(upright)[:, :3, :3], np.tile([[0, 0, -1], [0, 1, 0], [1, 0, 0]], (4, 1, 1)))
    bent = make(np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0.0]]), [[0, 1], [1, 2]])
    np.testing.assert_allclose(frames_of(bent)[:, :3, 0], [[1, 0, 0], [half, half, 0], [0, 1, 0]])
    fork = make(np.array([[0, 0, 0], [1, 0, 0], [0, 5, 0], [0, 0, -2.0]]), [[0, 1], [0, 2], [0, 3]])
    np.testing.assert_allclose(frames_of(fork)[0, :3, 0], [0, 1, 0])
    np.testing.assert_array_equal(frames_of(dot)[0, :3, :3], np.eye(3))


def test_in_a_tree_x_leads_away_from_the_root():
    tree = reroot(pipelines.tree()(samples.tree(4000, forks=2, seed=3).points), "z")
    assert len(tree.junctions)
    into = np.full(len(tree.vertices), -1)
    into[tree.edges[:, 1]] = tree.edges[:, 0]
    inner = np.flatnonzero(tree.degree <= 2)[1:]
    step = tree.vertices[inner] - tree.vertices[into[inner]]
    assert ((step * frames_of(tree)[inner, :3, 0]).sum(axis=1) > 0).all()


def test_poses_are_the_frames(skeleton, make_message, header, sent, rows):
    frames = frames_of(skeleton)
    message = sent(poses_of(frames, header, make_message), POSES)
    assert message.header == header
    np.testing.assert_array_equal(rows(pose.position for pose in message.poses), skeleton.vertices)
    turns = [[q.x, q.y, q.z, q.w] for q in (pose.orientation for pose in message.poses)]
    np.testing.assert_allclose(Rotation.from_quat(turns).as_matrix(), frames[:, :3, :3], atol=1e-12)
    assert sent(poses_of(np.empty((0, 4, 4)), header, make_message), POSES).poses == []
