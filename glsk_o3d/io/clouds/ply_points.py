"""PLY files of points and meshes: every scalar property of a vertex, and faces as triangles."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..formats.ply_tables import Lists, read_tables
from .scanned import COLOR_CHANNELS, NO_TRIANGLES, Scan, named_attributes, unit_colors

_PLY_NORMALS = ["nx", "ny", "nz"]


def read(path: Path) -> Scan:
    """The vertices of a PLY file, and the triangles between them; ValueError where it is damaged or breaks off."""
    with path.open("rb") as stream:
        tables = read_tables(stream, ("vertex", "face"))
    if "vertex" not in tables:
        raise ValueError("it has no element 'vertex'")
    known = {name: values for name, values in tables["vertex"].items() if isinstance(values, np.ndarray)}
    if not set("xyz") <= known.keys():
        raise ValueError("its vertices have no x, y and z")

    def together(names: list[str]) -> np.ndarray | None:
        return np.column_stack([known.pop(name) for name in names]) if set(names) <= known.keys() else None

    positions, colors, normals = (together(names) for names in ([*"xyz"], COLOR_CHANNELS, _PLY_NORMALS))
    assert positions is not None
    native = ((name, values.astype(values.dtype.newbyteorder("="))) for name, values in known.items())
    return Scan(
        np.ascontiguousarray(positions, float),
        None if colors is None else unit_colors(colors),
        None if normals is None else np.ascontiguousarray(normals, float),
        named_attributes(native),
        _triangles(tables.get("face", {}), len(positions)),
    )


def _triangles(faces: dict[str, np.ndarray | Lists], n: int) -> np.ndarray:
    """Polygons as fans of triangles; those with a corner that is not there are left out."""
    corners = faces.get("vertex_indices", faces.get("vertex_index"))
    if not isinstance(corners, Lists) or len(corners.counts) == 0:
        return NO_TRIANGLES
    first = np.cumsum(corners.counts) - corners.counts
    fans = np.maximum(corners.counts - 2, 0)
    face = np.repeat(np.arange(len(fans)), fans)
    step = np.arange(len(face)) - np.repeat(np.cumsum(fans) - fans, fans)
    at = first[face]
    found = corners.values.astype(np.int64)[np.column_stack([at, at + step + 1, at + step + 2])]
    return found[((found >= 0) & (found < n)).all(axis=1)]
