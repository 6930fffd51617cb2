"""From a cloud to the messages about its skeleton: what the node and the script for bags have in common."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from glsk_o3d import InvalidCloudError, InvalidParameterError, Skeleton, SkeletonWarning, Verdict
from glsk_o3d.analysis import Gripper, grasp_candidates, segment
from glsk_o3d.analysis.grasp_checks import checked_plane
from glsk_o3d.api import as_pipeline
from glsk_o3d.cli.overrides import override
from glsk_o3d.parameters import check_number

from .messages import Make, cloud_of, frames_of, markers_of, moved, points_of, poses_of
from .scene import largest_cluster, largest_plane, sample


@dataclass(frozen=True)
class Results:
    """What is published about a cloud, the skeleton itself, whether it is accepted, and what was warned of."""

    markers: Any
    poses: Any
    labels: Any
    skeleton: Skeleton
    accepted: bool
    warnings: tuple[str, ...]

    @property
    def summary(self) -> dict[str, Any]:
        """Verdict, score, counts and reasons, as JSON has them."""
        skeleton = self.skeleton
        return dict(
            verdict=skeleton.verdict.value,
            score=None if math.isnan(skeleton.score) else float(skeleton.score),
            points=len(skeleton.points),
            vertices=len(skeleton.vertices),
            components=int(skeleton.n_components),
            loops=int(skeleton.n_loops),
            ends=len(skeleton.leaves),
            branches=len(skeleton.branches),
            poses=len(self.poses.poses),
            reasons=[dict(code=reason.code, text=reason.text) for reason in skeleton.reasons],
        )


class Skeletonizer:
    """Makes the messages about clouds, one by one.

    Parameters
    ----------
    make : callable
        See `glsk_o3d_ros.messages.Make`.
    **parameters
        Those of `glsk_o3d_ros.parameters.PARAMETERS`, without the target frame.

    Raises
    ------
    GlskError
        A parameter is wrong, or there is a plane with neither an opening nor a distance from it.
    """

    def __init__(
        self,
        make: Make,
        *,
        pipeline: str,
        set: Iterable[str],
        crop: Sequence[float],
        max_points: int,
        plane: Sequence[float],
        plane_distance: float,
        cluster: float,
        min_points: int,
        opening: float,
        max_places: int,
        seconds: float,
        accept: str,
    ) -> None:
        numbers = dict(opening=opening, plane_distance=plane_distance, cluster=cluster, seconds=seconds)
        for name, number in numbers.items():
            check_number(name, number, low=0)
        for name, number in dict(max_points=max_points, max_places=max_places).items():
            check_number(name, number, "int", low=0)
        if len(plane) != 4:
            raise InvalidParameterError(
                f"plane = {list(plane)}: must be a, b, c, d of ax + by + cz + d = 0; all 0 for none"
            )
        self.plane = checked_plane(plane) if any(plane) else None
        if any(plane) and not (opening or plane_distance):
            raise InvalidParameterError("plane is for grasps: give the opening of the gripper, or plane_distance")
        if len(crop) != 6 or (any(crop) and not np.less(crop[:3], crop[3:]).all()):
            raise InvalidParameterError(f"crop = {list(crop)}: must be least x, y, z and greatest; all 0 for none")
        if accept not in list(Verdict):
            raise InvalidParameterError(f"accept = {accept!r}: must be one of {', '.join(it.value for it in Verdict)}")
        self.make, self.min_points, self.max_points = make, min_points, max_points
        self.crop = np.reshape(crop, (2, 3)) if any(crop) else None
        self.plane_distance, self.cluster = plane_distance, cluster
        self.gripper = Gripper(opening) if opening else None
        self.accept, self.budget = Verdict(accept), dict(max_places=max_places or None, seconds=seconds or None)
        self.pipeline = override(as_pipeline(pipeline), filter(None, set))

    def __call__(self, cloud: Any, transform: Any = None) -> Results:
        """The messages about a ``sensor_msgs/msg/PointCloud2``, in its frame and with its stamp.

        With a ``geometry_msgs/msg/TransformStamped`` they are in the frame that it leads to. Poses are the grasps if
        there is an opening, the best of each place first, or else the frames along the skeleton. GlskError if the cloud
        cannot be skeletonised.
        """
        header = cloud.header if transform is None else transform.header
        scene, plane = self._scene(cloud, transform)
        mask = largest_cluster(scene, self.cluster) if self.cluster else np.ones(len(scene), bool)
        self._check_size("the largest cluster", scene[mask])
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("ignore")
            warnings.simplefilter("always", SkeletonWarning)
            skeleton = self.pipeline(scene[mask])
            if self.gripper is None:
                frames = frames_of(skeleton)
            else:
                options: dict[str, Any] = dict(plane=plane, accept=self.accept, **self.budget)
                options |= {} if mask.all() else dict(cloud=scene, mask=mask)
                frames = grasp_candidates(skeleton, self.gripper, **options).poses
        branch = np.full(len(scene), -1)
        if len(skeleton.vertices):
            branch[mask] = segment(skeleton)
        return Results(
            markers_of(skeleton, header, self.make),
            poses_of(frames, header, self.make),
            cloud_of(scene, header, self.make, branch),
            skeleton,
            skeleton.verdict >= self.accept,
            tuple(str(warning.message) for warning in caught),
        )

    def _scene(self, cloud, transform):
        """The points that are worked on, (N, 3) float array, and the plane, (4,) float array or None."""
        points, plane = points_of(cloud), self.plane
        points = points[np.isfinite(points).all(axis=1)]
        if transform is not None:
            points = moved(points, transform.transform)
        if self.crop is not None:
            points = points[((points >= self.crop[0]) & (points <= self.crop[1])).all(axis=1)]
        self._check_size("the cloud", points)
        size = self.max_points or len(points)
        if self.plane_distance:  # before the sample, as most points of a frame are of the table
            plane = largest_plane(sample(points, size), self.plane_distance) if plane is None else plane
            distance = abs(points @ plane[:3] + plane[3]) / np.linalg.norm(plane[:3])
            points = points[distance > self.plane_distance]
            self._check_size("the cloud without its plane", points)
        return sample(points, size), plane

    def _check_size(self, what, points):
        if len(points) < self.min_points:
            raise InvalidCloudError(f"{what} has {len(points)} finite points, and min_points is {self.min_points}")
