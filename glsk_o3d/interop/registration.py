"""Rigid registration of frames to the points of an earlier one, by Open3D."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from .clouds import to_point_cloud
from .packages import import_open3d

NORMAL_NEIGHBOURS = 16  # fitted: points that say where the surface of the reference faces
COMPARED_POINTS = 8192  # speed: of a frame at most
REGISTERED_POINTS = 2048  # speed: of these, in the steps of ICP
CAPTURE = 0.1, 0.04  # fitted: over the diagonal, how far points may be from the reference, first and then
MOST_STEPS = 50  # speed: of ICP; it mostly stops before
NEAR_SPACINGS = 3.0  # derived: of two samples of a surface 0.998 of the points are nearer, by ln 2 * 3^2


def finite_sample(points: np.ndarray) -> np.ndarray:
    """The finite points, or some of many, drawn at random: every n-th one might be a column of a depth image."""
    points = points[np.isfinite(points).all(axis=1)]
    return points[np.random.default_rng(0).permutation(len(points))[:COMPARED_POINTS]]


class Reference:
    """The points of a frame to which others are registered: as `finite_sample` gives both."""

    def __init__(self, points: np.ndarray) -> None:
        self._shift = np.eye(4)  # far from the origin a turn about it would be a large step
        self._shift[:3, 3] = points.mean(axis=0)
        self._points = points - self._shift[:3, 3]
        self._tree, self._cloud = cKDTree(self._points), to_point_cloud(self._points)
        self._cloud.estimate_normals(import_open3d().geometry.KDTreeSearchParamKNN(NORMAL_NEIGHBOURS))
        self._near = NEAR_SPACINGS * float(np.median(self._tree.query(self._points, k=[2])[0]))

    def pose(self, points: np.ndarray, start: np.ndarray) -> np.ndarray:
        """The rigid motion (4, 4) from here to the points of a later frame, near the one of the frame before."""
        registration = import_open3d().pipelines.registration
        some = points[:REGISTERED_POINTS] - self._shift[:3, 3]
        back = np.linalg.inv(start @ self._shift) @ self._shift
        for share in CAPTURE:
            reach = share * np.linalg.norm(np.ptp(self._points, axis=0))
            estimation = registration.TransformationEstimationPointToPlane(registration.TukeyLoss(k=reach / 2))
            criteria = registration.ICPConvergenceCriteria(max_iteration=MOST_STEPS)
            result = registration.registration_icp(to_point_cloud(some), self._cloud, reach, back, estimation, criteria)
            back = result.transformation
        return self._shift @ np.linalg.inv(self._shift @ back)

    def unexplained(self, points: np.ndarray, pose: np.ndarray) -> float:
        """Share of points without one of the reference near, or the other way round: the larger one."""
        middle = pose @ self._shift[:, 3]
        there = (points - middle[:3]) @ pose[:3, :3]
        pairs = (self._tree.query(there)[0], cKDTree(there).query(self._points)[0])
        return max(float((distance > self._near).mean()) for distance in pairs)
