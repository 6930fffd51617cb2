"""A shape from its family and its seed: draws until one is fair."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np

from glsk_o3d.errors import InvalidParameterError, did_you_mean
from glsk_o3d.geometry.groups import component_labels
from glsk_o3d.geometry.vectors import norm

from .axis import Draft, UnfitDraw
from .curves import generator
from .fairness import fault
from .figures import figures
from .frames import frames
from .groups import groups
from .handles import handles
from .surface import Surface, surface
from .things.animals import animals
from .things.blades import blades
from .things.fairness import fault_of
from .things.field import surface_of
from .things.implements import implements
from .things.mugs import mugs
from .things.plates import plates
from .things.prisms import prisms
from .things.rings import rings
from .things.solid import Solid
from .things.toys import toys
from .trees import trees
from .tubes import tubes

ROUND_CONES = (tubes, trees, frames, figures, handles, groups)
SECOND_THINGS = (prisms, implements, animals, plates, blades, mugs)
THINGS = (*SECOND_THINGS, toys, rings)
DRAWN_BY = {each.__name__: each for each in (*ROUND_CONES, *THINGS)}
"""The functions that draw, by family."""
FAMILIES = {
    version: tuple(each.__name__ for each in group)
    for version, group in (("v1", ROUND_CONES), ("v2", SECOND_THINGS), ("v3", THINGS))
}
"""The names of the families, by the version of the benchmark that has them."""
SURFACE_POINTS = 50_000  # fitted: of the whole surface, of which clouds are drawn: a dozen times as many as one has
JUDGED_CLOUD = 4096  # fitted: points of the cloud that must be able to show the shape
AREA_POINTS = 2000  # fitted: tell the area of a draw to a few percent
# Derived: around an edge, as a share of the diagonal: more than roundings, and less than points are apart.
STEADY_EDGE = 1e-9
MOST_DRAWS, MOST_THING_DRAWS = 3000, 400  # fitted: tens to hundreds of times what any seed has needed


@dataclass(frozen=True, eq=False, repr=False)
class Shape:
    """A random shape: its true axis and points of its whole surface; the diagonal of its bounding box is 1.

    Unless it is a `Thing`, the shape is the union of round cones: each node is a ball, and each edge the convex hull of
    its two balls. Its nodes, edges and radii are its curve skeleton; the last node of a tube is the middle of its round
    end.

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


@dataclass(frozen=True, eq=False, repr=False)
class Thing(Shape):
    """A random shape like a real object: sweeps of superellipses, with flat or round ends, and perhaps hollow.

    Its nodes and edges are the curve of the sections' centroids, its radii those of circles with the areas of the
    sections.

    Attributes
    ----------
    half_width : (M,) float64 array
        The longer half axis of the section at each node.
    flat : (k,) int64 array
        Nodes that are tips at a flat end: the axis stops half a radius inside the face.
    judged : (E,) bool array
        False for edges of which the axis is a matter of taste: those in the bowl of a vessel.
    mirror : (2, 3) float64 array
        A point of the plane of symmetry, and its unit normal; (0, 3) where there is none.
    facts : dict
        Those of a `Shape`; ``aspect_max``, the largest of the ratios of half axes; ``n_flat``; ``judged_share``, of the
        edges; ``symmetric``.

    Examples
    --------
    >>> mug = shape("mugs", 1)
    >>> int(mug.judged.sum()), len(mug.edges), mug.mirror.shape
    (29, 43, (0, 3))
    """

    half_width: np.ndarray
    flat: np.ndarray
    judged: np.ndarray
    mirror: np.ndarray


def shape(family: str, seed: int, *, steady: bool = False) -> Shape:
    """Draw a shape: the first fair draw of a family for this seed.

    Draws are refused whose topology is a matter of taste or is not in the data; `Shape.facts` tells how many were, and
    for what.

    Parameters
    ----------
    family : str
        One of those in `FAMILIES`.
    seed : int
        Not negative. The same numbers give the same shape.
    steady : bool
        Whether normals on the edges of flat ends of `animals` are the same on all processors, as in version v3; in v2
        roundings decide them, and thus what scanners see.

    Returns
    -------
    Shape
        A `Thing` of families whose shapes are things.

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
        raise InvalidParameterError(did_you_mean(str(family), DRAWN_BY, "family of shapes"))
    check_seed(seed)
    is_thing = DRAWN_BY[family] in THINGS
    refused: Counter[str] = Counter()
    for attempt in range(MOST_THING_DRAWS if is_thing else MOST_DRAWS):
        rng = generator("thing" if is_thing else "shape", family, seed, attempt)
        try:
            drawn = DRAWN_BY[family](rng).normalised()
            if isinstance(drawn, Solid) and (steady or family != "animals"):
                drawn.edge = STEADY_EDGE
        except UnfitDraw as reason:
            refused[str(reason)] += 1
            continue
        spacing = np.sqrt(_surface(drawn, AREA_POINTS, rng).area / JUDGED_CLOUD)
        wrong = _fault(drawn, spacing)
        if wrong is None:
            return _finished(drawn, family, int(seed), _surface(drawn, SURFACE_POINTS, rng), dict(refused))
        refused[wrong] += 1
    raise InvalidParameterError(f"no draw of {family} {seed} is fair ({dict(refused)}): take another seed")


def _surface(drawn: Draft, n: int, rng: np.random.Generator) -> Surface:
    """Points of the surface of a draw."""
    return (
        surface_of(drawn, n, rng)
        if isinstance(drawn, Solid)
        else surface(drawn.nodes, drawn.edges, drawn.radii, n, rng)
    )


def _fault(drawn: Draft, spacing: float) -> str | None:
    """What is wrong with a draw, in a word."""
    return (
        fault_of(drawn, spacing) if isinstance(drawn, Solid) else fault(drawn.nodes, drawn.edges, drawn.radii, spacing)
    )


def _finished(drawn: Draft, family: str, seed: int, found: Surface, refused: dict[str, int]) -> Shape:
    """What is told of a fair draw."""
    points, normals, area = found
    if isinstance(drawn, Solid):
        drawn, scale, points = drawn.boxed(points)
        area = area * scale**2
    name, graph = f"{family}_{seed}", (drawn.nodes, drawn.edges, drawn.radii)
    facts: dict[str, Any] = {"name": name, "kind": family, "meaningful_skeleton": True, **_facts(*graph, area)}
    facts["refused"] = refused
    if not isinstance(drawn, Solid):
        return Shape(name, family, seed, *graph, points, normals, facts)
    wide, thick = np.array(drawn.half_axes).T
    judged = ~np.isin(np.arange(len(drawn.links)), list(drawn.unjudged))
    mirror = np.empty((0, 3)) if drawn.mirror is None else drawn.mirror
    facts |= {"aspect_max": float((wide / thick).max()), "n_flat": len(drawn.flat)}
    facts |= {"judged_share": float(judged.mean()), "symmetric": drawn.mirror is not None}
    flat = np.array(drawn.flat, np.int64)
    return Thing(name, family, seed, *graph, points, normals, facts, wide.copy(), flat, judged, mirror)


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
