"""LAS and LAZ, the files of laser scanners: coordinates at full digits, and all that is known of each return (extra
``las``: laspy, lazrs).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...interop.packages import require, require_for
from .scanned import COLOR_CHANNELS, Scan, attribute_name, unit_colors


def read(path: Path) -> Scan:
    """The points of a LAS or LAZ file; dimensions that are 0 throughout are unset."""
    require_for(path.suffix)
    laspy = require("laspy")
    file = laspy.read(path)
    if len(file.points) < file.header.point_count:
        raise ValueError(f"it promises {file.header.point_count} points and holds {len(file.points)}: it breaks off")
    names = [name for name in file.point_format.dimension_names if name not in ("X", "Y", "Z")]
    colors = np.column_stack([file[name] for name in COLOR_CHANNELS]) if set(COLOR_CHANNELS) <= set(names) else None
    attributes: dict[str, np.ndarray] = {}
    for name in names:
        values = np.asarray(file[name])
        if name not in COLOR_CHANNELS and values.ndim == 1:
            attributes[attribute_name(name, attributes)] = values
    unset = frozenset(name for name, values in attributes.items() if not values.any())
    if colors is not None:
        colors = unit_colors(colors) if colors.any() else None
    return Scan(np.ascontiguousarray(file.xyz, float), colors, None, attributes, unset=unset)
