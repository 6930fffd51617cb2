"""PLY files of points and meshes: every scalar property of a vertex, and faces as triangles."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..formats.ply_tables import Lists, Table, find_rows, read_tables
from .scanned import ALL_ROWS, COLOR_CHANNELS, NO_TRIANGLES, Scan, brightest, named_attributes, only, unit_colors

_PLY_NORMALS = ["nx", "ny", "nz"]


def read(path: Path) -> Scan:
    """The vertices of a PLY file, and the triangles between them; ValueError where it is damaged or breaks off."""
    found = blocks(path, ALL_ROWS)
    if found is not None:
        return only(found)
    with path.open("rb") as stream:
        tables = read_tables(stream, ("vertex", "face"))
    if "vertex" not in tables:
        raise ValueError("it has no element 'vertex'")
    scan = _scan(tables["vertex"])
    return replace(scan, triangles=_triangles(tables.get("face", {}), len(scan)))


def blocks(path: Path, rows: int, bare: bool = False) -> Iterator[Scan] | None:
    """The same, so many points at a time; None where it has to be read whole: text, lists, and meshes.

    `bare` ones are positions alone.

    ValueError, before the first block, where it is damaged or breaks off.
    """
    found = _found(path)
    return None if found is None else _blocks(path, *found, rows, bare)


def promised(path: Path) -> int | None:
    """The points that the header promises; None where they have to be read whole."""
    found = _found(path)
    return None if found is None else found[2]


def types(path: Path) -> dict[str, np.dtype] | None:
    """Of what type a file has each column that it gives, by name; None where the points have to be read whole."""
    found = _found(path)
    if found is None:
        return None
    row = found[1]
    columns = {name: np.empty(0, row[name].newbyteorder("=")) for name in row.names or ()}
    scan = _scan(dict(columns))
    together = [*"xyz", *(scan.normals is not None) * _PLY_NORMALS, *(scan.colors is not None) * COLOR_CHANNELS]
    return {name: columns[name].dtype for name in together} | {
        name: values.dtype for name, values in scan.attributes.items()
    }


def _found(path: Path) -> tuple[int, np.dtype, int] | None:
    """Where vertices begin, what a row of them is, and how many there are."""
    with path.open("rb") as stream:
        found = find_rows(stream, "vertex", without=("face",))
        return None if found is None else (stream.tell(), *found)


def _blocks(path: Path, start: int, row: np.dtype, n: int, rows: int, bare: bool) -> Iterator[Scan]:
    top = _brightest(path, start, row, n, rows) if rows < n and not bare else None
    for table in _rows(path, start, row, n, rows):
        yield _scan({name: table[name] for name in row.names or () if not bare or name in "xyz"}, top)


def _rows(path: Path, start: int, row: np.dtype, n: int, rows: int) -> Iterator[np.ndarray]:
    """Rows of a table of a file, (m,) structured arrays."""
    with path.open("rb") as stream:
        stream.seek(start)
        for begin in range(0, n, rows):
            yield np.frombuffer(stream.read(min(rows, n - begin) * row.itemsize), row)


def _brightest(path: Path, start: int, row: np.dtype, n: int, rows: int) -> float | None:
    """The largest number among all colours; None where their scale does not depend on it."""
    if not {*COLOR_CHANNELS} <= {*(row.names or ())} or all(row[name] == np.uint8 for name in COLOR_CHANNELS):
        return None
    return max(brightest(table[name]) for table in _rows(path, start, row, n, rows) for name in COLOR_CHANNELS)


def _scan(table: Table, top: float | None = None) -> Scan:
    """Points of a table of vertices; `top` is the largest number among the colours of all, if these are not all."""
    known = {name: values for name, values in table.items() if isinstance(values, np.ndarray)}
    if not set("xyz") <= known.keys():
        raise ValueError("its vertices have no x, y and z")

    def together(names: list[str]) -> np.ndarray | None:
        return np.column_stack([known.pop(name) for name in names]) if set(names) <= known.keys() else None

    positions, colors, normals = (together(names) for names in ([*"xyz"], COLOR_CHANNELS, _PLY_NORMALS))
    assert positions is not None
    native = ((name, values.astype(values.dtype.newbyteorder("="))) for name, values in known.items())
    return Scan(
        np.ascontiguousarray(positions, float),
        None if colors is None else unit_colors(colors, top),
        None if normals is None else np.ascontiguousarray(normals, float),
        named_attributes(native),
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
