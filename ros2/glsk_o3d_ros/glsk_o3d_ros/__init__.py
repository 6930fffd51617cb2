"""Curve skeletons of point clouds as markers and poses: a ROS 2 node, and the same for bags without ROS."""
