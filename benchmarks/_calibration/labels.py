"""What is so: questions about the topology, answered by the true axis."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from glsk_o3d.analysis import Truth

STEP = 0.3  # between places on the true axis, in median radii
CANDIDATES = 32  # nearest places, of which the one counts whose ball is nearest: thin parts grow out of thick ones
NEAR = 4  # edges on either side of the weakest place of a branch in which it may cross air
AIR_WAY, AIR_RADII = 2.0, 3.0  # across air is what is so many times farther along the axis, and so many radii more
SAME_WAY, SAME_RADII = 1.5, 2.0  # and with a gap in one part the axis goes on no farther round than that


class Placed:
    """Vertices at their places on a true axis, and the ways between these along it.

    Parameters
    ----------
    truth : Truth
    vertices : (m, 3) float array
    """

    def __init__(self, truth: Truth, vertices: np.ndarray) -> None:
        points, radii, links = _places(truth)
        lengths = np.maximum(np.linalg.norm(points[links[:, 1]] - points[links[:, 0]], axis=1), np.finfo(float).tiny)
        near, which = cKDTree(points).query(vertices, k=range(1, 1 + min(CANDIDATES, len(points))))
        self.place = which[np.arange(len(vertices)), np.argmin(near - radii[which], axis=1)]
        graph = coo_array((lengths, links.T), shape=(len(points), len(points))).tocsr()
        starts, self._row = np.unique(self.place, return_inverse=True)
        self._way, self._before = dijkstra(graph, directed=False, indices=starts, return_predecessors=True)
        self._points, self._radii = points, radii

    def apart(self, i: np.ndarray, j: np.ndarray) -> np.ndarray:
        """Whether there is air between vertices i and j: along the axis it is much farther, bool array."""
        return self._along(i, j) > AIR_WAY * self._across(i, j) + AIR_RADII * self._thickness(i, j)

    def joined(self, i: np.ndarray, j: np.ndarray) -> np.ndarray:
        """Whether the object goes on from vertices i to j, bool array."""
        return self._along(i, j) < SAME_WAY * self._across(i, j) + SAME_RADII * self._thickness(i, j)

    def crosses_air(self, branch: np.ndarray, k: int) -> bool:
        """Whether there is air between neighbours on a branch, near its edge k."""
        there = branch[max(k - NEAR, 0) : k + NEAR + 2]
        return bool(self.apart(there[:-1], there[1:]).any())

    def is_handle(self, cycle: np.ndarray) -> bool | None:
        """Whether the walk along the true axis that follows a loop goes round a loop of it, and not only to and fro.

        None where the loop crosses air: it is no handle, but to zip it up would join what is apart.
        """
        if self.apart(cycle, np.roll(cycle, -1)).any():
            return None
        flow: dict[tuple[int, int], int] = {}
        for a, b in zip(cycle.tolist(), np.roll(cycle, -1).tolist(), strict=True):
            start, here = int(self.place[a]), int(self.place[b])
            while here != start:
                before = int(self._before[self._row[a], here])
                link, way = ((before, here), 1) if before < here else ((here, before), -1)
                flow[link] = flow.get(link, 0) + way
                here = before
        return any(flow.values())

    def _along(self, i, j):
        return self._way[self._row[i], self.place[j]]

    def _across(self, i, j):
        return np.linalg.norm(self._points[self.place[i]] - self._points[self.place[j]], axis=-1)

    def _thickness(self, i, j):
        return np.maximum(self._radii[self.place[i]], self._radii[self.place[j]])


def _places(truth):
    """Nodes and places on the edges between them, their radii, and the links along the axis."""
    nodes, radii, edges = truth.nodes, truth.radii, truth.edges
    step = nodes[edges[:, 1]] - nodes[edges[:, 0]]
    pieces = np.maximum(np.ceil(np.linalg.norm(step, axis=1) / (STEP * np.median(radii))).astype(int), 1)
    edge = np.repeat(np.arange(len(edges)), pieces)
    k = np.arange(len(edge)) - (np.cumsum(pieces) - pieces)[edge]  # of the pieces of its edge
    # every piece but the last of its edge ends in a place of its own
    own = k + 1 < pieces[edge]
    named = len(nodes) + np.cumsum(own) - 1
    links = np.column_stack([np.where(k == 0, edges[edge, 0], np.roll(named, 1)), np.where(own, named, edges[edge, 1])])
    t = ((k + 1) / pieces[edge])[own]
    edge = edge[own]
    a, b = edges[edge].T
    points = np.concatenate([nodes, nodes[a] + t[:, None] * step[edge]])
    return points, np.concatenate([radii, radii[a] + t * (radii[b] - radii[a])]), links
