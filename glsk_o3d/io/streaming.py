"""Clouds larger than memory: a sample of a file to skeletonise, and labels from file to file."""

import os
from collections.abc import Callable, Generator, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ..analysis.segmentation import vertex_of_cloud
from ..data.skeleton import Skeleton
from ..errors import FileFormatError, InvalidCloudError
from ..filters.sampler import Sampler
from ..geometry.frame import not_finite
from ..geometry.grid_sampling import sample_blocks
from ..geometry.vectors import finite_rows
from ..interop.atomic import check_ending, write_atomically
from ..interop.clouds import SAMPLE_COUNT, CountedPoints, SurfaceMesh
from ..parameters import check_number
from ..pipeline import Pipeline
from .annotation import labels
from .formats import ply
from .scan import COLOR_CHANNELS, Scan, color_bytes
from .scans import promised_points, read_blocks, read_scan

LABELLED_ENDING = ".ply"
LARGE_CLOUD = 10_000_000  # measured: points that in memory take 1.4 GB, and in blocks half of that


def read_sample(
    path: str | os.PathLike[str], *, n: int | None = None, where: str | None = None, drop_invalid: bool = False
) -> Any:
    """Read the sample of a large scan that its skeleton needs, in memory that does not grow with the file.

    It has the points that `Sampler` keeps, so its skeleton is that of the whole.

    Parameters
    ----------
    path : path-like
        As for `read_cloud`. LAS, LAZ, PCD and binary PLY are read in blocks, other formats as a whole.
    n : int, optional
        About how many points; all, if they are not more than twice as many. By default the number of `Sampler`.
    where : str, optional
        As for `read_cloud`.
    drop_invalid : bool
        Leave out points with NaN or infinite coordinates, instead of refusing.

    Returns
    -------
    open3d.t.geometry.PointCloud
        float64, with the attribute ``sample_count`` (N, 1) int32, which filters use: how many points each represents.

    Raises
    ------
    InvalidCloudError
        Some points are not finite. Other errors are those of `read_cloud`.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from glsk_o3d.samples import torus
    >>> with TemporaryDirectory() as folder:
    ...     np.savetxt(f"{folder}/scan.xyz", torus(120000).points)
    ...     sample = read_sample(f"{folder}/scan.xyz")
    >>> len(sample.point.positions) < 60000, int(sample.point.sample_count.numpy().sum())
    (True, 120000)
    """
    check_number("n", n, "int?", low=1)
    size = Sampler().sample_size if n is None else lambda total: int(n)
    points, counts, _ = _sampled(path, size, where, drop_invalid)
    counts = np.minimum(counts, np.iinfo(np.int32).max).astype(np.int32)
    return Scan(points, attributes={SAMPLE_COUNT: counts}).to_tensor()


def _sampled(
    path: str | os.PathLike[str], size: Callable[[int], int], where: str | None, drop_invalid: bool
) -> tuple[np.ndarray, np.ndarray, int]:
    """As many points as `size` says of so many, how many each stands for, and how many were dropped."""
    dropped = 0

    def blocks() -> Iterator[np.ndarray]:
        nonlocal dropped
        dropped = yield from finite_blocks(path, where, drop_invalid)

    if promised_points(path) is None:  # it is one block: no need to read it again and again
        whole = list(blocks())
        points, counts = sample_blocks(lambda: whole, size)
    else:
        points, counts = sample_blocks(blocks, size)
    if len(points) == 0:
        raise InvalidCloudError(f"{os.fspath(path)}: there is no point with finite coordinates")
    return points, counts, dropped


def finite_blocks(
    path: str | os.PathLike[str], where: str | None, drop_invalid: bool
) -> Generator[np.ndarray, None, int]:
    """The finite points of a file, those by area of a mesh, in (m, 3) arrays; returns how many others it has.

    InvalidCloudError in the end if there are some, unless these are to be dropped.
    """
    n = first = dropped = 0
    for block in map(Scan.by_area, read_blocks(path, where=where, bare=True)):
        finite = finite_rows(block.positions)
        if not (dropped or finite.all()):
            first = n + int(np.argmin(finite))
        dropped += len(finite) - int(finite.sum())
        if finite.any():
            yield block.positions if finite.all() else block.positions[finite]
        n += len(block)
    if dropped and not drop_invalid:
        raise not_finite(dropped, n, first)
    return dropped


