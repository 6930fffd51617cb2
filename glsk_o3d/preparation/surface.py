"""What the steps of the preparation hand on: the points that say where the surface is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..numerics.neighbourhoods import principal, sphericity
from .frame import Frame

# Fitted: median sphericity of clean neighbourhoods at most, and of nothing but noise.
CLEAN_SPHERICITY, NOISE_SPHERICITY = 0.2, 0.35


@dataclass(frozen=True, eq=False)
class Surface:
    """Points in the working frame, and what their neighbourhoods are like.

    On the way to the rings points are merged, copies, noisy and near ones, and outliers are set aside. A point that is
    left represents those that went into it, and the outliers nearest to it; its `weight` and `merged` say how many.
    """

    frame: Frame
    points: np.ndarray  # (m, 3)
    neighbours: np.ndarray  # (m, k) nearest first, the point itself ahead of them
    weight: np.ndarray  # (m,) points of the cloud that each stands for
    merged: np.ndarray  # (m,) distinct points that each is the mean of
    noise: np.ndarray  # (m,) see `noise_share`
    normals: np.ndarray  # (m, 3) of the surface as it came, up to their sign: on a ridge there are none any more
    ring_normals: np.ndarray  # (m, 3) of the planes that the rings lie in: those of the points as they are now
    representative: np.ndarray  # (s,) of every sampled point its row
    outlier: np.ndarray  # (s,) sampled points that were set aside

    @classmethod
    def measured(
        cls,
        frame: Frame,
        points: np.ndarray,
        neighbours: np.ndarray,
        weight: np.ndarray,
        merged: np.ndarray,
        representative: np.ndarray,
        outlier: np.ndarray,
    ) -> Surface:
        """The surface with noise and normals measured in the neighbourhoods."""
        spread, normals = principal(points, neighbours)
        noise = noise_share(spread, neighbours)
        return cls(frame, points, neighbours, weight, merged, noise, normals, normals, representative, outlier)

    def __len__(self) -> int:
        return len(self.points)


def noise_share(spread: np.ndarray, neighbours: np.ndarray) -> np.ndarray:
    """How far the neighbourhoods of a cloud are noise, from 0 to 1, (n,) float array.

    That is how much they fill space: the sphericity, smoothed by the median, is near 0 on a surface and along a curve,
    however dense, and 1 in a ball of noise (Demantke et al. 2011, "Dimensionality based scale selection in 3D lidar
    point clouds"); from 0.2 to 0.35 it is mapped to 0 to 1.
    """
    rise = (sphericity(spread, neighbours) - CLEAN_SPHERICITY) / (NOISE_SPHERICITY - CLEAN_SPHERICITY)
    return np.clip(rise, 0, 1)
