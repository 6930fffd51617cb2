"""The node: PointCloud2 in, MarkerArray and PoseArray out."""

from __future__ import annotations

import sys
from functools import cache
from typing import Any

import rclpy
from geometry_msgs.msg import PoseArray
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rosidl_runtime_py.utilities import get_message
from sensor_msgs.msg import PointCloud2
from visualization_msgs.msg import MarkerArray

from glsk_o3d import GlskError

from .skeletonizer import NO_CROP, NO_PLANE, Skeletonizer

NEWEST = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
"""Of clouds, as sensors send them: those that come while one is worked on are dropped, but for the last."""
LATEST = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""Of results: who comes late gets the last one."""

class_of = cache(get_message)


def make(kind: str, /, **fields: Any) -> Any:
    """A message of rclpy."""
    return class_of(kind)(**fields)


class SkeletonizeNode(Node):
    """Subscribes to ``~/input``, and publishes ``~/markers`` and ``~/poses`` for every cloud that it gets to.

    Raises
    ------
    GlskError
        A parameter is wrong.
    """

    def __init__(self) -> None:
        super().__init__("skeletonize_node")
        self.skeletonizer = Skeletonizer(
            make,
            pipeline=self.declare_parameter("pipeline", "default").value,
            settings=self.declare_parameter("set", [""]).value,  # of an empty list rclpy could not tell the type
            min_points=self.declare_parameter("min_points", 100).value,
            opening=self.declare_parameter("opening", 0.0).value,
            plane=self.declare_parameter("plane", list(NO_PLANE)).value,
            crop=self.declare_parameter("crop", list(NO_CROP)).value,
            accept=self.declare_parameter("accept", "doubtful").value,
        )
        self.markers = self.create_publisher(MarkerArray, "~/markers", LATEST)
        self.poses = self.create_publisher(PoseArray, "~/poses", LATEST)
        self.clouds = self.create_subscription(PointCloud2, "~/input", self.on_cloud, NEWEST)

    def on_cloud(self, cloud: PointCloud2) -> None:
        """Publish what there is to say about a cloud; of one that cannot be skeletonised, warn."""
        try:
            results = self.skeletonizer(cloud)
        except Exception as error:  # the next cloud may be better: nothing that is in one may end the node
            self.get_logger().warning(f"cloud left out: {error}")
            return
        for warning in results.warnings:
            self.get_logger().warning(warning)
        self.markers.publish(results.markers)
        self.poses.publish(results.poses)


def main(args: list[str] | None = None) -> None:
    """Run the node until it is told to stop."""
    rclpy.init(args=args)
    try:
        rclpy.spin(SkeletonizeNode())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except GlskError as error:
        sys.exit(f"skeletonize_node: {error}")
    finally:
        rclpy.try_shutdown()
