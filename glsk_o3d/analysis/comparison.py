"""How far a skeleton is from a known axis."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from ..skeleton import Skeleton
from .curves import along, pieces
from .graph import check_graph, count_components, simple_edges
from .matching import JUNCTION_REACH, TIP_REACH, matching_f1, merged_junctions
from .truth import Truth

PLACE_SPACING = 0.1  # fitted: of the places where curves are compared, in median true radii


@dataclass(frozen=True, eq=False)
class Comparison:
    """How far a skeleton is from a known axis.

    Curves are compared at places a tenth of the median true radius apart. A place on one curve is measured to the
    nearest place on the other, and "radius" is the true one there.

    Attributes
    ----------
    error : float
        Mean over the skeleton of its distance to the axis over the radius. 0 is best; 1 is the surface.
    inside : float
        Share of the skeleton that is less than a radius away from the axis. 0 to 1, 1 is best.
    completeness : float
        Share of the axis that is less than a radius away from the skeleton. 0 to 1, 1 is best.
    length : float or None
        Length of the skeleton over that of the axis. 1 is best. None if that has none.
    ends : float or None
        Mean over the axis's leaves of the distance to the nearest leaf of the skeleton (to its nearest vertex, if it
        has no leaf) over the radius at the axis's leaf. 0 is best. None if the axis has no leaf.
    radius_error : float or None
        Mean over the skeleton of ``|r - radius| / radius``, with its own radii r interpolated along its edges. 0 is
        best. None if the skeleton has no radii; places between vertices of which one has none do not count.
    tips_f1 : float
        F1 of the skeleton's leaves as a guess at the axis's: twice the number of pairs over that of all leaves. Pairs
        are made nearest first, each leaf once, no further apart than 2.5 times the radius at the axis's leaf: one from
        there to the tip of the surface, 1.5 along the axis. 0 to 1, 1 is best, also if neither has a leaf.
    junctions_f1 : float
        The same for junctions. Those less than a local radius apart are one, at their mean, in the skeleton and in the
        axis; pairs are no further apart than two local radii. The local radius is that of the thickest part around.
    components, loops, leaves, junctions : int
        Their number in the skeleton minus that in the axis. Loops are counted by the cycle rank.
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
        """The numbers, as JSON holds them.

        Returns
        -------
        dict of str to float, int, bool or None
        """
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
    >>> from glsk_o3d.samples import torus
    >>> from glsk_o3d.skeleton import Skeleton
    >>> ring = torus(500)
    >>> axis = Skeleton(ring.nodes, ring.edges, ring.radii, (), (), ())
    >>> compare(axis, ring).topology
    True
    """
    truth = truth if isinstance(truth, Truth) else Truth(truth.nodes, truth.edges, truth.radii)
    vertices, edges = skeleton.vertices, check_graph(skeleton.vertices, skeleton.edges, "skeleton")
    step = PLACE_SPACING * np.median(truth.radii)
    row, part = pieces(truth.nodes, truth.edges, step)
    axis, axis_radius = (along(truth.edges, row, part, values) for values in (truth.nodes, truth.radii))
    row, part = pieces(vertices, edges, step)
    radii = skeleton.radii if len(skeleton.radii) == len(vertices) else np.full(len(vertices), np.nan)
    curve, curve_radius = (along(edges, row, part, values) for values in (vertices, radii))
    to_axis, nearest = cKDTree(axis).query(curve)
    to_curve, _ = cKDTree(curve).query(axis)
    radius = axis_radius[nearest]

    mine, degree = _structure(len(vertices), edges)
    true, true_degree = _structure(len(truth.nodes), truth.edges)
    difference = {name: mine[name] - true[name] for name in true}
    topology = difference["components"] == 0 == difference["loops"]
    tips, leaves = true_degree == 1, degree == 1
    to_leaf = cKDTree(vertices[leaves] if leaves.any() else vertices).query(truth.nodes[tips])[0] / truth.radii[tips]
    tips_f1 = matching_f1(vertices[leaves], truth.nodes[tips], TIP_REACH * truth.radii[tips])
    forks, local = merged_junctions(truth.nodes[true_degree > 2], axis, axis_radius)
    found_forks, _ = merged_junctions(vertices[degree > 2], axis, axis_radius)
    whole = _length(truth.nodes, truth.edges)
    known = np.isfinite(curve_radius)
    off = np.abs(curve_radius - radius)[known] / radius[known]
    return Comparison(
        error=float(np.mean(to_axis / radius)),
        inside=float(np.mean(to_axis < radius)),
        completeness=float(np.mean(to_curve < axis_radius)),
        length=_length(vertices, edges) / whole if whole > 0 else None,
        ends=float(to_leaf.mean()) if tips.any() else None,
        radius_error=float(off.mean()) if len(off) else None,
        tips_f1=tips_f1,
        junctions_f1=matching_f1(found_forks, forks, JUNCTION_REACH * local),
        **difference,
        topology=topology,
        perfect=topology and tips_f1 == 1,
        edge_error=np.bincount(row, to_axis / radius) / np.bincount(row) if len(edges) else np.empty(0),
    )


def _length(nodes, edges):
    return float(np.linalg.norm(nodes[edges[:, 1]] - nodes[edges[:, 0]], axis=1).sum())


def _structure(n, edges):
    """Components, loops, leaves and junctions of a graph, and the degrees of its n vertices."""
    edges = simple_edges(edges)
    components = count_components(n, edges)
    degree = np.bincount(edges.ravel(), minlength=n)
    loops = len(edges) - n + components
    leaves, junctions = int((degree == 1).sum()), int((degree > 2).sum())
    return {"components": components, "loops": loops, "leaves": leaves, "junctions": junctions}, degree
