"""From a cloud to the messages about its skeleton: what the node and the script for bags have in common."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from glsk_o3d import InvalidCloudError, InvalidParameterError, Skeleton, SkeletonWarning, Verdict
from glsk_o3d.analysis import Gripper, grasp_candidates
from glsk_o3d.analysis.grasp_checks import checked_plane
from glsk_o3d.api import as_pipeline
from glsk_o3d.cli.overrides import override

from .messages import Make, frames_of, markers_of, points_of, poses_of

NO_PLANE = (0.0, 0.0, 0.0, 0.0)
NO_CROP = (0.0,) * 6


@dataclass(frozen=True)
class Results:
    """What is published about a cloud, the skeleton itself, and what was warned of."""

    markers: Any
    poses: Any
    skeleton: Skeleton
    warnings: tuple[str, ...]


class Skeletonizer:
    """Makes the messages about clouds, one by one.

    Parameters
    ----------
    make : callable
        See `glsk_o3d_ros.messages.Make`.
    pipeline : str
        Name of a pipeline, or path of a recipe.
    settings : iterable of str
        Parameters that are to differ: ``"Connector.radius=2%"``. Empty ones are left out.
    min_points : int
        Fewest points with finite coordinates that are worked on.
    opening : float
        Widest opening of a gripper, in the cloud's units; 0 for none.
    plane : sequence of 4 floats
        A table, ax + by + cz + d = 0, in the frame of the cloud: no grasp reaches behind it. Four zeros for none.
    crop : sequence of 6 floats
        Least x, y, z and greatest x, y, z of the points that are worked on, in the frame of the cloud. Six zeros
        for all.
    accept : str
        Worst verdict of a skeleton that gets grasps.

    Raises
    ------
    GlskError
        The pipeline, its recipe, a setting, the opening, the plane, the crop or the verdict is wrong, or there is
        a plane without an opening.
    """

    def __init__(
        self,
        make: Make,
        pipeline: str = "default",
        settings: Iterable[str] = (),
        min_points: int = 100,
        opening: float = 0.0,
        plane: Sequence[float] = NO_PLANE,
        crop: Sequence[float] = NO_CROP,
        accept: str = Verdict.DOUBTFUL.value,
    ) -> None:
        if not opening >= 0:
            raise InvalidParameterError(f"opening = {opening}: must be 0, for no grasps, or more")
        if len(plane) != 4:
            raise InvalidParameterError(
                f"plane = {list(plane)}: must be a, b, c, d of ax + by + cz + d = 0; all 0 for none"
            )
        self.make, self.min_points = make, min_points
        self.gripper = Gripper(opening) if opening else None
        self.plane = checked_plane(plane) if any(plane) else None
        if not opening and any(plane):
            raise InvalidParameterError("plane is for grasps: give the opening of the gripper, too")
        if len(crop) != 6 or (any(crop) and not np.less(crop[:3], crop[3:]).all()):
            raise InvalidParameterError(f"crop = {list(crop)}: must be least x, y, z and greatest; all 0 for none")
        if accept not in list(Verdict):
            raise InvalidParameterError(f"accept = {accept!r}: must be one of {', '.join(it.value for it in Verdict)}")
        self.crop, self.accept = np.reshape(crop, (2, 3)) if any(crop) else None, accept
        self.pipeline = override(as_pipeline(pipeline), filter(None, settings))

    def __call__(self, cloud: Any) -> Results:
        """The messages about a ``sensor_msgs/msg/PointCloud2``, in its frame and with its stamp.

        Poses are the grasps if there is an opening, the best of each place first, or else the frames along the
        skeleton. GlskError if the cloud cannot be skeletonised.
        """
        points = points_of(cloud)
        points = points[np.isfinite(points).all(axis=1)]
        if self.crop is not None:
            points = points[((points >= self.crop[0]) & (points <= self.crop[1])).all(axis=1)]
        if len(points) < self.min_points:
            raise InvalidCloudError(f"the cloud has {len(points)} finite points, and min_points is {self.min_points}")
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("ignore")
            warnings.simplefilter("always", SkeletonWarning)
            skeleton = self.pipeline(points)
            if self.gripper is None:
                frames = frames_of(skeleton)
            else:
                frames = grasp_candidates(skeleton, self.gripper, plane=self.plane, accept=self.accept).poses
        return Results(
            markers_of(skeleton, cloud.header, self.make),
            poses_of(frames, cloud.header, self.make),
            skeleton,
            tuple(str(warning.message) for warning in caught),
        )
