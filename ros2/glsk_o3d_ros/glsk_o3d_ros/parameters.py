"""The parameters of the node, its launch file and the script for bags. No import: launch has a Python of its own."""

PARAMETERS = {
    "pipeline": ("default", "Name of a pipeline, or path of a recipe."),
    "set": ([""], "Changed options, such as 'k=20'."),  # of an empty list rclpy could not tell the type
    "target_frame": ("", "Frame that tf2 transforms the points to before all else; empty for that of the cloud."),
    "crop": ([0.0] * 6, "Least x, y, z and greatest x, y, z of the points that are worked on; all 0 for all."),
    "plane": ([0.0] * 4, "A table, ax + by + cz + d = 0; all 0 for none, or for the largest plane."),
    "plane_distance": (0.0, "Distance from the plane up to which points are left out; 0 to keep them."),
    "max_points": (20000, "Most points that are worked on, a random sample of more; 0 for all."),
    "cluster": (0.0, "Distance between clusters, of which the largest is skeletonised; 0 to skeletonise all points."),
    "min_points": (100, "Fewest points to skeletonise."),
    "opening": (0.0, "Widest opening of a gripper: poses are then grasps; 0 for frames along the curve."),
    "max_places": (0, "Most places to search for grasps, the most promising ones; 0 for all."),
    "seconds": (0.0, "Wall time after which no further place is searched for grasps; 0 for no limit."),
    "accept": ("doubtful", "Worst verdict of a skeleton that is accepted, and gets grasps."),
}
"""Default and meaning by name. Lengths are in the cloud's units, places in the target frame."""
