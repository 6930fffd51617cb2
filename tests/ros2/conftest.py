"""What tests of the ROS package share: messages of rosbags, and an rclpy that is none."""

import sys
from array import array
from functools import partial
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore

PACKAGE = Path(__file__).resolve().parents[2] / "ros2" / "glsk_o3d_ros"
sys.path.insert(0, str(PACKAGE))

from glsk_o3d_ros.bag import maker  # noqa: E402


@pytest.fixture(scope="session")
def package():
    return PACKAGE


@pytest.fixture(scope="session", params=[Stores.ROS2_HUMBLE, Stores.ROS2_JAZZY], ids=["humble", "jazzy"])
def types(request):
    return get_typestore(request.param)


@pytest.fixture(scope="session")
def make_message(types):
    return maker(types)


@pytest.fixture
def header(make_message):
    stamp = make_message("builtin_interfaces/msg/Time", sec=12, nanosec=345)
    return make_message("std_msgs/msg/Header", frame_id="camera", stamp=stamp)


def strictly(types, kind, /, **fields):
    """A message, of fields of just the types that rclpy's classes take."""
    plain = {"string": str, "bool": bool, "float32": float, "float64": float}
    for field, (shape, of) in types.fielddefs[kind][1]:
        if field in fields and shape is Nodetype.BASE:
            assert type(fields[field]) is plain.get(of[0], int), (kind, field)
        elif field in fields and shape is Nodetype.NAME:
            assert isinstance(fields[field], types.types[of]), (kind, field)
        elif field in fields and of[0][0] is Nodetype.NAME:
            assert all(isinstance(value, types.types[of[0][1]]) for value in fields[field]), (kind, field)
        elif field in fields:
            assert isinstance(fields[field], array), (kind, field)
    return maker(types)(kind, **fields)


class FakeNode:
    """A node as rclpy has it, as far as ours goes; it keeps what is published and logged."""

    given = {}  # noqa: RUF012 - parameters from outside

    def __init__(self, name):
        self.name, self.published, self.logged, self.topics, self.defaults = name, [], [], {}, {}

    def declare_parameter(self, name, default):
        self.defaults[name], value = default, self.given.get(name, default)
        assert type(value) is type(default), name  # rclpy refuses other types, too
        assert value != [], name  # and takes this for bytes
        return SimpleNamespace(value=value)

    def create_publisher(self, of, topic, qos):
        self.topics[topic] = of, qos

        def publish(message):
            assert isinstance(message, of)
            self.published.append((topic, message))

        return SimpleNamespace(publish=publish)

    def create_subscription(self, of, topic, callback, qos):
        self.topics[topic] = of, qos
        return callback

    def create_service(self, of, topic, callback):
        self.topics[topic] = of, None
        return callback

    def get_logger(self):
        return SimpleNamespace(warning=self.logged.append)


@pytest.fixture
def ros(types, monkeypatch):
    """Modules of ROS that are none; gives a function that makes our node with parameters."""

    def module(name, **names):
        created = ModuleType(name)
        vars(created).update(names)
        monkeypatch.setitem(sys.modules, name, created)
        return created

    def classes(package, *names):
        module(package)
        module(f"{package}.msg", **{name: types.types[f"{package}/msg/{name}"] for name in names})

    calls = []
    classes("geometry_msgs", "PoseArray", "TransformStamped")
    classes("sensor_msgs", "PointCloud2")
    classes("std_msgs", "Header")
    classes("visualization_msgs", "MarkerArray")
    module("std_srvs")
    module("std_srvs.srv", Trigger=SimpleNamespace(Request=SimpleNamespace, Response=SimpleNamespace))
    module("rosidl_runtime_py")
    module("rosidl_runtime_py.utilities", get_message=lambda name: partial(strictly, types, name))
    rclpy = module(
        "rclpy", calls=calls, init=lambda args: calls.append("init"), spin=lambda node, on: calls.append(node.name)
    )
    rclpy.try_shutdown = lambda: calls.append("shutdown")
    module("rclpy.duration", Duration=lambda seconds: seconds)
    module("rclpy.time", Time=SimpleNamespace(from_msg=lambda stamp: (stamp.sec, stamp.nanosec)))
    stopped = type("ExternalShutdownException", (Exception,), {})
    module("rclpy.executors", ExternalShutdownException=stopped, MultiThreadedExecutor=lambda threads: threads)
    module("rclpy.node", Node=FakeNode)
    module(
        "rclpy.qos",
        QoSProfile=dict,
        DurabilityPolicy=SimpleNamespace(TRANSIENT_LOCAL="kept"),
        ReliabilityPolicy=SimpleNamespace(BEST_EFFORT="best effort"),
    )
    monkeypatch.delitem(sys.modules, "glsk_o3d_ros.node", raising=False)

    def node(**parameters):
        from glsk_o3d_ros.node import SkeletonizeNode

        monkeypatch.setattr(FakeNode, "given", parameters)
        return SkeletonizeNode()

    yield SimpleNamespace(node=node, rclpy=rclpy, module=module)
    sys.modules.pop("glsk_o3d_ros.node", None)


@pytest.fixture
def sent(types):
    """A message as it comes at the other end: through CDR."""

    def send(message, kind):
        return types.deserialize_cdr(types.serialize_cdr(message, kind), kind)

    return send


def rows(points):
    """The x, y and z of messages as an array."""
    return np.array([[point.x, point.y, point.z] for point in points]).reshape(-1, 3)


@pytest.fixture(scope="session", name="rows")
def rows_of():
    return rows
