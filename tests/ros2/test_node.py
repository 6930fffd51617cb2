"""The node, with an rclpy that is none: from a cloud that comes in to what it publishes; and bags, offline."""

import json
import time
from types import SimpleNamespace

import numpy as np
import pytest
from glsk_o3d_ros import bag
from glsk_o3d_ros.messages import cloud_of, moved, points_of
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import StoragePlugin, Writer
from scipy.spatial.transform import Rotation

import glsk_o3d as glsk
from glsk_o3d import samples
from glsk_o3d.analysis import grasp_candidates, segment

CLOUD = "sensor_msgs/msg/PointCloud2"
SECOND = 10**9


@pytest.fixture(scope="module")
def points():
    """A tube with noise, 600 points as floats of 32 bits."""
    return samples.tube(600, length=2.0, radius=0.2, noise=0.002).points.astype(np.float32).astype(float)


@pytest.fixture
def cloud(points, header, make_message):
    holes = np.concatenate([points[:100], np.full((7, 3), np.nan), points[100:]])
    return cloud_of(holes, header, make_message)


@pytest.fixture
def expected(points):
    return glsk.skeletonize(points)


def line_ends(markers, rows):
    (edges,) = [marker for marker in markers.markers if marker.ns == "edges"]
    return rows(edges.points)


def branches(labels):
    """The field of labels that is no coordinate."""
    return np.frombuffer(labels.data.tobytes(), "<i4")[3::4]


def test_a_cloud_comes_in_and_markers_and_poses_go_out(ros, cloud, expected, header, sent, rows):
    node = ros.node()
    node.on_cloud(cloud)
    assert [topic for topic, _ in node.published] == ["~/markers", "~/poses", "~/labels"]
    markers, poses, labels = (message for _, message in node.published)
    markers, poses = sent(markers, bag.RESULTS["markers"]), sent(poses, bag.RESULTS["poses"])
    np.testing.assert_array_equal(line_ends(markers, rows), expected.vertices[expected.edges].reshape(-1, 3))
    np.testing.assert_array_equal(rows(pose.position for pose in poses.poses), expected.vertices)
    assert poses.header == header
    assert {marker.header.frame_id for marker in markers.markers} == {"camera"}
    assert sent(labels, CLOUD).header == header
    np.testing.assert_array_equal(points_of(labels), expected.points)
    np.testing.assert_array_equal(branches(labels), segment(expected))
    assert node.logged == []
    assert {topic: (of.__msgtype__, qos) for topic, (of, qos) in node.topics.items() if qos} == {
        "~/input": (CLOUD, dict(depth=1, reliability="best effort")),
        "~/markers": (bag.RESULTS["markers"], dict(depth=1, durability="kept")),
        "~/poses": (bag.RESULTS["poses"], dict(depth=1, durability="kept")),
        "~/labels": (CLOUD, dict(depth=1, durability="kept")),
    }


def test_parameters_choose_pipeline_and_settings(ros, cloud, points, tmp_path, rows):
    other = glsk.skeletonize(points, "tree", k=20)
    node = ros.node(pipeline="tree", set=["k=20"])
    node.on_cloud(cloud)
    np.testing.assert_array_equal(line_ends(node.published[0][1], rows), other.vertices[other.edges].reshape(-1, 3))
    glsk.save_recipe(glsk.pipelines.tree().with_options(k=20), tmp_path / "mine.json")
    same = ros.node(pipeline=str(tmp_path / "mine.json"))
    same.on_cloud(cloud)
    np.testing.assert_array_equal(line_ends(same.published[0][1], rows), line_ends(node.published[0][1], rows))


def test_with_an_opening_poses_are_grasps_above_a_table(ros, cloud, expected, rows):
    for options in ({}, dict(plane=[0.0, 0.0, 1.0, 0.25])):
        node = ros.node(opening=0.6, **options)
        node.on_cloud(cloud)
        grasps = grasp_candidates(expected, 0.6, **options)
        assert len(grasps) > 8
        poses = node.published[1][1].poses
        np.testing.assert_array_equal(rows(pose.position for pose in poses), grasps.position)
        turns = Rotation.from_quat([[q.x, q.y, q.z, q.w] for q in (pose.orientation for pose in poses)]).as_matrix()
        np.testing.assert_allclose(turns[:, :, 0], grasps.closing, atol=1e-12)
        np.testing.assert_allclose(turns[:, :, 2], grasps.approach, atol=1e-12)
    assert len(grasps) < len(grasp_candidates(expected, 0.6))
    node = ros.node(opening=0.1)
    node.on_cloud(cloud)
    (_, markers), (_, poses), _ = node.published
    assert (len(markers.markers) >= 3, poses.poses) == (True, [])
    (warning,) = node.logged
    assert "too wide" in warning


