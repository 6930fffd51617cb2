"""A shape from its family and its seed: draws until one is fair."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np

from glsk_o3d.errors import InvalidParameterError, did_you_mean
from glsk_o3d.numerics.groups import component_labels
from glsk_o3d.numerics.vectors import norm

from .axis import UnfitDraw
from .curves import generator
from .fairness import fault
from .figures import figures
from .frames import frames
from .groups import groups
from .handles import handles
from .surface import surface
from .trees import trees
from .tubes import tubes

DRAWN_BY = {each.__name__: each for each in (tubes, trees, frames, figures, handles, groups)}
"""The functions that draw, by family."""
FAMILIES = tuple(DRAWN_BY)
"""The names of the families."""
SURFACE_POINTS = 50_000  # fitted: of the whole surface, of which clouds are drawn: a dozen times as many as one has
JUDGED_CLOUD = 4096  # fitted: points of the cloud that must be able to show the shape
AREA_POINTS = 2000  # fitted: tell the area of a draw to a few percent
MOST_DRAWS = 3000  # fitted: hundreds of times what any seed has needed


@dataclass(frozen=True, eq=False, repr=False)
class Shape:
    """A random shape: its true axis and points of its whole surface; the diagonal of its bounding box is 1.

    The shape is the union of round cones: each node is a ball, and each edge the convex hull of its two balls. Its
    nodes, edges and radii are its curve skeleton; the last node of a tube is the middle of its round end.

    Attributes
    ----------
    name : str
        Family and seed, such as ``"trees_7"``.
    family : str
    seed : int
    nodes : (M, 3) float64 array
    edges : (E, 2) int64 array
    radii : (M,) float64 array
    points : (N, 3) float64 array
        Of the whole surface, uniform by area.
    normals : (N, 3) float64 array
        There, outward, of length 1.
    facts : dict
        ``n_nodes``, ``n_edges``, ``n_components``, ``cycle_rank`` (loops), ``n_leaves``, ``n_junctions``, ``length``,
        ``radius_min``, ``radius_median`` and ``radius_max`` of the axis; the ``area`` of the surface;
        ``spacing_per_median_radius``, the mean distance of 4096 points; ``refused``, how many draws before this one
        were refused for what; and ``name``, ``kind`` (the family) and ``meaningful_skeleton`` (yes), so that the facts
        are a row of a manifest.

    Examples
    --------
    >>> ring = shape("handles", 1)
    >>> ring
    Shape('handles_1': 1 component, 1 loop, 0 leaves)
    >>> ring.facts["refused"]
    {}
    """

    name: str
    family: str
    seed: int
    nodes: np.ndarray
    edges: np.ndarray
    radii: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    facts: dict[str, Any]

    def __repr__(self) -> str:
        counts = {"component": "n_components", "loop": "cycle_rank", "leaf": "n_leaves"}
        told = [(word, self.facts[fact]) for word, fact in counts.items()]
        plural = {"component": "components", "loop": "loops", "leaf": "leaves"}
        return f"Shape({self.name!r}: {', '.join(f'{n} {word if n == 1 else plural[word]}' for word, n in told)})"

    @property
    def spacing(self) -> float:
        """How far its `points` are apart, about: the side of a square that has one of them."""
        return float(np.sqrt(self.facts["area"] / len(self.points)))


def shape(family: str, seed: int) -> Shape:
    """Draw a shape: the first fair draw of a family for this seed.

    Draws are refused whose topology is a matter of taste or is not in the data; `Shape.facts` tells how many were, and
    for what.

    Parameters
    ----------
    family : str
        One of `FAMILIES`.
    seed : int
        Not negative. The same numbers give the same shape.

    Returns
    -------
    Shape

    Raises
    ------
    InvalidParameterError
        There is no such family, the seed is negative or no whole number, or none of its draws is fair.

    Examples
    --------
    >>> tree = shape("trees", 7)
    >>> tree.facts["cycle_rank"], tree.points.shape
    (0, (50000, 3))
    """
    if not isinstance(family, str) or family not in DRAWN_BY:
        raise InvalidParameterError(did_you_mean(str(family), FAMILIES, "family of shapes"))
    check_seed(seed)
    refused: Counter[str] = Counter()
    for attempt in range(MOST_DRAWS):
        rng = generator("shape", family, seed, attempt)
        try:
            axis = DRAWN_BY[family](rng).normalised()
        except UnfitDraw as reason:
            refused[str(reason)] += 1
            continue
        graph = axis.nodes, axis.edges, axis.radii
        spacing = np.sqrt(surface(*graph, AREA_POINTS, rng).area / JUDGED_CLOUD)
        wrong = fault(*graph, spacing)
        if wrong is None:
            points, normals, area = surface(*graph, SURFACE_POINTS, rng)
            name = f"{family}_{seed}"
            facts: dict[str, Any] = {"name": name, "kind": family, "meaningful_skeleton": True, **_facts(*graph, area)}
            return Shape(name, family, int(seed), *graph, points, normals, facts | {"refused": dict(refused)})
        refused[wrong] += 1
    raise InvalidParameterError(f"no draw of {family} {seed} is fair ({dict(refused)}): take another seed")


def check_seed(seed: int) -> None:
    """Raise InvalidParameterError unless `seed` is a whole number and not negative."""
    if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or seed < 0:
        raise InvalidParameterError(f"seed = {seed!r}: must be an int of at least 0")


def _facts(nodes, edges, radii, area):
    """What can be counted and measured of an axis, and how far 4096 points are apart on its surface."""
    degree = np.bincount(edges.ravel(), minlength=len(nodes))
    components, median = int(component_labels(len(nodes), edges).max()) + 1, float(np.median(radii))
    return {
        "n_nodes": len(nodes),
        "n_edges": len(edges),
        "n_components": components,
        "cycle_rank": len(edges) - len(nodes) + components,
        "n_leaves": int((degree == 1).sum()),
        "n_junctions": int((degree > 2).sum()),
        "length": float(norm(nodes[edges[:, 1]] - nodes[edges[:, 0]]).sum()),
        "radius_min": float(radii.min()),
        "radius_median": median,
        "radius_max": float(radii.max()),
        "area": area,
        "spacing_per_median_radius": {str(JUDGED_CLOUD): round(float(np.sqrt(area / JUDGED_CLOUD)) / median, 3)},
    }
