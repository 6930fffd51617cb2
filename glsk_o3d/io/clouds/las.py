"""LAS and LAZ, the files of laser scanners: coordinates at full digits, and all that is known of each return (extra
``las``: laspy, lazrs).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...interop.packages import require, require_for
from .scanned import COLOR_CHANNELS, Scan, named_attributes, unit_colors

VLR_BYTES, EVLR_BYTES = 54, 60  # published: LAS 1.4 R15, of the heads of records
MOST_PACKED = 10_000  # fitted: points of a LAZ file per byte; repeated ones pack well, but not so well


def read(path: Path) -> Scan:
    """The points of a LAS or LAZ file; dimensions that are 0 throughout are unset."""
    require_for(path.suffix)
    _check_header(path)
    laspy = require("laspy")
    file = laspy.read(path)
    if len(file.points) < file.header.point_count:
        raise ValueError(f"it promises {file.header.point_count} points and holds {len(file.points)}: it breaks off")
    names = [name for name in file.point_format.dimension_names if name not in ("X", "Y", "Z")]
    colors = np.column_stack([file[name] for name in COLOR_CHANNELS]) if set(COLOR_CHANNELS) <= set(names) else None
    held = ((name, np.asarray(file[name])) for name in names if name not in COLOR_CHANNELS)
    attributes = named_attributes((name, values) for name, values in held if values.ndim == 1)
    unset = frozenset(name for name, values in attributes.items() if not values.any())
    if colors is not None:
        colors = unit_colors(colors) if colors.any() else None
    return Scan(np.ascontiguousarray(file.xyz, float), colors, None, attributes, unset=unset)


def _check_header(path: Path) -> None:
    """Raise ValueError where the header promises more records than the file has bytes: laspy would look for each."""
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
