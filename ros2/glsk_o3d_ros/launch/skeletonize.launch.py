"""``ros2 launch glsk_o3d_ros skeletonize.launch.py input:=/camera/depth/points``: the node, with its parameters."""

from typing import List  # noqa: UP035 - launch takes no list[str]

from glsk_o3d_ros.parameters import PARAMETERS
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue


def generate_launch_description():
    """The node, and the arguments of the launch file."""
    arguments = [DeclareLaunchArgument("input", description="Topic of the clouds.")]
    parameters = {}
    for name, (default, meaning) in PARAMETERS.items():
        kind = List[type(default[0])] if isinstance(default, list) else type(default)  # noqa: UP006
        arguments.append(DeclareLaunchArgument(name, default_value=str(default), description=meaning))
        parameters[name] = ParameterValue(LaunchConfiguration(name), value_type=kind)
    node = Node(
        package="glsk_o3d_ros",
        executable="skeletonize_node",
        name="skeletonize_node",
        output="screen",
        remappings=[("~/input", LaunchConfiguration("input"))],
        parameters=[parameters],
    )
    return LaunchDescription([*arguments, node])
