"""``ros2 launch glsk_o3d_ros skeletonize.launch.py input:=/camera/depth/points``: the node, with its parameters."""

from typing import List  # noqa: UP035 - launch takes no list[str]

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

PARAMETERS = {
    "pipeline": (str, "default", "Name of a pipeline, or path of a recipe."),
    "set": (List[str], "['']", "Parameters to change, such as ['k=20', 'Connector.radius=2%']."),  # noqa: UP006
    "min_points": (int, "100", "Fewest points of a cloud to work on."),
    "opening": (float, "0.0", "Widest opening of a gripper [m]: poses are then grasps; 0 for frames along the curve."),
    "plane": (List[float], "[0.0, 0.0, 0.0, 0.0]", "A table, ax + by + cz + d = 0, for grasps; all 0 for none."),  # noqa: UP006
    "crop": (List[float], "[0.0, 0.0, 0.0, 0.0, 0.0, 0.0]", "Least and greatest x, y, z to work on; all 0 for all."),  # noqa: UP006
    "accept": (str, "doubtful", "Worst verdict of a skeleton that gets grasps."),
}


def generate_launch_description():
    """The node, and the arguments of the launch file."""
    arguments = [DeclareLaunchArgument("input", description="Topic of the clouds.")]
    arguments += [
        DeclareLaunchArgument(name, default_value=default, description=meaning)
        for name, (_, default, meaning) in PARAMETERS.items()
    ]
    node = Node(
        package="glsk_o3d_ros",
        executable="skeletonize_node",
        name="skeletonize_node",
        output="screen",
        remappings=[("~/input", LaunchConfiguration("input"))],
        parameters=[
            {
                name: ParameterValue(LaunchConfiguration(name), value_type=kind)
                for name, (kind, *_) in PARAMETERS.items()
            }
        ],
    )
    return LaunchDescription([*arguments, node])
