"""The place a tree grows from, and its vertices in the order in which they grow."""

from collections.abc import Sequence

import numpy as np
from scipy.sparse.csgraph import breadth_first_order

from ..data.graph import AnyGraph, Graph, all_of_vertices, in_order_of_ends
from ..errors import InvalidParameterError
from ..geometry.near_links import linked
from ..geometry.vectors import AXES, along_axis, norm
from ..parameters import resolve_point, shown

RootPlace = str | int | Sequence[float] | np.ndarray


def root_among(places: np.ndarray, graph: Graph, which: RootPlace, thick: np.ndarray | None = None) -> int:
    """Which of some places (n, 3) a tree grows from.

    That is the lowest along an axis, ``"x"`` to ``"-z"``, a point (also as ``"x,y,z"``), the number of a place, or the
    ``"thickest"`` of the ends `thick` (k,) of the graph; of all, if there are none. InvalidParameterError if there
    is no such root, or it is the thickest, and radii are not known.
    """
    if isinstance(which, int | np.integer) and not isinstance(which, bool):
        if not 0 <= which < len(places):
            raise InvalidParameterError(f"root = {shown(which)}: there are vertices 0 to {len(places) - 1}")
        return int(which)
    if isinstance(which, str) and which in AXES:
        return int(along_axis(places, which).argmin())
    if isinstance(which, str) and which == "thickest":
        choices = (thick if thick is not None else (), graph.leaves, np.arange(len(graph.vertices)))
        ends = next(candidates for candidates in choices if len(candidates))
        if np.isnan(graph.radii[ends]).any():
            raise InvalidParameterError("root = 'thickest': the skeleton has no radii, as of a format without them")
        place = graph.vertices[ends[graph.radii[ends].argmax()]]
    else:
        try:
            place = np.asarray(resolve_point(which) if isinstance(which, str) else which, float)
        except (InvalidParameterError, TypeError, ValueError, OverflowError):
            place = np.empty(0)
        if place.shape != (3,) or not np.isfinite(place).all():
            raise InvalidParameterError(
                f"root = {shown(which)}: must be an axis, x to -z, 'thickest', a vertex, or a point (x, y, z)"
            )
    return int(norm(places - place).argmin())


def numbered_from(graph: AnyGraph, root: int) -> AnyGraph:
    """The same forest with its vertices numbered from the root outwards: edges lead away from it.

    Other components follow, each from its vertex nearest to the root.
    """
    links, part = linked(graph.vertices, graph.edges), graph.component_of_vertex
    nearest = np.argsort(norm(graph.vertices - graph.vertices[root]), kind="stable")
    starts = nearest[np.sort(np.unique(part[nearest], return_index=True)[1])].tolist()
    starts[0] = root  # of several vertices in one place
    order = np.concatenate([breadth_first_order(links, start, False, return_predecessors=False) for start in starts])
    index, vertex = np.argsort(order), graph.vertex_of_point
    return graph.changed(
        **all_of_vertices(graph, order),
        edges=in_order_of_ends(index[graph.edges], len(order)),
        vertex_of_point=np.append(index, -1)[vertex],
    )
