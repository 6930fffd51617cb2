"""Clouds larger than memory: a sample of a file to skeletonise, and labels from file to file."""

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from ..analysis.segmentation import vertex_of_cloud
from ..errors import FileFormatError, InvalidCloudError, InvalidParameterError
from ..interop.atomic import check_ending, write_atomically
from ..interop.clouds import SAMPLE_COUNT
from ..interop.packages import import_open3d
from ..numerics.frame import not_finite
from ..numerics.grid_sampling import sample_blocks
from ..numerics.morton import morton_order
from ..numerics.neighbourhoods import nearest_neighbours
from ..pipeline import Pipeline
from ..refinement.thin_parts import SCALE_NEIGHBOUR
from ..sampler import Sampler
from ..skeleton import Skeleton
from .annotation import labels
from .formats import ply
from .scan import COLOR_CHANNELS, NORMAL_NAMES, Scan
from .scans import promised_points, read_blocks

STREAMED_ENDING = ".ply"  # of files that labels are streamed to
LARGE_CLOUD = 10_000_000  # measured: points that in memory take 2 GB, and in blocks half the time


def read_sample(
    path: str | os.PathLike, *, n: int | None = None, where: str | None = None, drop_invalid: bool = False
) -> Any:
    """Read the sample of a large scan that its skeleton needs, in memory that does not grow with the file.

    `Sampler` keeps the point nearest to the mean of each cell of a grid. This function finds these points block by
    block while reading, so the skeleton of the sample is that of the whole.

    Parameters
    ----------
    path : path-like
        As for `read_cloud`. LAS, LAZ, PCD and binary PLY are read in blocks, other formats as a whole.
    n : int, optional
        About how many points; all, if they are not more than twice as many. By default the number of `Sampler`: twice
        25000 or, from 152588 points on, 128 times the square root of their number, 1.28 million of 100 million.
    where : str, optional
        As for `read_cloud`.
    drop_invalid : bool
        Leave out points with NaN or infinite coordinates, instead of refusing.

    Returns
    -------
    open3d.t.geometry.PointCloud
        Points of the file, float64, with the attribute ``sample_count`` (N, 1) int32: the number of points of the file
        that each represents. Filters use it, and the commands count the points of the file.

    Raises
    ------
    InvalidCloudError
        Some points are not finite. Other errors are those of `read_cloud`.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from glsk_o3d import annotate, save_tensor_cloud, skeletonize
    >>> from glsk_o3d.samples import torus
    >>> whole = skeletonize(torus(120000).points)
    >>> with TemporaryDirectory() as folder:
    ...     save_tensor_cloud(annotate(whole), f"{folder}/scan.ply")
    ...     sample = read_sample(f"{folder}/scan.ply")
    >>> len(sample.point.positions) < 60000, int(sample.point.sample_count.numpy().sum())
    (True, 120000)
    >>> bool(np.allclose(skeletonize(sample).vertices, whole.vertices))
    True
    """
    if n is not None and (isinstance(n, bool) or not isinstance(n, int | np.integer) or n < 1):
        raise InvalidParameterError(f"n = {n!r}: must be an int of at least 1")
    size = Sampler().sample_size if n is None else lambda total: int(n)
    return _cloud(*_sampled(path, size, where, drop_invalid)[:2])


def _sampled(
    path: str | os.PathLike, size: Callable[[int], int], where: str | None, drop_invalid: bool
) -> tuple[np.ndarray, np.ndarray, int]:
    """As many points as `size` says of so many, how many each stands for, and how many were dropped."""
    dropped = 0

    def blocks() -> Iterator[np.ndarray]:
        nonlocal dropped
        at = first = dropped = 0
        for block in read_blocks(path, where=where, bare=True):
            finite = np.isfinite(block.positions).all(axis=1)
            if not (dropped or finite.all()):
                first = at + int(np.argmin(finite))
            dropped += len(finite) - int(finite.sum())
            if finite.any():
                yield block.positions if finite.all() else block.positions[finite]
            at += len(block)
        if dropped and not drop_invalid:
            raise not_finite(dropped, at, first)

    if promised_points(path) is None:  # it is one block: no need to read it again and again
        whole = list(blocks())
        points, counts = sample_blocks(lambda: whole, size)
    else:
        points, counts = sample_blocks(blocks, size)
    if len(points) == 0:
        raise InvalidCloudError(f"{os.fspath(path)}: there is no point with finite coordinates")
    return points, counts, dropped


