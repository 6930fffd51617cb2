"""The node, with an rclpy that is none: from a cloud that comes in to what it publishes; and bags, offline."""

import numpy as np
import pytest
from glsk_o3d_ros import bag
from glsk_o3d_ros.messages import cloud_of
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import StoragePlugin, Writer
from scipy.spatial.transform import Rotation

import glsk_o3d as glsk
from glsk_o3d import samples
from glsk_o3d.analysis import grasp_candidates

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


def test_a_cloud_comes_in_and_markers_and_poses_go_out(ros, cloud, expected, header, sent, rows):
    node = ros.node()
    node.on_cloud(cloud)
    (there, markers), (topic, poses) = node.published
    assert (there, topic) == ("~/markers", "~/poses")
    markers, poses = sent(markers, bag.RESULTS["markers"]), sent(poses, bag.RESULTS["poses"])
    np.testing.assert_array_equal(line_ends(markers, rows), expected.vertices[expected.edges].reshape(-1, 3))
    np.testing.assert_array_equal(rows(pose.position for pose in poses.poses), expected.vertices)
    assert poses.header == header
    assert {marker.header.frame_id for marker in markers.markers} == {"camera"}
    assert node.logged == []
    assert {topic: (of.__msgtype__, qos) for topic, (of, qos) in node.topics.items()} == {
        "~/input": (CLOUD, dict(depth=1, reliability="best effort")),
        "~/markers": (bag.RESULTS["markers"], dict(depth=1, durability="kept")),
        "~/poses": (bag.RESULTS["poses"], dict(depth=1, durability="kept")),
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
    (_, markers), (_, poses) = node.published
    assert (len(markers.markers) >= 3, poses.poses) == (True, [])
    (warning,) = node.logged
    assert "too wide" in warning


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
    assert len(node.published) == 2
    with monkeypatch.context() as patch:  # an error that nobody has foreseen
        patch.setattr(node, "skeletonizer", lambda cloud: 1 / 0)
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
        ("in no --topic /points --plane 0 0 -1 inf", "must be finite a, b, c, d"),
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
        (time * SECOND, f"/skeletonize_node/{name}") for time in (1, 3) for name in ("markers", "poses")
    ]
    for (_, _, markers), (_, _, poses) in zip(actual[::2], actual[1::2], strict=True):
        np.testing.assert_array_equal(line_ends(markers, rows), expected.vertices[expected.edges].reshape(-1, 3))
        np.testing.assert_array_equal(rows(pose.position for pose in poses.poses), expected.vertices)
        assert (poses.header.frame_id, poses.header.stamp.sec) == (header.frame_id, header.stamp.sec)
