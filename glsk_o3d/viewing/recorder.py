"""What a page needs of a contraction while it runs."""

from __future__ import annotations

import numpy as np

from ..state import Contraction
from .figures import MOST_DRAWN_POINTS, thinned


class ContractionRecorder:
    """Remembers where the points of a cloud are after each solve: give it as ``on_state``.

    A large cloud is thinned, so that a record stays small: of N points at most `most_points` are followed. One that was
    merged into another stands where the other does. A second run starts a new record.

    Parameters
    ----------
    most_points : int

    Attributes
    ----------
    shown : (K,) int array
        The input points that are followed, ascending; empty before the first solve.
    positions : list of (K, 3) float64 array
        The input, and then the contracted points after each solve, in the cloud's units.

    Examples
    --------
    >>> from glsk_o3d import Contractor, RingBuilder
    >>> from glsk_o3d.samples import torus
    >>> recorder = ContractionRecorder()
    >>> contracted = (RingBuilder() | Contractor(max_iterations=2))(torus(300).points, on_state=recorder)
    >>> len(recorder.positions), recorder.positions[2].shape
    (3, (300, 3))
    """

    def __init__(self, most_points: int = MOST_DRAWN_POINTS):
        self.most_points = most_points
        self.shown = np.empty(0, int)
        self.positions: list[np.ndarray] = []

    def __call__(self, state: Contraction) -> None:
        if len(state.report.iterations) == 1:
            self.shown = thinned(state.points, self.most_points)
            self.positions = [state.points[self.shown]]
        self.positions.append(state.contracted[state.survivor_of_point[self.shown]])
