"""A known axis, to measure a skeleton against."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import InvalidParameterError
from .graph import check_graph


@dataclass(frozen=True, eq=False)
class Truth:
    """A known axis: a graph of straight edges with the distance to the surface at its nodes.

    Attributes
    ----------
    nodes : (M, 3) float64 array
    edges : (E, 2) int64 array
        Without any, the nodes themselves are the axis: a ball has one.
    radii : (M,) float64 array
        Positive, in the units of `nodes`.

    Raises
    ------
    InvalidParameterError
        There are no nodes, shapes do not fit, a number is not finite, a radius is not positive, or an edge names a
        missing node.

    Examples
    --------
    >>> from glsk_o3d.samples import torus
    >>> ring = torus(1000)
    >>> truth = Truth(ring.nodes, ring.edges, ring.radii)
    >>> len(truth.nodes) == len(ring.nodes)
    True
    """

    nodes: np.ndarray
    edges: np.ndarray
    radii: np.ndarray

    def __post_init__(self):
        try:
            nodes = np.asarray(self.nodes, float).reshape(-1, 3)
            radii = np.asarray(self.radii, float).reshape(-1)
        except (TypeError, ValueError) as error:
            raise InvalidParameterError(f"the truth has nodes or radii of no use: {error}") from None
        if len(nodes) == 0:
            raise InvalidParameterError("the truth has no nodes: there is no axis to compare with")
        if len(radii) != len(nodes) or not (np.isfinite(radii) & (radii > 0)).all():
            raise InvalidParameterError("the truth must have a positive, finite radius at each of its nodes")
        edges = check_graph(nodes, self.edges, "truth")
        for name, array in (("nodes", nodes), ("edges", edges), ("radii", radii)):
            object.__setattr__(self, name, array)
