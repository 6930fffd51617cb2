"""Tree files of raycloudtools and treetools (CSIRO): keep cylinders with parents and orders, a line per tree.

After comments and a line of names comes one line per tree. It has the root, whose parent is -1, and a segment per
cylinder, its tip and radius; the cylinder reaches from the tip of the parent, counted from 0 in its line, to its own.
"""

from __future__ import annotations

from ...analysis.tree_cylinders import Cylinders
from .text import text

SEGMENT_NAMES = ("x", "y", "z", "radius", "parent_id", "curve_length", "order")
"""Of the numbers of a segment. treetools itself adds ``length``, ``volume``, ``diameter``, ``branch`` and more, and
refuses files that have them.
"""


def write(*trees: Cylinders) -> bytes:
    """The content of a tree file.

    Parameters
    ----------
    *trees : Cylinders
        In metres, as treetools takes lengths.

    Returns
    -------
    bytes

    Examples
    --------
    >>> from glsk_o3d import Skeleton
    >>> from glsk_o3d.analysis import cylinders
    >>> stem = Skeleton([[0, 0, 0], [0, 0, 0.5]], [[0, 1]], [0.125, 0.125], (), (), ())
    >>> print(write(cylinders(stem)).decode().splitlines()[-1])
    0.0,0.0,0.0,0.125,-1,0.0,0, 0.0,0.0,0.5,0.125,0,0.5,0
    """
    return text(["# trees written by glsk-o3d, in metres", ",".join(SEGMENT_NAMES), *map(_line, trees)])


def _line(tree: Cylinders) -> str:
    root = (*tree.start_point[0].tolist(), float(tree.radius[0]), -1, 0.0, 0)
    columns = (*tree.end_point.T, tree.radius, tree.parent + 1, tree.length, tree.order)
    segments = zip(*(column.tolist() for column in columns), strict=True)
    return ", ".join(",".join(map(str, segment)) for segment in (root, *segments))