def _cloud(points: np.ndarray, counts: np.ndarray) -> Any:
    o3d = import_open3d()
    cloud = o3d.t.geometry.PointCloud(o3d.core.Tensor(points))
    cloud.point[SAMPLE_COUNT] = o3d.core.Tensor(np.minimum(counts, np.iinfo(np.int32).max)[:, None].astype(np.int32))
    return cloud


def sample_for(
    pipeline: Pipeline[Any], path: str | os.PathLike, where: str | None = None, stream: bool | None = None
) -> Any | None:
    """The sample of a file that a pipeline takes of its points, as from `read_sample`, where that is worth while.

    By default that is where the file has more than ten million points; `stream` asks for it or forbids it. None where
    all is to be read; InvalidParameterError if a sample is asked for and the pipeline takes all points. Where the
    pipeline drops points that are not finite, the last one is NaN and stands for them, so that its report counts them.
    """
    if stream is False:
        return None
    sampler, n = pipeline.stages[0], promised_points(path)
    if not isinstance(sampler, Sampler) or sampler.sample_size(LARGE_CLOUD) >= LARGE_CLOUD:
        if stream:
            raise InvalidParameterError("this pipeline takes all points of a cloud: it cannot be given a sample")
        return None
    if stream is None and (n is None or n <= LARGE_CLOUD):
        return None
    points, counts, dropped = _sampled(path, sampler.sample_size, where, sampler.drop_invalid)
    if dropped:
        points, counts = np.append(points, np.full((1, 3), np.nan), axis=0), np.append(counts, dropped)
    return _cloud(points, counts)


def annotate_file(
    skeleton: Skeleton, path: str | os.PathLike, output: str | os.PathLike, *, where: str | None = None
) -> int:
    """Write a scan with labels to a file, block by block, in memory that does not grow with it.

    `glsk_o3d.annotate` for files: the same attributes, coloured by branch. The scan's own colours are attributes
    ``scan_red``, ``scan_green`` and ``scan_blue``. Attributes of a binary PLY file of the types float, double, uchar or
    int keep them, and radius, confidence and thickness are float if the coordinates are. Other attributes become int or
    double. ``thickness`` uses the spacing of the skeleton's points, and is NaN without them.

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
    FileFormatError
        The scan changed during reading, or the output is no PLY file, or is the scan.
    InvalidParameterError
        The skeleton is empty. Other errors are those of `read_cloud`.
    OSError
        The file cannot be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from glsk_o3d import annotate, read_tensor_cloud, save_tensor_cloud, skeletonize
    >>> from glsk_o3d.samples import torus
    >>> ring = skeletonize(torus(1000).points)
    >>> with TemporaryDirectory() as folder:
    ...     save_tensor_cloud(annotate(skeletonize(torus(3000).points)), f"{folder}/scan.ply")
    ...     annotate_file(ring, f"{folder}/scan.ply", f"{folder}/marked.ply")
    ...     int(read_tensor_cloud(f"{folder}/marked.ply").point.skeleton_vertex.max().item()) < len(ring.vertices)
    3000
    True
    """
    check_ending(output, "labelled cloud of a large file is PLY", STREAMED_ENDING)
    if Path(output).exists() and Path(path).exists() and os.path.samefile(path, output):
        raise FileFormatError(f"{os.fspath(output)}: is the scan itself: give another name")
    label = _labeller(skeleton)
    n, kinds = _survey(path, where)
    changed = FileFormatError(f"{os.fspath(path)}: has changed while it was read: label it again when it is complete")

    def write(temporary: Path) -> None:
        written, row = 0, None
        with temporary.open("wb") as stream:
            for block in read_blocks(path, where=where):
                if not kinds.keys() <= block.attributes.keys():
                    raise changed
                table = ply.rows_of(_columns(block, kinds, label(block.positions)))
                if row is None:
                    stream.write(ply.header_of(table.dtype, n))
                elif row != table.dtype:
                    raise changed
                written, row = written + len(table), table.dtype
                stream.write(table.tobytes())
        if written != n:
            raise changed

    write_atomically(output, write)
    return n


