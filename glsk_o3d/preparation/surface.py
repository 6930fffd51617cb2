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
    """Points in the working frame, what their neighbourhoods are like, and which of them stands for each point before.

    Attributes
    ----------
    frame : Frame
    points : (m, 3) float array
    neighbours : (m, k) int array
        Nearest first, the point itself ahead of them.
    weight : (m,) float array
        Points of the cloud that each stands for.
    merged : (m,) float array
        Distinct points that each is the mean of.
    noise : (m,) float array
        See `noise_share`.
    normals : (m, 3) float array
        Of the surface as it came, up to their sign: where points were drawn to a ridge there are none any more.
    spread : (m, 3) float array
        Principal spreads, ascending; see `glsk_o3d.numerics.neighbourhoods.principal`.
    ring_normals : (m, 3) float array
        Normals of the planes that the rings lie in: those of the points as they are now.
    representative : (s,) int array
        For every sampled point the row that it is, or the nearest one.
    outlier : (s,) bool array
        Sampled points that were set aside.
    """

    frame: Frame
    points: np.ndarray
    neighbours: np.ndarray
    weight: np.ndarray
    merged: np.ndarray
    noise: np.ndarray
    normals: np.ndarray
    spread: np.ndarray
    ring_normals: np.ndarray
    representative: np.ndarray
    outlier: np.ndarray

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
        """The surface with noise, normals and spread measured in the neighbourhoods."""
        spread, normals = principal(points, neighbours)
        noise = noise_share(spread, neighbours)
        return cls(frame, points, neighbours, weight, merged, noise, normals, spread, normals, representative, outlier)

    def __len__(self) -> int:
        return len(self.points)


def noise_share(spread: np.ndarray, neighbours: np.ndarray) -> np.ndarray:
    """How far the neighbourhoods of a cloud are noise, from 0 to 1.

    That is how much they fill space: the sphericity, smoothed by the median, is near 0 on a surface and along a curve,
    however dense, and 1 in a ball of noise (Demantke et al. 2011, "Dimensionality based scale selection in 3D lidar
    point clouds"); from 0.2 to 0.35 it is mapped to 0 to 1.

    Parameters
    ----------
    spread : (n, 3) float array
        As from `principal`.
    neighbours : (n, k) int array

    Returns
    -------
    (n,) float array
    """
    rise = (sphericity(spread, neighbours) - CLEAN_SPHERICITY) / (NOISE_SPHERICITY - CLEAN_SPHERICITY)
    return np.clip(rise, 0, 1)
