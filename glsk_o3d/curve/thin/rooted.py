"""The place a tree grows from, and its vertices in the order in which they grow."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.sparse.csgraph import breadth_first_order

from ..curve import Curve
from ...errors import InvalidParameterError
from ...geometry.near_links import linked
from ...geometry.vectors import AXES, along_axis, norm
from ...parameters import resolve_point, shown
from ..topology.collapse import some_vertices

RootPlace = str | int | Sequence[float] | np.ndarray


def root_among(places: np.ndarray, curve: Curve, which: RootPlace, thick: np.ndarray | None = None) -> int:
    """Which of some places (n, 3) a tree grows from.

    That is the lowest along an axis, ``"x"`` to ``"-z"``, a point (also as ``"x,y,z"``), the number of a place, or the
    ``"thickest"`` of the ends `thick` (k,) of the curve; of all, if there are none. InvalidParameterError if there
    is no such root, or it is the thickest, and radii are not known.
    """
    if isinstance(which, int | np.integer) and not isinstance(which, bool):
        if not 0 <= which < len(places):
            raise InvalidParameterError(f"root = {shown(which)}: there are vertices 0 to {len(places) - 1}")
        return int(which)
    if isinstance(which, str) and which in AXES:
        return int(along_axis(places, which).argmin())
    if isinstance(which, str) and which == "thickest":
        choices = (thick if thick is not None else (), curve.leaves, np.arange(len(curve.vertices)))
        ends = next(each for each in choices if len(each))
        if np.isnan(curve.radii[ends]).any():
            raise InvalidParameterError("root = 'thickest': the curve has no radii, as of a format without them")
        place = curve.vertices[ends[curve.radii[ends].argmax()]]
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


def numbered_from(curve: Curve, root: int) -> Curve:
    """The same forest with its vertices numbered from the root outwards: edges lead away from it.

    Other components follow, each from its vertex nearest to the root.
    """
    links, part = linked(curve.vertices, curve.edges), curve.component_of_vertex
    nearest = np.argsort(norm(curve.vertices - curve.vertices[root]), kind="stable")
    starts = nearest[np.sort(np.unique(part[nearest], return_index=True)[1])].tolist()
    starts[0] = root  # of several vertices in one place
    order = np.concatenate([breadth_first_order(links, at, False, return_predecessors=False) for at in starts])
    index, vertex = np.argsort(order), curve.vertex_of_point
    return replace(
        curve,
        **some_vertices(curve, order),
        edges=index[curve.edges],
        vertex_of_point=np.append(index, -1)[vertex],
    )
