"""How far a skeleton is from a known axis."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from ..skeleton import Skeleton
from .curves import places_along
from .graph import check_graph, simple_edges
from .matching import JUNCTION_REACH, TIP_REACH, matching_f1, merged_junctions
from .summary import structure
from .truth import Truth

PLACE_SPACING = 0.1  # fitted: of the places where curves are compared, in median true radii
COUNTS = ("components", "loops", "leaves", "junctions")


@dataclass(frozen=True, eq=False)
class Comparison:
    """How far a skeleton is from a known axis.

    Distances are those from places along one curve to the nearest place on the other, over the true radius there. More
    on every measure: docs/evaluation.md.

    Attributes
    ----------
    error : float
        Mean over the skeleton of its distance to the axis over the radius. 0 is best; 1 is the surface.
    inside : float
        Share of the skeleton that is less than a radius away from the axis.
    completeness : float
        Share of the axis that is less than a radius away from the skeleton.
    length : float or None
        Length of the skeleton over that of the axis. 1 is best. None if the axis has none.
    ends : float or None
        Mean over the axis's leaves of the distance to the nearest leaf of the skeleton (to its nearest vertex, if it
        has no leaf) over the radius. 0 is best. None if the axis has no leaf.
    radius_error : float or None
        Mean over the skeleton of ``|r - radius| / radius``, with its own radii r. 0 is best. None without radii.
    tips_f1, junctions_f1 : float
        F1 of the skeleton's leaves as a guess at the axis's, and of its junctions. 0 to 1, 1 is best, also if neither
        has any.
    components, loops, leaves, junctions : int
        Their number in the skeleton minus that in the axis.
    topology : bool
        Whether components and loops agree.
    perfect : bool
        Whether components and loops agree, and all leaves are matched: `tips_f1` is 1.
    edge_error : (E,) float array
        `error` of each edge of the skeleton. Not part of `as_dict`.

    Examples
    --------
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import torus
    >>> ring = torus(2000)
    >>> found = compare(skeletonize(ring.points), ring)
    >>> found.error < 0.2, found.loops, found.topology
    (True, 0, True)
    """

    error: float
    inside: float
    completeness: float
    length: float | None
    ends: float | None
    radius_error: float | None
    tips_f1: float
    junctions_f1: float
    components: int
    loops: int
    leaves: int
    junctions: int
    topology: bool
    perfect: bool
    edge_error: np.ndarray = field(repr=False)

    def as_dict(self) -> dict[str, Any]:
        """The numbers, as JSON holds them."""
        return {name: value for name, value in vars(self).items() if name != "edge_error"}


def compare(skeleton: Skeleton, truth: Any) -> Comparison:
    """Measure a skeleton against a known axis.

    Parameters
    ----------
    skeleton : Skeleton
        Only `vertices`, `edges` and `radii` count. If it has edges, vertices without an edge count as components alone.
    truth : Truth, Sample, or anything else with `nodes`, `edges` and `radii`
        In the units of the skeleton.

    Returns
    -------
    Comparison

    Raises
    ------
    InvalidParameterError
        The skeleton is empty or not finite, or the truth is no axis (see `Truth`).

    Examples
    --------
    >>> from glsk_o3d import Skeleton
    >>> from glsk_o3d.samples import torus
    >>> ring = torus(500)
    >>> compare(Skeleton(ring.nodes, ring.edges, ring.radii, (), (), ()), ring).topology
    True
    """
    truth = truth if isinstance(truth, Truth) else Truth(truth.nodes, truth.edges, truth.radii)
    nothing = np.empty((0, 3))
    axis = Skeleton(truth.nodes, truth.edges, truth.radii, nothing, nothing, nothing)
    edges = check_graph(skeleton.vertices, skeleton.edges, "skeleton")
    radii = skeleton.radii if len(skeleton.radii) == len(skeleton.vertices) else np.full(len(skeleton.vertices), np.nan)
    curve = replace(skeleton, edges=edges, radii=radii)
    step = PLACE_SPACING * np.median(truth.radii)
    _, axis_places, axis_radius = places_along(axis, step)
    edge, curve_places, curve_radius = places_along(curve, step)
    to_axis, nearest = cKDTree(axis_places).query(curve_places)
    to_curve, _ = cKDTree(curve_places).query(axis_places)
    radius = axis_radius[nearest]
    error = to_axis / radius
    known = np.isfinite(curve_radius)
    radius_error = np.abs(curve_radius - radius)[known] / radius[known]

    mine, true = (replace(each, edges=simple_edges(each.edges)) for each in (curve, axis))
    mine_counts, true_counts = structure(mine), structure(true)
    difference = {name: mine_counts[name] - true_counts[name] for name in COUNTS}
    topology = difference["components"] == 0 == difference["loops"]
    tips, tip_radius = true.vertices[true.leaves], true.radii[true.leaves]
    ends = mine.vertices[mine.leaves] if len(mine.leaves) else mine.vertices
    to_end = cKDTree(ends).query(tips)[0] / tip_radius
    tips_f1 = matching_f1(mine.vertices[mine.leaves], tips, TIP_REACH * tip_radius)
    forks, local = merged_junctions(true.vertices[true.junctions], axis_places, axis_radius)
    found_forks, _ = merged_junctions(mine.vertices[mine.junctions], axis_places, axis_radius)
    return Comparison(
        error=float(np.mean(error)),
        inside=float(np.mean(to_axis < radius)),
        completeness=float(np.mean(to_curve < axis_radius)),
        length=curve.length / axis.length if axis.length > 0 else None,
        ends=float(to_end.mean()) if len(tips) else None,
        radius_error=float(radius_error.mean()) if len(radius_error) else None,
        tips_f1=tips_f1,
        junctions_f1=matching_f1(found_forks, forks, JUNCTION_REACH * local),
        **difference,
        topology=topology,
        perfect=topology and tips_f1 == 1,
        edge_error=np.bincount(edge, error) / np.bincount(edge) if len(edges) else np.empty(0),
    )
