"""OBJ: keeps vertices and edges to the last bit, edges as ``l`` lines; loses the radii and all else.

MeshLab, Blender and CloudCompare open it. Scans are OBJ files, too: a skeleton is one that has lines.
"""

from __future__ import annotations

from itertools import pairwise
from typing import BinaryIO

from ...skeleton import Skeleton
from .graphs import NoEdges, graph_skeleton, line, text, words_by_line

_MARK = b"# curve skeleton written by glsk-o3d"


def holds_lines(stream: BinaryIO) -> bool:
    """Whether an OBJ file is a drawing of lines and no scan: it is one of ours, or has lines and no faces."""
    if stream.readline().startswith(_MARK):
        return True
    keywords = {line.split(maxsplit=1)[0] for line in stream if line.strip()}
    return b"l" in keywords and b"f" not in keywords


def write(skeleton: Skeleton) -> bytes:
    """The content of an OBJ file."""
    points = [line("v", *vertex) for vertex in skeleton.vertices.tolist()]
    lines = [line("l", *edge) for edge in (skeleton.edges + 1).tolist()]
    return text([_MARK.decode(), *points, *lines])


def read(data: bytes) -> Skeleton:
    """The skeleton in the content of an OBJ file."""
    vertices: list[list[float]] = []
    edges: list[tuple[int, int]] = []
    for keyword, *words in words_by_line(data):
        if keyword == "v":
            vertices.append([float(word) for word in words[:3]])
        elif keyword == "l":
            ends = [int(word.partition("/")[0]) for word in words]
            if 0 in ends:
                raise ValueError("OBJ counts vertices from 1 and a line names vertex 0")
            ends = [end - 1 if end > 0 else end + len(vertices) for end in ends]
            edges += pairwise(ends)
    if not vertices:
        raise ValueError("it has no 'v' line")
    if not (edges or data.startswith(_MARK)):
        raise NoEdges
    return graph_skeleton(vertices, edges)
