"""CGAL's polylines, DXF and VTP: keep the branches as polylines, to the last bit; lose the cloud and the report.

CGAL's text has a line per branch, the number of its points and then x y z of each; on reading, polylines are joined
where their ends have equal coordinates. DXF, release 12, has a 3D polyline per branch, closed for a loop without a
junction. VTP, VTK's polydata, has the radii and confidences too, and the cell array ``branch`` counts the polylines.
A vertex without edges is a polyline of one point, or a point.
"""

from __future__ import annotations

import base64
from collections.abc import Iterable, Iterator
from xml.etree import ElementTree as xml

import numpy as np

from ...skeleton import Skeleton
from .graphs import graph_skeleton, line, text, words_by_line

DXF_LAYER = "skeleton"
_CLOSED, _IN_SPACE, _VERTEX_IN_SPACE = 1, 8, 32  # published: DXF reference, group 70 of POLYLINE and of VERTEX
_VTK_TYPES = {"f": "Float64", "i": "Int64"}


def write_cgal(skeleton: Skeleton) -> bytes:
    """The content of a file of CGAL's polylines."""
    paths = [*skeleton.branches, *np.flatnonzero(skeleton.degree == 0)[:, None]]
    return text(line(len(path), *skeleton.vertices[path].ravel().tolist()) for path in paths)


def read_cgal(data: bytes) -> Skeleton:
    """The skeleton in the content of a file of CGAL's polylines."""
    lines = [[float(word) for word in words] for words in words_by_line(data)]
    if not lines or any(len(numbers) != 1 + 3 * numbers[0] or numbers[0] < 1 for numbers in lines):
        raise ValueError("a line must hold the number of its points and then x y z of each")
    points = np.concatenate([numbers[1:] for numbers in lines]).reshape(-1, 3)
    stop = np.cumsum([int(numbers[0]) for numbers in lines])
    start = np.r_[0, stop[:-1]]
    inner = np.setdiff1d(np.arange(len(points)), stop - 1)  # those with a next point on their line
    ends = np.concatenate([start, stop - 1])[np.tile(stop - start > 1, 2)]
    _, first, which = np.unique(points[ends], axis=0, return_index=True, return_inverse=True)
    label = np.arange(len(points))
    label[ends] = ends[first][which.ravel()]
    kept, index = np.unique(label, return_inverse=True)
    return graph_skeleton(points[kept], index[np.column_stack([inner, inner + 1])])


def write_dxf(skeleton: Skeleton) -> bytes:
    """The content of a DXF file."""
    groups: list[tuple[int, object]] = [(0, "SECTION"), (2, "HEADER"), (9, "$ACADVER"), (1, "AC1009"), (0, "ENDSEC")]
    groups += [(0, "SECTION"), (2, "ENTITIES")]
    for path in skeleton.branches:
        groups += _dxf_polyline(skeleton.vertices[path])
    for vertex in skeleton.vertices[skeleton.degree == 0].tolist():
        groups += [(0, "POINT"), (8, DXF_LAYER), *_dxf_place(vertex)]
    groups += [(0, "ENDSEC"), (0, "EOF")]
    return text(f"{code}\n{value}" for code, value in groups)


def _dxf_polyline(curve: np.ndarray) -> Iterator[tuple[int, object]]:
    closed = len(curve) > 2 and bool((curve[0] == curve[-1]).all())
    yield from ((0, "POLYLINE"), (8, DXF_LAYER), (66, 1), *_dxf_place([0.0, 0.0, 0.0]))
    yield 70, _IN_SPACE + _CLOSED * closed
    for vertex in (curve[:-1] if closed else curve).tolist():
        yield from ((0, "VERTEX"), (8, DXF_LAYER), *_dxf_place(vertex), (70, _VERTEX_IN_SPACE))
    yield from ((0, "SEQEND"), (8, DXF_LAYER))


def _dxf_place(vertex: list[float]) -> Iterator[tuple[int, object]]:
    return zip((10, 20, 30), vertex, strict=True)


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
    return xml.tostring(root, encoding="utf-8", xml_declaration=True)


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
