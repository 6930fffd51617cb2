"""The node: PointCloud2 in, MarkerArray, PoseArray and labelled points out."""

from __future__ import annotations

import json
import sys
from functools import cache
from typing import Any

import rclpy
from geometry_msgs.msg import PoseArray, TransformStamped
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.time import Time
from rosidl_runtime_py.utilities import get_message
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Header
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

from glsk_o3d import GlskError, InvalidCloudError

from .parameters import PARAMETERS
from .skeletonizer import Results, Skeletonizer

NEWEST = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
"""Of clouds, as sensors send them: those that come while one is worked on are dropped, but for the last."""
LATEST = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""Of results: who comes late gets the last one."""
TF_SECONDS = 0.1  # chosen: how long a cloud waits for its transform, which often comes a little later

class_of = cache(get_message)


def make(kind: str, /, **fields: Any) -> Any:
    """A message of rclpy."""
    return class_of(kind)(**fields)


class SkeletonizeNode(Node):
    """Subscribes to ``~/input``, and publishes ``~/markers``, ``~/poses`` and ``~/labels`` for the clouds it gets to.

    The service ``~/skeletonize`` does this for the newest cloud once more, and answers what its skeleton is worth.

    Raises
    ------
    GlskError
        A parameter is wrong.
    """

    def __init__(self) -> None:
        super().__init__("skeletonize_node")
        values = {name: self.declare_parameter(name, default).value for name, (default, _) in PARAMETERS.items()}
        self.target_frame, self.newest = values.pop("target_frame"), None
        self.skeletonizer = Skeletonizer(make, **values)
        if self.target_frame:
            from tf2_ros import Buffer, TransformListener

            self.transforms = Buffer()
            self.listener = TransformListener(self.transforms, self)
        self.markers = self.create_publisher(MarkerArray, "~/markers", LATEST)
        self.poses = self.create_publisher(PoseArray, "~/poses", LATEST)
        self.labels = self.create_publisher(PointCloud2, "~/labels", LATEST)
        self.clouds = self.create_subscription(PointCloud2, "~/input", self.on_cloud, NEWEST)
        self.requests = self.create_service(Trigger, "~/skeletonize", self.on_request)

    def on_cloud(self, cloud: PointCloud2) -> None:
        """Publish what there is to say about a cloud; of one that cannot be skeletonised, warn."""
        self.newest = cloud
        try:
            self.publish_results(cloud)
        except Exception as error:  # the next cloud may be better: nothing that is in one may end the node
            self.get_logger().warning(f"cloud left out: {error}")

    def on_request(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Publish for the newest cloud: success if its skeleton is accepted, and a message in JSON."""
        try:
            if self.newest is None:
                raise InvalidCloudError("no cloud has come in yet")
            results = self.publish_results(self.newest)
            response.success, response.message = results.accepted, json.dumps(results.summary)
        except Exception as error:  # as above
            response.success, response.message = False, json.dumps(dict(error=str(error)))
        return response

    def publish_results(self, cloud: PointCloud2) -> Results:
        """What was published about a cloud; its warnings are in the log."""
        results = self.skeletonizer(cloud, self.transform_of(cloud.header) if self.target_frame else None)
        for warning in results.warnings:
            self.get_logger().warning(warning)
        self.markers.publish(results.markers)
        self.poses.publish(results.poses)
        self.labels.publish(results.labels)
        return results

    def transform_of(self, header: Header) -> TransformStamped:
        """The transform to the target frame at the time of a header; an error of tf2 if there is none."""
        time = Time.from_msg(header.stamp)
        return self.transforms.lookup_transform(self.target_frame, header.frame_id, time, Duration(seconds=TF_SECONDS))


def main(args: list[str] | None = None) -> None:
    """Run the node until it is told to stop."""
    rclpy.init(args=args)
    try:
        rclpy.spin(SkeletonizeNode(), MultiThreadedExecutor(2))  # transforms come in while a cloud is worked on
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except GlskError as error:
        sys.exit(f"skeletonize_node: {error}")
    finally:
        rclpy.try_shutdown()
