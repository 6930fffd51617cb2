"""DXF, release 12: keeps the branches as 3D polylines, to the last bit; loses the radii and all else.

CAD programs, CloudCompare and GIS open it. A loop without a junction is a closed polyline, a vertex without edges a
point.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...skeleton import Skeleton
from .text import text

LAYER = "skeleton"
_CLOSED, _IN_SPACE, _VERTEX_IN_SPACE = 1, 8, 32  # published: DXF reference, group 70 of POLYLINE and of VERTEX


def write(skeleton: Skeleton) -> bytes:
    """The content of a DXF file."""
    groups: list[tuple[int, object]] = [(0, "SECTION"), (2, "HEADER"), (9, "$ACADVER"), (1, "AC1009"), (0, "ENDSEC")]
    groups += [(0, "SECTION"), (2, "ENTITIES")]
    for path in skeleton.branches:
        groups += _polyline(skeleton.vertices[path])
    for vertex in skeleton.vertices[skeleton.degree == 0].tolist():
        groups += [(0, "POINT"), (8, LAYER), *_place(vertex)]
    groups += [(0, "ENDSEC"), (0, "EOF")]
    return text(f"{code}\n{value}" for code, value in groups)


def _polyline(curve: np.ndarray) -> Iterator[tuple[int, object]]:
    closed = len(curve) > 2 and bool((curve[0] == curve[-1]).all())
    yield from ((0, "POLYLINE"), (8, LAYER), (66, 1), *_place([0.0, 0.0, 0.0]), (70, _IN_SPACE + _CLOSED * closed))
    for vertex in (curve[:-1] if closed else curve).tolist():
        yield from ((0, "VERTEX"), (8, LAYER), *_place(vertex), (70, _VERTEX_IN_SPACE))
    yield from ((0, "SEQEND"), (8, LAYER))


def _place(vertex: list[float]) -> Iterator[tuple[int, object]]:
    return zip((10, 20, 30), vertex, strict=True)