@pytest.mark.parametrize("budget", [dict(max_places=2), dict(seconds=1e-9), dict(max_places=3, seconds=1e6)])
def test_grasps_have_a_budget(ros, cloud, expected, rows, budget):
    node = ros.node(opening=0.6, **budget)
    node.on_cloud(cloud)
    grasps = grasp_candidates(expected, 0.6, **budget)
    assert 0 < len(grasps) < len(grasp_candidates(expected, 0.6))
    assert grasps.places == budget.get("max_places", 1)
    assert grasps.left_out["places not searched"] > 0
    np.testing.assert_array_equal(rows(pose.position for pose in node.published[1][1].poses), grasps.position)


def test_a_crop_is_what_is_worked_on(ros, cloud, points):
    low, high = points.min(axis=0), points.max(axis=0)
    high[0] = low[0] + 0.6 * (high[0] - low[0])
    node = ros.node(crop=[*(low - 1), *high.tolist()])
    node.on_cloud(cloud)
    places = np.array([[it.position.x, it.position.y, it.position.z] for it in node.published[1][1].poses])
    assert len(places)
    assert (places[:, 0] <= high[0]).all()
    nothing = ros.node(crop=[5.0, 5.0, 5.0, 6.0, 6.0, 6.0])
    nothing.on_cloud(cloud)
    assert nothing.logged == ["cloud left out: the cloud has 0 finite points, and min_points is 100"]


@pytest.fixture
def scene(points):
    """The tube above a table, and beside it a smaller tube; the rows of the first one come first."""
    sides = np.random.default_rng(0).uniform(-3, 3, (4000, 2))
    table = np.column_stack([sides, np.full(4000, -0.5)])
    return np.concatenate([points, points[::3] + [0, 1, 0], table]).astype(np.float32).astype(float)


@pytest.mark.parametrize("plane", [[0.0] * 4, [0.0, 0.0, 2.0, 1.0]])
def test_the_largest_cluster_off_the_plane_is_skeletonised(ros, scene, expected, header, make_message, rows, plane):
    node = ros.node(cluster=0.3, plane_distance=0.02, plane=plane, max_points=0)
    node.on_cloud(cloud_of(scene, header, make_message))
    (_, markers), _, (_, labels) = node.published
    np.testing.assert_array_equal(line_ends(markers, rows), expected.vertices[expected.edges].reshape(-1, 3))
    np.testing.assert_array_equal(points_of(labels), scene[:800])
    assert (branches(labels)[:600] == segment(expected)).all()
    assert (branches(labels)[600:] == -1).all()


def test_grasps_avoid_the_scene_around_the_cluster(ros, scene, expected, header, make_message, rows):
    node = ros.node(cluster=0.3, plane_distance=0.02, opening=0.6, max_points=0)
    node.on_cloud(cloud_of(scene, header, make_message))
    others = dict(cloud=scene[:800], mask=np.arange(800) < 600, plane=[0.0, 0.0, 1.0, 0.5])
    grasps = grasp_candidates(expected, 0.6, **others)
    assert 0 < len(grasps) < len(grasp_candidates(expected, 0.6))
    poses = node.published[1][1].poses
    np.testing.assert_array_equal(rows(pose.position for pose in poses), grasps.position)


def test_a_scene_without_an_object_is_left_out(ros, scene, header, make_message):
    node = ros.node(cluster=0.1, plane_distance=0.02)
    for part in (scene[800:], np.random.default_rng(0).uniform(-99, 99, (300, 3))):
        node.on_cloud(cloud_of(part, header, make_message))
    assert node.logged == [
        "cloud left out: the cloud without its plane has 0 finite points, and min_points is 100",
        "cloud left out: the largest cluster has 0 finite points, and min_points is 100",
    ]