def points_for(pipeline: Pipeline[Any, Any], path: str | os.PathLike[str], where: str | None = None) -> Any:
    """What a pipeline takes of a file: its points and triangles, or a sample of the points.

    The sample, as of `read_sample`, is taken where the file has more than ten million points and the pipeline does not
    take all. Where the pipeline drops points that are not finite, the last one is NaN and stands for them, so that its
    report counts them. Errors are those of `read_cloud`.
    """
    sampler = pipeline.stages[0]
    if (
        not isinstance(sampler, Sampler)
        or sampler.sample_size(LARGE_CLOUD) >= LARGE_CLOUD
        or (promised_points(path) or 0) <= LARGE_CLOUD
    ):
        scan = read_scan(path, where)
        return SurfaceMesh(scan.positions, scan.triangles) if len(scan.triangles) else scan.positions
    points, counts, dropped = _sampled(path, sampler.sample_size, where, sampler.drop_invalid)
    if dropped:
        points, counts = np.append(points, np.full((1, 3), np.nan), axis=0), np.append(counts, dropped)
    return CountedPoints(points, counts)


def annotate_file(
    skeleton: Skeleton, path: str | os.PathLike[str], output: str | os.PathLike[str], *, where: str | None = None
) -> int:
    """Write a scan with labels to a file, block by block, in memory that does not grow with it.

    `glsk_o3d.annotate` for files: the same attributes, coloured by branch. The scan's own colours are ``scan_red``,
    ``scan_green`` and ``scan_blue``. Attributes that PLY cannot hold become int or double; radius and confidence are
    float if the coordinates are.

    Parameters
    ----------
    skeleton : Skeleton
        Such as that of `read_sample`.
    path, where
        As for `read_cloud`; other points are not written.
    output : path-like
        PLY; it appears complete or not at all.

    Returns
    -------
    int
        The number of points.

    Raises
    ------
    FileFormatError
        The output is no PLY file, or is the scan.
    InvalidParameterError
        The skeleton is empty. Other errors are those of `read_cloud`.
    OSError
        The file cannot be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import torus
    >>> with TemporaryDirectory() as folder:
    ...     np.savetxt(f"{folder}/scan.xyz", torus(3000).points)
    ...     annotate_file(skeletonize(torus(1000).points), f"{folder}/scan.xyz", f"{folder}/marked.ply")
    3000
    """
    check_ending(output, "cloud with labels is PLY", LABELLED_ENDING)
    if Path(output).exists() and Path(path).exists() and os.path.samefile(path, output):
        raise FileFormatError(f"{os.fspath(output)}: is the scan itself: give another name")
    n = 0

    def write(temporary: Path) -> None:
        nonlocal n
        for block in read_blocks(path, where=where):
            vertex = vertex_of_cloud(skeleton, block.positions)[1]
            named = labels(skeleton, block.positions, vertex, "branch")
            n = ply.append(temporary, ply.rows_of(_columns(block, named)), n)

    write_atomically(output, write)
    return n


def _columns(block: Scan, named: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Columns of a PLY file, by name: those of a scan, and labels."""
    arrays = {"positions": block.positions, **block.attributes, **named}
    if block.normals is not None:
        arrays["normals"] = block.normals
    if block.colors is not None:
        names = [f"scan_{name}" for name in COLOR_CHANNELS]
        arrays |= dict(zip(names, color_bytes(block.colors).T, strict=True))
    if block.single:
        own = {"positions", "normals", *named}
        arrays |= {name: arrays[name].astype(np.float32) for name in own & arrays.keys() if arrays[name].dtype == float}
    return ply.columns_of(arrays)
