"""VTP, VTK's polydata: keeps vertices, branches as polylines, radii and confidences to the last bit.

ParaView, Slicer and vmtk open it; ParaView's Tube filter can vary with the point array ``radius``, and the cell array
``branch`` counts the polylines.
"""

from __future__ import annotations

import base64
from collections.abc import Iterable
from xml.etree import ElementTree as xml

import numpy as np

from ...skeleton import Skeleton

_TYPES = {"f": "Float64", "i": "Int64"}


def write(skeleton: Skeleton) -> bytes:
    """The content of a VTP file."""
    paths, alone = skeleton.branches, np.flatnonzero(skeleton.degree == 0)
    root = xml.Element("VTKFile", type="PolyData", version="1.0", byte_order="LittleEndian", header_type="UInt64")
    counts = {"NumberOfPoints": len(skeleton.vertices), "NumberOfVerts": len(alone), "NumberOfLines": len(paths)}
    piece = xml.SubElement(xml.SubElement(root, "PolyData"), "Piece", {key: str(n) for key, n in counts.items()})
    data = xml.SubElement(piece, "PointData", Scalars="radius")
    _array(data, "radius", skeleton.radii)
    _array(data, "confidence", skeleton.confidence)
    _array(
        xml.SubElement(piece, "CellData"),
        "branch",
        np.r_[np.full(len(alone), -1), np.arange(len(paths))].astype(np.int64),
    )
    _array(xml.SubElement(piece, "Points"), "Points", skeleton.vertices)
    _cells(piece, "Verts", alone[:, None])
    _cells(piece, "Lines", paths)
    return xml.tostring(root, encoding="utf-8", xml_declaration=True)


def _cells(piece: xml.Element, name: str, paths: Iterable[np.ndarray]) -> None:
    cells, paths = xml.SubElement(piece, name), list(paths)
    _array(cells, "connectivity", np.concatenate([*paths, np.empty(0, np.int64)]).astype(np.int64))
    _array(cells, "offsets", np.cumsum([len(path) for path in paths], dtype=np.int64))


def _array(parent: xml.Element, name: str, values: np.ndarray) -> None:
    """An array as base64 of its length in bytes and itself."""
    data = np.ascontiguousarray(values).tobytes()
    facts = {"type": _TYPES[values.dtype.kind], "Name": name, "format": "binary"}
    columns = {"NumberOfComponents": str(values.shape[1])} if values.ndim == 2 else {}
    element = xml.SubElement(parent, "DataArray", {**facts, **columns})
    element.text = base64.b64encode(len(data).to_bytes(8, "little") + data).decode()
