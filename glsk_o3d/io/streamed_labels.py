"""Labels for clouds larger than memory, from file to file."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from ..analysis.segmentation import vertex_of_cloud
from ..errors import FileFormatError, InvalidParameterError
from ..interop.atomic import check_ending, write_atomically
from ..numerics.morton import morton_order
from ..numerics.neighbourhoods import nearest_neighbours
from ..refinement.thin_parts import SCALE_NEIGHBOUR
from .annotation import labels
from .clouds.blocks import held_types, read_blocks
from .clouds.scanned import COLOR_CHANNELS, Scan
from .formats import ply_rows

if TYPE_CHECKING:
    from ..skeleton import Skeleton

STREAMED_ENDING = ".ply"
"""Of files that labels are streamed to."""


def annotate_file(
    skeleton: Skeleton, path: str | os.PathLike, output: str | os.PathLike, *, where: str | None = None
) -> int:
    """Write a scan with labels to a file, block by block, in memory that does not grow with it.

    `Skeleton.annotate` for files: the same attributes, coloured by branch. The scan's own colours are attributes
    ``scan_red``, ``scan_green`` and ``scan_blue``. What a binary PLY file holds as float, double, uchar or int stays
    so, and radius, confidence and thickness are float where the coordinates are. All else becomes int, or double.

    Parameters
    ----------
    skeleton : Skeleton
        Such as that of `read_sample`.
    path : path-like
        The scan, as for `read_cloud`.
    output : path-like
        PLY; it appears complete or not at all.
    where : str, optional
        As for `read_cloud`: other points are not written.

    Returns
    -------
    int
        The number of points.

    Raises
    ------
    FileNotFoundError
    FileFormatError
        The scan cannot be read or changes while it is, or the output is no PLY file, or is the scan.
    InvalidParameterError
        The skeleton is empty, or as from `read_cloud`.
    InvalidCloudError
    MissingPackageError
    OSError
        The file cannot be written.

    Notes
    -----
    A point belongs where the nearest point belongs that the skeleton was made from, as in `Skeleton.annotate`.
    ``thickness`` is the one thing that differs: how far the points are apart is that of the cloud that the skeleton was
    made from, at that point; NaN if it came without.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from glsk_o3d import read_tensor_cloud, save_tensor_cloud, skeletonize
    >>> from glsk_o3d.samples import torus
    >>> ring = skeletonize(torus(1000).points)
    >>> with TemporaryDirectory() as folder:
    ...     save_tensor_cloud(skeletonize(torus(3000).points).annotate(), f"{folder}/scan.ply")
    ...     annotate_file(ring, f"{folder}/scan.ply", f"{folder}/marked.ply")
    ...     int(read_tensor_cloud(f"{folder}/marked.ply").point.skeleton_vertex.max().item()) < len(ring.vertices)
    3000
    True
    """
    check_ending(output, "labelled cloud of a large file is PLY", STREAMED_ENDING)
    if Path(output).exists() and Path(path).exists() and os.path.samefile(path, output):
        raise FileFormatError(f"{os.fspath(output)}: is the scan itself: give another name")
    owner = _Owner(skeleton)
    held = {name: kind for name, kind in held_types(path).items() if ply_rows.is_written(kind)}
    n, kinds = _survey(path, where)

    def write(temporary: Path) -> None:
        written, row = 0, None
        with temporary.open("wb") as stream:
            for block in read_blocks(path, where=where):
                if not kinds.keys() <= block.attributes.keys():
                    raise _changed(path)
                table = ply_rows.table(_columns(block, kinds, held, owner.labels(block.positions)))
                if row is None:
                    stream.write(ply_rows.header(table.dtype, n))
                elif row != table.dtype:
                    raise _changed(path)
                written, row = written + len(table), table.dtype
                stream.write(table.tobytes())
        if written != n:
            raise _changed(path)

    write_atomically(output, write)
    return n


class _Owner:
    """Whose each point is: the vertex, and how thick the part is there."""

    def __init__(self, skeleton: Skeleton) -> None:
        if len(skeleton.vertices) == 0:
            raise InvalidParameterError("the skeleton is empty: there is nothing to label points with")
        self._skeleton = skeleton
        self._known = np.flatnonzero(skeleton.vertex_of_point >= 0)
        if len(self._known):
            points = skeleton.points[self._known]
            self._tree = cKDTree(points)
            apart = nearest_neighbours(points, min(SCALE_NEIGHBOUR + 1, len(points)))[0][:, -1]
            with np.errstate(divide="ignore", invalid="ignore"):
                self._thickness = skeleton.radii[skeleton.vertex_of_point[self._known]] / apart

    def labels(self, points: np.ndarray) -> dict[str, np.ndarray]:
        """What is told of points, (m, 3) float array, coloured by branch."""
        vertex, thickness = np.full(len(points), -1), np.full(len(points), np.nan)
        if not len(self._known):
            vertex = vertex_of_cloud(self._skeleton, points)[1]
        elif len(rows := np.flatnonzero(np.isfinite(points).all(axis=1))):
            rows = rows[morton_order(points[rows])]  # what is near in memory is found faster
            nearest = self._tree.query(points[rows])[1]
            vertex[rows] = self._skeleton.vertex_of_point[self._known[nearest]]
            thickness[rows] = self._thickness[nearest]
        return labels(self._skeleton, points, vertex, thickness, "branch")


def _survey(path: str | os.PathLike, where: str | None) -> tuple[int, dict[str, np.dtype]]:
    """How many points there are, and of what type each attribute is that some of them have."""
    n, kinds = 0, dict[str, np.dtype]()
    names: list[str] = []
    for block in read_blocks(path, where=where):
        n, names = n + len(block), list(block.attributes)
        for name, kind in block.kinds.items():
            kinds[name] = np.promote_types(kinds.get(name, kind), kind)
    return n, {name: kinds[name] for name in names if name in kinds}


def _changed(path: str | os.PathLike) -> FileFormatError:
    return FileFormatError(f"{os.fspath(path)}: has changed while it was read: label it again when it is complete")


def _columns(
    block: Scan, kinds: dict[str, np.dtype], held: dict[str, np.dtype], found: dict[str, np.ndarray]
) -> dict[str, np.ndarray]:
    """Columns of a PLY file, by name: those of a scan, of the types that its file holds, and labels."""
    columns = dict(zip("xyz", block.positions.T, strict=True))
    if block.normals is not None:
        columns |= {f"n{axis}": values for axis, values in zip("xyz", block.normals.T, strict=True)}
    columns |= {name: block.attributes[name].astype(kind) for name, kind in kinds.items()}
    columns = {name: values.astype(held.get(name, values.dtype), copy=False) for name, values in columns.items()}
    colors = found.pop("colors")
    if (shades := block.shades) is not None:
        shade = np.uint8 if held.get("red") == np.uint8 else np.int32
        columns |= {f"scan_{name}": shades[:, i].astype(shade) for i, name in enumerate(COLOR_CHANNELS)}
    if columns["x"].dtype == np.float32:
        found = {name: values.astype(np.float32) if values.dtype == float else values for name, values in found.items()}
    return columns | found | dict(zip(COLOR_CHANNELS, colors.T, strict=True))
