"""TreePointCloud (Lin, Liu and Zhou 2020): scans of drawn trees in three resolutions, and their axes, y up."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np

from glsk_o3d import read_cloud, read_skeleton
from glsk_o3d.errors import FileFormatError
from glsk_o3d.io.skeletons import holds_skeleton

from .entries import Entry, Source, welded


def sources(folder: Path) -> list[Source]:
    """The trees of which there is an axis or a cloud, ``scan_skel/tree_SIZE_N.obj``, ``scan_ply/..._res_R.ply``."""
    axes = {path.stem for path in folder.glob("scan_skel/tree_*.obj")}
    scanned = {path.stem.rpartition("_res_")[0] for path in folder.glob("scan_ply/tree_*_res_*.ply")}
    return [(name, partial(tree, folder, name)) for name in sorted(axes | scanned)]


def tree(folder: Path, name: str) -> Entry:
    """A tree; every branch of its file begins with the place that it grows from, once more."""
    path = folder / "scan_skel" / f"{name}.obj"
    if path.is_file() and not holds_skeleton(path):
        raise FileFormatError(f"{path}: has no lines, as the first version of these files: take the latest")
    axis = read_skeleton(path)
    scans = sorted(folder.glob(f"scan_ply/{name}_res_*.ply"), key=lambda scan: (len(scan.name), scan.name))
    if not scans:
        raise FileNotFoundError(f"{folder}/scan_ply/{name}_res_*.ply: no such cloud")
    clouds = {f"res{scan.stem.rpartition('_')[2]}": np.asarray(read_cloud(scan).points) for scan in scans}
    return Entry(name.split("_")[1], clouds, welded(axis.vertices, axis.edges))