def _labeller(skeleton: Skeleton) -> Callable[[np.ndarray], dict[str, np.ndarray]]:
    """What says of points, (m, 3) float array, where they belong, coloured by branch."""
    if len(skeleton.vertices) == 0:
        raise InvalidParameterError("the skeleton is empty: there is nothing to label points with")
    known = np.flatnonzero(skeleton.vertex_of_point >= 0)
    points_of, owner = skeleton.points[known], skeleton.vertex_of_point[known]
    if len(known):
        tree = cKDTree(points_of)
        apart = nearest_neighbours(points_of, min(SCALE_NEIGHBOUR + 1, len(known)))[0][:, -1]
        with np.errstate(divide="ignore", invalid="ignore"):
            thickness_of = skeleton.radii[owner] / apart

    def label(points: np.ndarray) -> dict[str, np.ndarray]:
        vertex, thickness = np.full(len(points), -1), np.full(len(points), np.nan)
        if not len(known):
            vertex = vertex_of_cloud(skeleton, points)[1]
        elif len(rows := np.flatnonzero(np.isfinite(points).all(axis=1))):
            rows = rows[morton_order(points[rows])]  # what is near in memory is found faster
            nearest = tree.query(points[rows])[1]
            vertex[rows], thickness[rows] = owner[nearest], thickness_of[nearest]
        return labels(skeleton, points, vertex, thickness, "branch")

    return label


def _survey(path: str | os.PathLike, where: str | None) -> tuple[int, dict[str, np.dtype]]:
    """How many points there are, and of what type each attribute is that some of them have."""
    n, names, kinds = 0, list[str](), dict[str, np.dtype]()
    for block in read_blocks(path, where=where):
        n, names = n + len(block), list(block.attributes)
        for name, kind in block.kinds.items():
            kinds[name] = np.promote_types(kinds.get(name, kind), kind)
    return n, {name: kinds[name] for name in names if name in kinds}


def _columns(block: Scan, kinds: dict[str, np.dtype], found: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Columns of a PLY file, by name: those of a scan, of the types that its file holds, and labels."""
    held = {name: kind for name, kind in block.types.items() if kind.str[1:] in ply.WRITTEN_KINDS}
    columns = dict(zip("xyz", block.positions.T, strict=True))
    if block.normals is not None:
        columns |= dict(zip(NORMAL_NAMES, block.normals.T, strict=True))
    columns |= {name: block.attributes[name].astype(kind) for name, kind in kinds.items()}
    columns = {name: values.astype(held.get(name, values.dtype), copy=False) for name, values in columns.items()}
    colors = found.pop("colors")
    if (shades := block.shades) is not None:
        shade = np.uint8 if held.get("red") == np.uint8 else np.int32
        columns |= {f"scan_{name}": shades[:, i].astype(shade) for i, name in enumerate(COLOR_CHANNELS)}
    if columns["x"].dtype == np.float32:
        found = {name: values.astype(np.float32) if values.dtype == float else values for name, values in found.items()}
    return columns | found | dict(zip(COLOR_CHANNELS, colors.T, strict=True))
