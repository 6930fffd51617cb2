"""E57, the exchange format of terrestrial scanners: all scans of a file, each in its place (extra ``e57``: pye57)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...interop.packages import require
from .scanned import NoPoints, Scan, unit_colors

_E57_PLACE = ("cartesianX", "cartesianY", "cartesianZ")
_E57_COLORS = ("colorRed", "colorGreen", "colorBlue")


def read(path: Path) -> Scan:
    """The points of all scans of an E57 file, moved by their poses; ``scan`` says which one each is from."""
    pye57 = require("pye57")
    with pye57.E57(str(path)) as file:
        scans = [
            file.read_scan(i, intensity=True, colors=True, ignore_missing_fields=True) for i in range(file.scan_count)
        ]
    if not scans:
        raise NoPoints("it holds no scan")

    def column(name: str) -> np.ndarray:
        return np.concatenate([scan[name] for scan in scans])

    positions = np.column_stack([column(name) for name in _E57_PLACE]).astype(float)
    colors, attributes = None, {"scan": np.repeat(np.arange(len(scans)), [len(scan[_E57_PLACE[0]]) for scan in scans])}
    if all(name in scan for scan in scans for name in _E57_COLORS):
        colors = unit_colors(np.column_stack([column(name) for name in _E57_COLORS]))
    if any("intensity" in scan for scan in scans):
        unknown = (np.full(len(scan[_E57_PLACE[0]]), np.nan) for scan in scans)
        attributes["intensity"] = np.concatenate(
            [scan.get("intensity", nan) for scan, nan in zip(scans, unknown, strict=True)]
        )
    return Scan(positions, colors, None, attributes)
