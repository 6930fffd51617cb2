"""OBJ, VTP, DXF and GraphML: vertices and edges, or branches, to the last bit; no cloud, no report.

OBJ has edges as ``l`` lines, and no radii; scans are OBJ files, too, and a skeleton is one that has lines. VTP, VTK's
polydata, has the radii and confidences too, and the cell array ``branch`` counts the polylines. DXF, as release 12 has
it, has the polylines alone. In both a vertex without edges is a point. GraphML has all that is known of vertices.
"""

import base64
from collections.abc import Iterable
from io import BytesIO
from itertools import chain, pairwise
from pathlib import Path
from typing import BinaryIO
from xml.etree import ElementTree as xml

import numpy as np

from ...data.skeleton import Skeleton
from ...interop.packages import require
from ..scan import Scan
from .graphs import NoEdges, graph_skeleton, line, text, words_by_line
from .ply import Lists, triangles

_OBJ_MARK = b"# curve skeleton written by glsk-o3d"
_VTK_TYPES = {"f": "Float64", "i": "Int64"}


def holds_lines(stream: BinaryIO) -> bool:
    """Whether an OBJ file is a drawing of lines and no scan: it is one of ours, or has lines and no faces."""
    if stream.readline().startswith(_OBJ_MARK):
        return True
    keywords = {line.split(maxsplit=1)[0] for line in stream if line.strip()}
    return b"l" in keywords and b"f" not in keywords


def write_obj(skeleton: Skeleton) -> bytes:
    """The content of an OBJ file."""
    points = [line("v", *vertex) for vertex in skeleton.vertices.tolist()]
    lines = [line("l", *edge) for edge in (skeleton.edges + 1).tolist()]
    return text([_OBJ_MARK.decode(), *points, *lines])


def read_obj(data: bytes) -> Skeleton:
    """The skeleton in the content of an OBJ file."""
    vertices, paths, _ = joined_vertices(data, "l")
    if not (paths or data.startswith(_OBJ_MARK)):
        raise NoEdges
    return graph_skeleton([vertex[:3] for vertex in vertices], list(chain.from_iterable(map(pairwise, paths))))


def read_mesh(path: Path) -> Scan:
    """The vertices of an OBJ file with their colours and normals, and its faces as triangles."""
    vertices, faces, normals = joined_vertices(path.read_bytes(), "f")
    corners = Lists(np.array(list(map(len, faces))), np.array(list(chain.from_iterable(faces))))
    colored = min(map(len, vertices)) == 6
    table = np.array([vertex if colored else vertex[:3] for vertex in vertices])
    looks = table[:, 3:] if colored else None, np.array(normals) if len(normals) == len(table) else None
    return Scan(table[:, :3], *looks, {}, triangles({"vertex_indices": corners}, len(table)))


def joined_vertices(data: bytes, joined: str) -> tuple[list[list[float]], list[list[int]], list[list[float]]]:
    """The vertices of an OBJ file, with colours if they have some; those that each ``l`` or ``f`` line joins; and the
    normals, unless a corner has another one than that of its vertex's number.
    """
    vertices: list[list[float]] = []
    normals: list[list[float]] = []
    paths: list[list[int]] = []
    own = True
    for keyword, *words in words_by_line(data.replace(b"\r\n", b"\n").replace(b"\\\n", b" ")):
        if keyword in ("v", "vn"):
            (vertices if keyword == "v" else normals).append([float(word) for word in words[:6]])
        elif keyword == joined:
            corners = [word.split("/") for word in words]
            ends = [int(corner[0]) for corner in corners]
            if 0 in ends:
                raise ValueError("OBJ counts vertices from 1 and a line or face names vertex 0")
            own &= all(corner[2:] in ([], corner[:1]) for corner in corners)
            paths.append([end - 1 if end > 0 else end + len(vertices) for end in ends])
    if not vertices:
        raise ValueError("it has no 'v' line")
    return vertices, paths, normals if own else []


def write_vtp(skeleton: Skeleton) -> bytes:
    """The content of a VTP file."""
    paths, alone = skeleton.branches, np.flatnonzero(skeleton.degree == 0)
    root = xml.Element("VTKFile", type="PolyData", version="1.0", byte_order="LittleEndian", header_type="UInt64")
    counts = {"NumberOfPoints": len(skeleton.vertices), "NumberOfVerts": len(alone), "NumberOfLines": len(paths)}
    piece = xml.SubElement(xml.SubElement(root, "PolyData"), "Piece", {key: str(n) for key, n in counts.items()})
    data = xml.SubElement(piece, "PointData", Scalars="radius")
    _vtk_array(data, "radius", skeleton.radii)
    _vtk_array(data, "confidence", skeleton.confidence)
    branch = np.r_[np.full(len(alone), -1), np.arange(len(paths))].astype(np.int64)
    _vtk_array(xml.SubElement(piece, "CellData"), "branch", branch)
    _vtk_array(xml.SubElement(piece, "Points"), "Points", skeleton.vertices)
    _vtk_cells(piece, "Verts", alone[:, None])
    _vtk_cells(piece, "Lines", paths)
    written: bytes = xml.tostring(root, encoding="utf-8", xml_declaration=True)
    return written


def write_dxf(skeleton: Skeleton) -> bytes:
    """The content of a DXF file: its section of entities, which is all that release 12 needs, as pairs of lines."""
    layer = (8, "0")  # which all drawings have
    tags: list[tuple[int, object]] = [(0, "SECTION"), (2, "ENTITIES")]
    for path in skeleton.branches:
        tags += [(0, "POLYLINE"), layer, (66, 1), (70, 8)]  # vertices follow; it is in space
        for vertex in skeleton.vertices[path].tolist():
            tags += [(0, "VERTEX"), layer, (70, 32), *zip((10, 20, 30), vertex, strict=True)]
        tags += [(0, "SEQEND"), layer]
    for vertex in skeleton.vertices[skeleton.degree == 0].tolist():
        tags += [(0, "POINT"), layer, *zip((10, 20, 30), vertex, strict=True)]
    return text(f"{code}\n{value}" for code, value in [*tags, (0, "ENDSEC"), (0, "EOF")])


def write_graphml(skeleton: Skeleton) -> bytes:
    """The content of a GraphML file, whose nodes have coordinates ``x``, ``y`` and ``z``, as it holds no tuples."""
    graph, stream = skeleton.to_networkx(), BytesIO()
    for _, facts in graph.nodes(data=True):
        facts |= dict(zip("xyz", facts.pop("position"), strict=True))
    require("networkx").write_graphml_xml(graph, stream)
    return stream.getvalue()


def _vtk_cells(piece: xml.Element, name: str, paths: Iterable[np.ndarray]) -> None:
    cells, paths = xml.SubElement(piece, name), list(paths)
    _vtk_array(cells, "connectivity", np.concatenate([*paths, np.empty(0, np.int64)]).astype(np.int64))
    _vtk_array(cells, "offsets", np.cumsum([len(path) for path in paths], dtype=np.int64))


def _vtk_array(parent: xml.Element, name: str, values: np.ndarray) -> None:
    """An array as base64 of its length in bytes and itself."""
    data = np.ascontiguousarray(values).tobytes()
    facts = {"type": _VTK_TYPES[values.dtype.kind], "Name": name, "format": "binary"}
    columns = {"NumberOfComponents": str(values.shape[1])} if values.ndim == 2 else {}
    element = xml.SubElement(parent, "DataArray", {**facts, **columns})
    element.text = base64.b64encode(len(data).to_bytes(8, "little") + data).decode()