@pytest.mark.slow
def test_a_large_frame_is_sampled_and_takes_less_than_a_second(ros, header, make_message):
    """640 x 480 points of a wavy surface, all finite, with an eighth of the points off it."""
    v, u = np.mgrid[:480, :640] / 640
    depth = 1 + 0.1 * np.sin(9 * u) * np.cos(7 * v)
    depth += (np.random.default_rng(0).random(depth.shape) < 1 / 8) * 0.2 * u
    message = cloud_of(np.stack([u * depth, v * depth, depth], axis=-1).reshape(-1, 3), header, make_message)
    node = ros.node()
    begin = time.process_time()
    node.on_cloud(message)
    seconds = time.process_time() - begin
    labels = node.published[2][1]
    assert labels.width == node.defaults["max_points"]
    assert np.isin(points_of(labels)[:, 2], points_of(message)[:, 2]).all()
    assert seconds < 5  # 0.4 on a core of its own


class Transforms:
    """A buffer of tf2 that knows one transform, and what it was asked for."""

    known, asked = (), ()

    def lookup_transform(self, *words):
        type(self).asked = words
        if not self.known:
            raise LookupError("base does not exist")
        return self.known[0]


def test_points_are_transformed_to_the_target_frame(ros, cloud, points, header, make_message, monkeypatch, rows):
    ros.module("tf2_ros", Buffer=Transforms, TransformListener=lambda buffer, node: (buffer, node))
    node = ros.node(target_frame="base")
    node.on_cloud(cloud)
    assert (node.published, node.logged) == ([], ["cloud left out: base does not exist"])
    assert Transforms.asked == ("base", "camera", (12, 345), 0.1)
    half_turn = make_message("geometry_msgs/msg/Quaternion", x=1.0, w=0.0)
    shift = make_message("geometry_msgs/msg/Vector3", z=2.0)
    transform = make_message("geometry_msgs/msg/Transform", rotation=half_turn, translation=shift)
    there = make_message("std_msgs/msg/Header", frame_id="base", stamp=header.stamp)
    stamped = make_message("geometry_msgs/msg/TransformStamped", header=there, transform=transform)
    monkeypatch.setattr(Transforms, "known", (stamped,))
    node.on_cloud(cloud)
    (_, markers), (_, poses), (_, labels) = node.published
    skeleton = glsk.skeletonize(moved(points, transform))
    np.testing.assert_array_equal(rows(pose.position for pose in poses.poses), skeleton.vertices)
    assert poses.header == labels.header == markers.markers[0].header == there


def test_a_request_is_answered_with_the_verdict_on_the_newest_cloud(ros, cloud, expected, header, make_message):
    def ask(node):
        return node.requests(None, SimpleNamespace())

    node = ros.node()
    answer = ask(node)
    assert (answer.success, json.loads(answer.message)) == (False, {"error": "no cloud has come in yet"})
    node.on_cloud(cloud)
    answer = ask(node)
    assert answer.success
    assert [topic for topic, _ in node.published] == 2 * ["~/markers", "~/poses", "~/labels"]
    assert json.loads(answer.message) == dict(
        verdict="good",
        score=expected.score,
        points=600,
        vertices=len(expected.vertices),
        components=1,
        loops=0,
        ends=2,
        branches=1,
        poses=len(expected.vertices),
        reasons=[],
    )
    ball = np.random.default_rng(0).normal(size=(600, 3))
    node.on_cloud(cloud_of(ball / np.linalg.norm(ball, axis=1, keepdims=True), header, make_message))
    answer = ask(node)
    assert (answer.success, json.loads(answer.message)["verdict"]) == (False, "no curve skeleton")
    assert "sphere" in [reason["code"] for reason in json.loads(answer.message)["reasons"]]
    node.on_cloud(cloud_of(np.eye(3), header, make_message))
    answer = ask(node)
    assert (answer.success, "min_points" in json.loads(answer.message)["error"]) == (False, True)


