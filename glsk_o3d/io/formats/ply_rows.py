"""Rows of points as binary PLY files hold them, and the header before them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

_WORDS = {"u1": "uchar", "i4": "int", "f4": "float", "f8": "double"}  # those that Open3D reads


def is_written(kind: np.dtype) -> bool:
    """Whether there is a word for a type: of PLY's others Open3D leaves the whole column out."""
    return kind.str[1:] in _WORDS


def table(columns: Mapping[str, np.ndarray]) -> np.ndarray:
    """Columns of equal length, (n,) arrays by name, side by side: a structured array of little-endian rows."""
    n = len(next(iter(columns.values())))
    rows = np.empty(n, [(name, values.dtype.newbyteorder("<")) for name, values in columns.items()])
    for name, values in columns.items():
        rows[name] = values
    return rows


def header(row: np.dtype, n: int, *, width: int = 0, more: str = "") -> bytes:
    """What stands before n such rows; the count can be padded to a width, so that another one fits in its place, and
    `more` are lines of elements that follow.
    """
    properties = "".join(f"property {_WORDS[row[name].str[1:]]} {name}\n" for name in row.names or ())
    vertices = f"element vertex {n:{width}d}\n"
    return f"ply\nformat binary_little_endian 1.0\n{vertices}{properties}{more}end_header\n".encode()
