"""The axes of plants, as formats have them that tell edges that go on from edges that branch off."""

from __future__ import annotations

import numpy as np

from ...analysis.branches import branch_table
from ...numerics.polylines import arc_lengths
from ...skeleton import Skeleton
from .forests import parents
from .graphs import graph_skeleton


def plant_axes(skeleton: Skeleton) -> tuple[np.ndarray, np.ndarray]:
    """The parent of every vertex, and which vertices begin an axis.

    Parameters
    ----------
    skeleton : Skeleton
        Without loops, numbered from its roots outwards as by `editing.reroot`.

    Returns
    -------
    parent : (M,) int array
        -1 for roots.
    begins : (M,) bool array
        Whether the edge from the parent branches off; else it goes on. As in `BranchTable`, but for a root from which
        several axes of order 0 grow: there the thickest goes on, the longest of those that are as thick.

    Examples
    --------
    >>> places = [[0, 0, 0], [0, 0, 1], [0, 0, 2], [1, 0, 1]]
    >>> plant_axes(Skeleton(places, [[0, 1], [1, 2], [1, 3]], [0.2, 0.2, 0.2, 0.1], (), (), ()))
    (array([-1,  0,  1,  1]), array([False, False, False,  True]))
    """
    parent, begins = parents(skeleton), np.zeros(len(skeleton.vertices), bool)
    part = skeleton.component_of_vertex
    for each in range(skeleton.n_components):
        (mine,) = np.nonzero(part == each)
        edges = np.searchsorted(mine, skeleton.edges[part[skeleton.edges[:, 0]] == each])
        begins[mine[_beginnings(graph_skeleton(skeleton.vertices[mine], edges, skeleton.radii[mine]))]] = True
    return parent, begins


def _beginnings(plant: Skeleton) -> list[int]:
    """The first vertices, after the one that they grow from, of all axes but the stem."""
    table = branch_table(plant, 0)
    found: list[int] = []
    at_root: list[tuple[float, float, int]] = []
    for row, path in enumerate(plant.branches):
        foot = int(np.argmin(path))  # an end, unless the root is inside the branch
        for side in (path[foot::-1], path[foot:]):
            if len(side) < 2:
                continue
            if side[0] == 0:
                length = float(arc_lengths(plant.vertices[side])[-1])
                at_root.append((float(np.nan_to_num(table.mean_radius[row])), length, int(side[1])))
            elif table.axis[row] == row:
                found.append(int(side[1]))
    stem = max(at_root, default=None)
    return found + [vertex for *rank, vertex in at_root if stem != (*rank, vertex)]
