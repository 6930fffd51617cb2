"""SWC: keeps vertices, edges and radii of trees, numbered from the root outwards; holds no loops, loses all else.

Tools for neurons and plants open it; many compute in float32. Where that would lose digits, as in coordinates of a map,
a shift of whole units is taken off and noted in the header, ``# global_shift: x y z``; reading adds it again.
"""

from __future__ import annotations

import logging
import re

import numpy as np

from ...judgements import coordinates
from ...skeleton import Skeleton
from .graphs import global_shift, graph_skeleton, line, parents, text, words_by_line

_log = logging.getLogger(__name__)

_SHIFT = re.compile(r"#\s*global_shift:\s*(\S+)\s+(\S+)\s+(\S+)")


def write(forest: Skeleton) -> bytes:
    """The content of an SWC file of a skeleton that is numbered from its roots outwards."""
    shift = global_shift(forest)
    shift *= ((forest.vertices - shift) + shift == forest.vertices).all()  # what is read must be what was
    header = ["# curve skeleton written by glsk-o3d: id type x y z radius parent"]
    if shift.any():
        _log.warning("written less a global shift of (%s), since float32 would lose digits", coordinates(shift))
        header.append(line("# global_shift:", *shift.tolist()))
    parent = parents(forest)
    number = np.where(parent >= 0, parent + 1, -1).tolist()
    table = np.column_stack([forest.vertices - shift, forest.radii]).tolist()
    rows = [line(i, 0, *row, before) for i, (row, before) in enumerate(zip(table, number, strict=True), 1)]
    return text([*header, *rows])


def read(data: bytes) -> Skeleton:
    """The skeleton in the content of an SWC file."""
    table = np.array([[float(word) for word in words[:7]] for words in words_by_line(data)])
    if table.ndim != 2 or table.shape[1] != 7:
        raise ValueError("it has no rows of 7 numbers (id type x y z radius parent)")
    names, parents = table[:, 0], table[:, 6]
    order = np.argsort(names)
    child = np.flatnonzero(parents >= 0)
    place = np.searchsorted(names[order], parents[child]).clip(max=len(names) - 1)
    if (names[order][place] != parents[child]).any() or len(np.unique(names)) < len(names):
        raise ValueError("a parent is not there, or two rows have one id")
    shift = _SHIFT.search(data.decode("utf-8", "replace"))
    origin = [float(word) for word in shift.groups()] if shift else 0.0
    return graph_skeleton(table[:, 2:5] + origin, np.column_stack([child, order[place]]), table[:, 5])
