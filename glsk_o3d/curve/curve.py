"""The working graph of the filters that refine a skeleton: unchecked, and what follows from it is computed once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..data.derived import derived, fields_of
from ..data.graph import Graph, in_order_of_ends
from ..data.skeleton import Skeleton
from .axis.sections import Sections, VertexPoints, measure_sections


@dataclass(frozen=True, eq=False)
class Curve(Graph):
    """A skeleton while it is refined, with the fields of `Skeleton`: nothing is checked, and edges are in order."""

    @classmethod
    def of(cls, skeleton: Skeleton) -> Curve:
        """The curve of a skeleton."""
        return cls(**fields_of(skeleton, Graph))

    def to_skeleton(self) -> Skeleton:
        """The finished skeleton, checked, every point of which represents itself."""
        return Skeleton(**fields_of(self, Graph) | dict(representative_of_point=None))

    def rewired(self, edges: np.ndarray, **changes: Any) -> Curve:
        """The same with other edges, in any order, and other fields.

        Where there are other vertices, what is not given of them is unknown.
        """
        if "vertices" in changes:
            radii, unknown = changes["radii"], np.full(len(changes["vertices"]), np.nan)
            unknown_fields = dict(half_width=radii, half_thickness=radii, confidence=unknown, support=unknown)
            changes = unknown_fields | changes
        m = len(changes.get("vertices", self.vertices))
        return self.changed(edges=in_order_of_ends(edges, m), **changes)

    def with_gaps(self, ends: np.ndarray) -> Curve:
        """The same with the ends, (g, 2, 3) float array, of more stretches that no point supports in its report."""
        return self.with_facts(joined=(*self.report.joined, *((tuple(a), tuple(b)) for a, b in ends.tolist())))

    @property
    def binary_size(self) -> float:
        """The power of two next to its extent, so that scaling by it rounds nothing; 1 if it has none."""
        extent = np.ptp(self.vertices, axis=0).max(initial=0)
        return float(2.0 ** np.round(np.log2(extent))) if extent > 0 else 1.0

    def scaled(self, factor: float) -> Curve:
        """The same in another unit of length."""
        lengths = ("vertices", "points", "radii", "half_width", "half_thickness")
        other = self.changed(**{name: factor * getattr(self, name) for name in lengths})
        return other.with_facts(joined=()).with_gaps(factor * np.array(self.report.joined).reshape(-1, 2, 3))

    @derived("vertices", "vertex_of_point", "points", "normals")
    def cloud(self) -> VertexPoints:
        """The points that support it."""
        return VertexPoints(self)

    @derived("vertices", "edges", "radii", "vertex_of_point", "points", "normals")
    def sections(self) -> Sections:
        """The sections of the object at its vertices."""
        return measure_sections(self, self.cloud)
