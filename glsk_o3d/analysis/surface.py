"""Distances along a surface: which parts of an object are apart though they touch."""

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra, minimum_spanning_tree

from ..data.skeleton import Skeleton
from ..geometry.cycles import edges_on_cycles
from ..geometry.groups import component_labels
from ..geometry.near_links import linked
from ..geometry.vectors import TINY
from .segmentation import vertex_of_cloud

TOUCH_WINDOWS = (1.0, 2.0, 3.0)  # fitted: radii either way along a loop, over which it is compared with the surface
TOUCH_RATIO = 3.0  # fitted: distance along the surface over that along the curve, of parts that touch
LONGEST_RATIO = 10.0  # speed: of the same, beyond which nobody looks


class Surface:
    """The points of a mesh, those in one place as one, and the sides of its triangles."""

    def __init__(self, points: np.ndarray, triangles: np.ndarray) -> None:
        _, first, self.place = np.unique(points, axis=0, return_index=True, return_inverse=True)
        self.place = self.place.reshape(-1)
        self.sides = self.place[triangles[:, [0, 1, 1, 2, 2, 0]]].reshape(-1, 2)
        self.links = linked(points[first], self.sides)

    def distances(self, sources: np.ndarray, limit: float = np.inf) -> np.ndarray:
        """Distance of every point (N,) from the nearest of some, (N,) bool array; infinite beyond the limit."""
        places = np.unique(self.place[sources])
        nearest: np.ndarray = dijkstra(self.links, indices=places, min_only=True, limit=limit)[self.place]
        return nearest

    def continued(self, vertex: np.ndarray, bone_of_vertex: np.ndarray, table: np.ndarray) -> np.ndarray:
        """The vertex of every point (N,), of a piece that no surface joins with others of its part that of the nearest.

        Points side by side on the surface are on one piece if their bones are near to each other, as in the `table`; a
        smaller piece of a component than its largest got there through empty space.
        """
        n = len(self.links.indptr) - 1
        own = np.zeros(n, int)
        own[self.place] = vertex
        bone = bone_of_vertex[own]
        first, second = self.sides.T
        near = (table[bone[first]] == bone[second][:, None]).any(axis=1)
        piece, part = component_labels(n, self.sides[near]), component_labels(n, self.sides)
        size = np.bincount(piece)
        part_of_piece = np.zeros(len(size), int)
        part_of_piece[piece] = part
        largest = np.lexsort((size, part_of_piece))[np.append(np.diff(np.sort(part_of_piece)) > 0, True)]
        known = np.isin(piece, largest)
        if not known.all():
            _, _, source = dijkstra(self.links, indices=np.flatnonzero(known), min_only=True, return_predecessors=True)
            own = np.where(source >= 0, own[source], own)
        return own[self.place]


def without_loops(skeleton: Skeleton, points: np.ndarray, surface: Surface | None, cut: bool) -> Skeleton:
    """A skeleton without the loops that parts close which touch in the cloud, and are apart in a mesh.

    Of these the edge goes where the way along the surface is longest. If `cut`, others go at their thinnest edge.
    """
    if skeleton.n_loops == 0:
        return skeleton
    m, ratio = len(skeleton.vertices), np.zeros(len(skeleton.edges))
    if surface is not None:
        ratio = _surface_ratios(skeleton, points, surface)
    thick = np.nan_to_num(skeleton.radii)[skeleton.edges].min(axis=1)
    weight = np.where(ratio > TOUCH_RATIO, ratio, 2 - thick / max(thick.max(), TINY))  # from 1 to 2, below any touch
    tree = minimum_spanning_tree(csr_array((weight, skeleton.edges.T), shape=(m, m)))
    stays = np.isin(skeleton.edges @ [m, 1], np.column_stack(tree.nonzero()) @ [m, 1])
    return skeleton.changed(edges=skeleton.edges[stays | ((ratio <= TOUCH_RATIO) & (not cut))])


def _surface_ratios(skeleton: Skeleton, points: np.ndarray, surface: Surface) -> np.ndarray:
    """Distance along the surface over that along the curve, around every edge on a loop, (E,); 0 where unknown."""
    vertex = vertex_of_cloud(skeleton, points)[1]
    shown = np.bincount(vertex, minlength=len(skeleton.vertices)) > 0
    ratios, links = np.zeros(len(skeleton.edges)), linked(skeleton.vertices, skeleton.edges).tolil()
    for row in np.flatnonzero(edges_on_cycles(len(skeleton.vertices), skeleton.edges)).tolist():
        i, j = skeleton.edges[row].tolist()
        length, links[i, j], links[j, i] = links[i, j], 0, 0
        along, before = dijkstra(links.tocsr(), indices=i, return_predecessors=True)
        links[i, j] = links[j, i] = length
        loop = [j]
        while loop[-1] != i:
            loop.append(int(before[loop[-1]]))
        path = np.array(loop[::-1])[shown[loop[::-1]]]  # from i, away from the edge, around to j
        after, ahead = along[path], along[j] - along[path]
        for window in np.array(TOUCH_WINDOWS) * np.nanmax(skeleton.radii[[i, j]]):
            if len(path) < 2 or not 0 < 4 * window < along[j]:
                continue
            a, b = path[np.argmax(after >= window)], path[::-1][np.argmax(ahead[::-1] >= window)]
            curve = along[a] + along[j] - along[b] + length
            far = surface.distances(vertex == a, LONGEST_RATIO * curve)[vertex == b].min()
            ratios[row] += min(far / curve, LONGEST_RATIO) / len(TOUCH_WINDOWS)
    return ratios
