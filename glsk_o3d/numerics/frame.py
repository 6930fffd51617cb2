"""The working frame: the cloud centred on its bounding box, longest side 1.6."""

from dataclasses import dataclass

import numpy as np

SIDE = 1.6


@dataclass(frozen=True, eq=False)
class Frame:
    """Similarity between the user's units and the working frame, in which weights and thresholds are stated.

    Attributes
    ----------
    centre : (3,) float array
        Centre of the bounding box, in the user's units.
    scale : float
        User's units per unit of the frame.
    half_extent : (3,) float array
        Half the sides of the bounding box, in the frame.
    """

    centre: np.ndarray
    scale: float
    half_extent: np.ndarray

    @classmethod
    def of(cls, points):
        """The frame of points (n, 3) that do not all coincide."""
        low, high = points.min(axis=0), points.max(axis=0)
        # Half the difference first: the sum of two large coordinates would cost a digit.
        half = (high - low) / 2
        scale = 2 * half.max() / SIDE
        return cls(low + half, float(scale), half / scale)

    @property
    def diagonal(self):
        """Bounding-box diagonal, in the frame."""
        return float(2 * np.linalg.norm(self.half_extent))

    def into(self, points):
        """User's units to the frame."""
        return (points - self.centre) / self.scale

    def out_of(self, points):
        """Frame to the user's units."""
        return points * self.scale + self.centre
