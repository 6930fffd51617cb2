"""The node lists of TomatoWUR as CSV: keep places, radii, parents and axes of one plant; lose all else.

TomatoWUR (van Marrewijk et al. 2025, https://github.com/WUR-ABE/TomatoWUR) has ``x, y, z`` in the results of skeleton
methods, and ``x_skeleton, y_skeleton, z_skeleton`` in its annotations; here are both, so that all its readers take it.
"""

from __future__ import annotations

import numpy as np

from ...errors import FileFormatError
from ...skeleton import Skeleton
from .plant_axes import plant_axes
from .text import text

NODE_COLUMNS = ("x", "y", "z", "x_skeleton", "y_skeleton", "z_skeleton", "vid", "parentid", "edgetype", "radius")
"""The names in the first line."""


def write(skeleton: Skeleton) -> bytes:
    """The content of a CSV file with a line per vertex.

    Parameters
    ----------
    skeleton : Skeleton
        Connected, without loops, numbered from its root outwards as by `editing.reroot`.

    Returns
    -------
    bytes
        `edgetype` is ``<`` where the edge from the parent goes on along an axis and ``+`` where it branches off. The
        root has neither parent nor type.

    Raises
    ------
    FileFormatError
        There is more than one component.

    Examples
    --------
    >>> stem = Skeleton([[0, 0, 0], [0, 0, 1]], [[0, 1]], [0.2, 0.1], (), (), ())
    >>> print(write(stem).decode(), end="")
    x,y,z,x_skeleton,y_skeleton,z_skeleton,vid,parentid,edgetype,radius
    0.0,0.0,0.0,0.0,0.0,0.0,0,,,0.2
    0.0,0.0,1.0,0.0,0.0,1.0,1,0,<,0.1
    """
    if skeleton.n_components > 1:
        raise FileFormatError(
            f"a node list of TomatoWUR holds one plant and the skeleton has {skeleton.n_components} components: keep "
            "one with editing.largest_component(), or choose another format"
        )
    parent, begins = plant_axes(skeleton)
    rows = [",".join(NODE_COLUMNS)]
    facts = zip(skeleton.vertices.tolist(), parent.tolist(), begins.tolist(), skeleton.radii.tolist(), strict=True)
    for vertex, (place, before, branches_off, radius) in enumerate(facts):
        edge = [before, "+" if branches_off else "<"] if before >= 0 else ["", ""]
        rows.append(",".join(map(str, [*place, *place, vertex, *edge, radius if np.isfinite(radius) else ""])))
    return text(rows)
