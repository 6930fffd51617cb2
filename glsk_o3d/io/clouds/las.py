"""LAS and LAZ, the files of laser scanners: coordinates at full digits, and all that is known of each return (extra
``las``: laspy, lazrs).
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ...interop.packages import require, require_for
from .scanned import ALL_ROWS, COLOR_CHANNELS, Scan, brightest, named_attributes, only, unit_colors

VLR_BYTES, EVLR_BYTES = 54, 60  # published: LAS 1.4 R15, of the heads of records
MOST_PACKED = 10_000  # fitted: points of a LAZ file per byte; repeated ones pack well, but not so well


def read(path: Path) -> Scan:
    """The points of a LAS or LAZ file; dimensions that are 0 throughout are unset."""
    return only(blocks(path, ALL_ROWS))


def blocks(path: Path, rows: int, bare: bool = False) -> Iterator[Scan]:
    """The same, so many points at a time; unset is what is 0 in a block. `bare` ones are positions alone."""
    require_for(path.suffix)
    _check_header(path)
    return _blocks(path, rows, bare)


def promised(path: Path) -> int:
    """The points that the header promises."""
    return _check_header(path)


def _blocks(path: Path, rows: int, bare: bool) -> Iterator[Scan]:
    laspy = require("laspy")
    chosen = laspy.DecompressionSelection
    with laspy.open(path, decompression_selection=chosen.base().decompress_z() if bare else chosen.all()) as file:
        n = file.header.point_count
        top = _brightest(laspy, path, rows) if rows < n and not bare else None
        for begin in range(0, n, rows):
            points = file.read_points(rows)
            if len(points) < min(rows, n - begin):
                raise _broken_off(n, begin + len(points))
            yield Scan(_places(points)) if bare else _scan(points, top)


def _scan(points: Any, top: float | None) -> Scan:
    """Some of the points; `top` is the largest number among the colours of all, None if these are all."""
    names = [name for name in points.point_format.dimension_names if name not in ("X", "Y", "Z")]
    colors = np.column_stack([points[name] for name in COLOR_CHANNELS]) if set(COLOR_CHANNELS) <= set(names) else None
    held = ((name, np.asarray(points[name])) for name in names if name not in COLOR_CHANNELS)
    attributes = named_attributes((name, values) for name, values in held if values.ndim == 1)
    unset = frozenset(name for name, values in attributes.items() if not values.any())
    if colors is not None:
        top = brightest(colors) if top is None else top
        colors = unit_colors(colors, top) if top else None
    return Scan(_places(points), colors, None, attributes, unset=unset)


def _places(points: Any) -> np.ndarray:
    return np.ascontiguousarray(np.column_stack([points.x, points.y, points.z]), float)


def _brightest(laspy: Any, path: Path, rows: int) -> float:
    """The largest number among all colours, or the first that is not of eight bits; 0 if there are none."""
    top = 0.0
    with laspy.open(path, decompression_selection=laspy.DecompressionSelection.base().decompress_rgb()) as file:
        if {*COLOR_CHANNELS} <= {*file.header.point_format.dimension_names}:
            for points in file.chunk_iterator(rows):
                top = max(top, *(brightest(np.asarray(points[name])) for name in COLOR_CHANNELS))
                if top > 255:
                    break
    return top


def _check_header(path: Path) -> int:
    """The points of a file.

    ValueError where the header promises more records than the file has bytes: laspy would look for each.
    """
    with path.open("rb") as stream:
        head, size = stream.read(375), path.stat().st_size
    if len(head) < 227 or head[:4] != b"LASF":
        raise ValueError("it does not start with the header of a LAS file")

    def number(at: int, length: int) -> int:
        return int.from_bytes(head[at : at + length], "little")

    is_14 = (head[24], head[25]) >= (1, 4) and len(head) >= 255
    points = number(247, 8) if is_14 else number(107, 4)
    least = 1 if path.suffix.lower() == ".las" else MOST_PACKED
    records = [(number(100, 4), VLR_BYTES), (number(243, 4) * is_14, EVLR_BYTES), (points / least, 1)]
    if any(count * length > size for count, length in records) or number(96, 4) > size:
        raise ValueError(f"its header promises more than its {size} bytes can hold")
    start, length = number(96, 4), number(105, 2)
    if path.suffix.lower() == ".las" and size - start < points * length:
        raise _broken_off(points, (size - start) // length)
    return points


def _broken_off(points: int, found: int) -> ValueError:
    return ValueError(f"it promises {points} points and holds {found}: it breaks off")
