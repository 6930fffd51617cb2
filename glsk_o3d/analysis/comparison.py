"""A known axis, and how far a skeleton is from it."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from ..data.skeleton import Skeleton, check_skeleton
from ..errors import InvalidParameterError
from ..geometry.groups import component_labels
from .curves import check_graph, places_along, simple_edges
from .summary import structure

PLACE_SPACING = 0.1  # fitted: of the places where curves are compared, in median true radii
# derived: one radius from where the axis ends, in the middle of the round end, to the tip, and 1.5 along the axis
TIP_REACH = 2.5
# derived: the place where limbs meet is known to a local radius, in the skeleton and in the axis
JUNCTION_REACH = 2.0


@dataclass(eq=False)
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
    """

    nodes: np.ndarray
    edges: np.ndarray
    radii: np.ndarray

    def __post_init__(self) -> None:
        try:
            self.nodes = np.asarray(self.nodes, float).reshape(-1, 3)
            self.radii = np.asarray(self.radii, float).reshape(-1)
        except (TypeError, ValueError) as error:
            raise InvalidParameterError(f"the truth has invalid nodes or radii: {error}") from None
        if len(self.nodes) == 0:
            raise InvalidParameterError("the truth has no nodes: there is no axis to compare with")
        if len(self.radii) != len(self.nodes) or not (np.isfinite(self.radii) & (self.radii > 0)).all():
            raise InvalidParameterError("the truth must have a positive, finite radius at each of its nodes")
        self.edges = check_graph(self.nodes, self.edges, "truth")