def test_a_bad_cloud_is_one_warning_and_the_next_is_served(ros, cloud, header, make_message, monkeypatch):
    node = ros.node()
    node.on_cloud(make_message(CLOUD, header=header))
    node.on_cloud(cloud_of(np.full((500, 3), np.nan), header, make_message))
    node.on_cloud(cloud_of(np.eye(3), header, make_message))
    assert node.logged == [
        "cloud left out: the cloud has no field x: its fields are none",
        "cloud left out: the cloud has 0 finite points, and min_points is 100",
        "cloud left out: the cloud has 3 finite points, and min_points is 100",
    ]
    assert node.published == []
    node.on_cloud(cloud)
    assert len(node.published) == 3
    with monkeypatch.context() as patch:  # an error that nobody has foreseen
        patch.setattr(node, "skeletonizer", lambda *_: 1 / 0)
        node.on_cloud(cloud)
    assert node.logged[3:] == ["cloud left out: division by zero"]


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        (dict(pipeline="defualt"), "did you mean 'default'"),
        (dict(set=["k=no"]), "k = 'no'"),
        (dict(opening=float("nan")), "opening = nan"),
        (dict(crop=[0.0, 0.0, 1.0, 1.0, 1.0, 0.0]), "crop = .*must be least x, y, z and greatest"),
        (dict(accept="any"), "accept = 'any'"),
        (dict(plane=[0.0, 0.0, 1.0]), r"plane = \[0.0, 0.0, 1.0\]: must be a, b, c, d"),
        (dict(plane=[0.0, 0.0, 1.0, 0.0]), "is for grasps: give the opening"),
        (dict(cluster=-1.0), "cluster = -1"),
        (dict(plane_distance=float("inf")), "plane_distance = inf"),
        (dict(max_points=-1), "max_points = -1"),
        (dict(max_places=-1), "max_places = -1"),
        (dict(seconds=-1.0), "seconds = -1"),
    ],
)
def test_wrong_parameters_end_the_node_at_once(ros, parameters, message):
    with pytest.raises(glsk.InvalidParameterError, match=message):
        ros.node(**parameters)
    from glsk_o3d_ros.node import main

    with pytest.raises(SystemExit, match=message):
        main()
    assert ros.rclpy.calls == ["init", "shutdown"]
    ros.node()
    main()
    assert ros.rclpy.calls[2:] == ["init", "skeletonize_node", "shutdown"]


# ---------------------------------------------------------------------------------------------------------------- bags


@pytest.fixture
def recorded(types, cloud, make_message, header, tmp_path):
    """A bag: a cloud, one that is too small, and the cloud again, a second apart; and another topic."""
    few = cloud_of(np.eye(3), header, make_message)
    with Writer(tmp_path / "in", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        clouds = writer.add_connection("/points", CLOUD, typestore=types)
        other = writer.add_connection("/frame", "std_msgs/msg/Header", typestore=types)
        writer.write(other, 0, types.serialize_cdr(header, "std_msgs/msg/Header"))
        for i, message in enumerate([cloud, few, cloud], 1):
            writer.write(clouds, i * SECOND, types.serialize_cdr(message, CLOUD))
    return tmp_path / "in"


def messages(path, types):
    """Time, topic and message of all in a bag."""
    with AnyReader([path]) as reader:
        return [
            (time, connection.topic, types.deserialize_cdr(data, connection.msgtype))
            for connection, time, data in reader.messages()
        ]


def test_the_script_does_what_the_node_does(recorded, types, tmp_path, expected, header, rows, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for words, message in (
        ("in no --topic /points --opening -1", "opening = -1"),
        ("in no --topic /points --plane 0 0 -1 inf", "must be four finite numbers a, b, c, d"),
        ("in no --topic /frame", "has no clouds on /frame; there are some on /points"),
        ("in in --topic /points", "exists already"),
        ("nowhere no --topic /points", "nowhere"),
    ):
        with pytest.raises(SystemExit, match=message):
            bag.main(words.split())
    assert not (tmp_path / "no").exists()
    bag.main([str(recorded), str(tmp_path / "out"), "--topic", "/points"])
    output = capsys.readouterr()
    assert output.out == f"2 clouds skeletonised: {tmp_path / 'out'}\n"
    assert output.err == f"cloud at {2 * SECOND} left out: the cloud has 3 finite points, and min_points is 100\n"
    actual = messages(tmp_path / "out", types)
    assert [(time, topic) for time, topic, _ in actual] == [
        (time * SECOND, f"/skeletonize_node/{name}") for time in (1, 3) for name in ("markers", "poses", "labels")
    ]
    for (_, _, markers), (_, _, poses) in zip(actual[::3], actual[1::3], strict=True):
        np.testing.assert_array_equal(line_ends(markers, rows), expected.vertices[expected.edges].reshape(-1, 3))
        np.testing.assert_array_equal(rows(pose.position for pose in poses.poses), expected.vertices)
        assert (poses.header.frame_id, poses.header.stamp.sec) == (header.frame_id, header.stamp.sec)
    options = "--cluster 0.3 --plane-distance 0.01 --plane 0 0 1 9 --set k=20 --set size=300 --max-points 400"
    bag.main([str(recorded), str(tmp_path / "few"), "--topic", "/points", *options.split()])
    assert [message.width for _, topic, message in messages(tmp_path / "few", types) if "labels" in topic] == [400] * 2
