"""The working frame: the cloud centred on its bounding box, about 1.6 long."""

from dataclasses import dataclass

import numpy as np

SIDE = 1.6
SLACK = 1.2  # how much larger than the cloud the contracted one may be
FLAT = 0.01  # least half side of the box for that, over its diagonal


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
    diagonal : float
        That of the box by which the frame was scaled, in the frame.
    mean : (3,) float array or None
        Mean of the points, in the frame, if it does not depend on how the cloud is turned.
    reach : float
        Distance of the farthest point from it.
    """

    centre: np.ndarray
    scale: float
    half_extent: np.ndarray
    diagonal: float
    mean: np.ndarray | None = None
    reach: float = 0.0

    @classmethod
    def of(cls, points, by="box"):
        """The frame in which the longest side of a box is 1.6.

        Parameters
        ----------
        points : (n, 3) float array
            Not all in one place.
        by : {"box", "spread"}
            The axis-aligned bounding box, as published, or the box that has the points' spread if it is evenly filled,
            whose longest side and diagonal do not change when the cloud is turned.

        Returns
        -------
        Frame
        """
        low, high = points.min(axis=0), points.max(axis=0)
        # Half the difference first: the sum of two large coordinates would cost a digit.
        half = (high - low) / 2
        centre, longest = low + half, 2 * half.max()
        if by == "box":
            scale = longest / SIDE
            return cls(centre, float(scale), half / scale, float(2 * np.linalg.norm(half / scale)))
        inner = (points - centre) / longest
        mean = inner.mean(axis=0)
        inner -= mean
        variance = np.linalg.eigvalsh(inner.T @ inner / len(inner))  # of a box with sides a, b, c: a^2 / 12, ...
        side, diagonal = np.sqrt(12 * np.array([variance[2], variance.sum()]))
        reach = np.sqrt((inner**2).sum(axis=1).max())
        unit = side / SIDE
        scale = longest * unit
        return cls(centre, float(scale), half / scale, float(diagonal / unit), mean / unit, float(reach / unit))

    def beyond(self, points):
        """Points of the frame that are far out of the cloud, (n,) bool array.

        Out of its bounding box or, where the frame turns with the cloud, of the ball around its mean, 1.2 times as
        large.
        """
        if self.mean is None:
            return (np.abs(points) > np.maximum(SLACK * self.half_extent, FLAT * self.diagonal)).any(axis=1)
        return ((points - self.mean) ** 2).sum(axis=1) > (SLACK * self.reach) ** 2

    def into(self, points):
        """User's units to the frame."""
        return (points - self.centre) / self.scale

    def out_of(self, points):
        """Frame to the user's units."""
        return points * self.scale + self.centre