@dataclass(frozen=True)
class Comparison:
    """How far a skeleton is from a known axis.

    Distances are those from places along one curve to the nearest place on the other, over the true radius there. More
    on every measure: docs/evaluation.md.

    Attributes
    ----------
    error, inside : float
        Mean over the skeleton of its distance to the axis over the radius, of which 1 is the surface; share of it that
        is less than a radius away.
    completeness : float
        Share of the axis that is less than a radius away from the skeleton.
    length : float or None
        Length of the skeleton over that of the axis. None if the axis has none.
    ends : float or None
        Mean over the axis's leaves of the distance to the nearest leaf of the skeleton (to its nearest vertex, if it
        has no leaf) over the radius. None if the axis has no leaf.
    radius_error : float or None
        Mean over the skeleton of ``|r - radius| / radius``, with its own radii r. None without radii.
    tips_f1, junctions_f1 : float
        F1 of the skeleton's leaves as a guess at the axis's, and of its junctions; 1 also if neither has any.
    components, loops, leaves, junctions : int
        Their number in the skeleton minus that in the axis.
    topology, perfect : bool
        Whether components and loops agree; and also all leaves are matched: `tips_f1` is 1.
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


def compare(skeleton: Skeleton, truth: Any) -> Comparison:
    """Measure a skeleton against a known axis.

    Parameters
    ----------
    skeleton : Skeleton
        Only `vertices`, `edges` and `radii` count. If it has edges, vertices without an edge count as components alone.
    truth : Truth, Sample, another Skeleton, or anything else with `nodes`, `edges` and `radii`
        In the units of the skeleton.

    Returns
    -------
    Comparison

    Raises
    ------
    InvalidParameterError
        The skeleton is empty, or the truth is no axis (see `Truth`).

    Examples
    --------
    >>> from glsk_o3d import Skeleton
    >>> from glsk_o3d.samples import torus
    >>> ring = torus(500)
    >>> compare(Skeleton(ring.nodes, ring.edges, ring.radii, (), (), ()), ring).topology
    True
    """
    check_skeleton(skeleton)
    none = np.empty(0)
    if not isinstance(truth, Truth):
        nodes = truth.vertices if isinstance(truth, Skeleton) else getattr(truth, "nodes", none)
        truth = Truth(nodes, getattr(truth, "edges", none), getattr(truth, "radii", none))
    axis = Skeleton(truth.nodes, simple_edges(truth.edges), truth.radii, none, none, none)
    if len(skeleton.vertices) == 0:
        raise InvalidParameterError("the skeleton is empty: there is nothing to compare")
    step = PLACE_SPACING * np.median(truth.radii)
    _, axis_places, axis_radius = places_along(axis, step)
    _, curve_places, curve_radius = places_along(skeleton, step)
    to_axis, nearest = cKDTree(axis_places).query(curve_places)
    to_curve, _ = cKDTree(curve_places).query(axis_places)
    radius = axis_radius[nearest]
    error = to_axis / radius
    known = np.isfinite(curve_radius)
    radius_error = np.abs(curve_radius - radius)[known] / radius[known]

    counts, true_counts = structure(skeleton), structure(axis)
    difference = {name: counts[name] - true_counts[name] for name in ("components", "loops", "leaves", "junctions")}
    topology = difference["components"] == 0 == difference["loops"]
    tips, tip_radius = axis.vertices[axis.leaves], axis.radii[axis.leaves]
    ends = skeleton.vertices[skeleton.leaves] if len(skeleton.leaves) else skeleton.vertices
    to_end = cKDTree(ends).query(tips)[0] / tip_radius
    tips_f1 = matching_f1(skeleton.vertices[skeleton.leaves], tips, TIP_REACH * tip_radius)
    true_junctions, local_radius = merged_junctions(axis.vertices[axis.junctions], axis_places, axis_radius)
    junctions, _ = merged_junctions(skeleton.vertices[skeleton.junctions], axis_places, axis_radius)
    return Comparison(
        error=float(np.mean(error)),
        inside=float(np.mean(to_axis < radius)),
        completeness=float(np.mean(to_curve < axis_radius)),
        length=skeleton.length / axis.length if axis.length > 0 else None,
        ends=float(to_end.mean()) if len(tips) else None,
        radius_error=float(radius_error.mean()) if len(radius_error) else None,
        tips_f1=tips_f1,
        junctions_f1=matching_f1(junctions, true_junctions, JUNCTION_REACH * local_radius),
        **difference,
        topology=topology,
        perfect=topology and tips_f1 == 1,
    )


def matching_f1(points: np.ndarray, true: np.ndarray, reach: np.ndarray) -> float:
    """F1 of points as a guess at the true ones, (n, 3) and (m, 3); 1 if there are neither.

    A pair is no further apart than the `reach`, (m,), of its true point. The nearest pairs come first, each point once.
    """
    if len(points) == 0 or len(true) == 0:
        return float(len(points) == len(true))
    return 2 * len(matched(points, true, reach)) / (len(points) + len(true))


def matched(points: np.ndarray, targets: np.ndarray, reach: np.ndarray) -> list[tuple[int, int]]:
    """The pairs of `matching_f1`: a list of (row of `points`, row of `targets`); `reach` may also be (n, m)."""
    distance = cdist(points, targets)
    return nearest_pairs(np.where(distance <= reach, distance, np.inf))


def nearest_pairs(distance: np.ndarray) -> list[tuple[int, int]]:
    """Pairs (row, column) of finite distances, which become infinite: the nearest first, each row and column once."""
    pairs = []
    while np.isfinite(distance.min(initial=np.inf)):
        row, column = np.unravel_index(distance.argmin(), distance.shape)
        distance[row], distance[:, column] = np.inf, np.inf
        pairs.append((int(row), int(column)))
    return pairs


def merged_junctions(points: np.ndarray, axis: np.ndarray, axis_radius: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Clusters of junctions, (n, 3), that are within a local radius of the next one: their means and local radii.

    The local radius of a junction is that of the thickest part whose ball around a place of the axis holds it, else
    that of the nearest place; of a cluster it is the largest. `axis` (k, 3) and `axis_radius` (k,) are places along the
    true axis.
    """
    distance = cdist(points, axis)
    local = np.where(distance < axis_radius, axis_radius, 0.0).max(axis=1)
    local = np.where(local > 0, local, axis_radius[distance.argmin(axis=1)])
    near = cdist(points, points) <= np.maximum(local[:, None], local)
    group = component_labels(len(points), np.argwhere(near))
    size = np.bincount(group)
    means = np.column_stack([np.bincount(group, values) for values in points.T]) / size[:, None]
    largest = np.zeros(len(size))
    np.maximum.at(largest, group, local)
    return means, largest
