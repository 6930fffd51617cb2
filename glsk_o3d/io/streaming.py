"""Clouds larger than memory: a sample of a file to skeletonise."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InvalidCloudError, InvalidParameterError
from ..interop.clouds import SAMPLE_COUNT
from ..interop.packages import import_open3d
from ..preparation.frame import not_finite
from ..preparation.streaming import sample_blocks
from ..ring_builder import RingBuilder
from .clouds.blocks import promised_points, read_blocks

if TYPE_CHECKING:
    from ..pipeline import Pipeline

LARGE_CLOUD = 10_000_000  # measured: points that in memory take 2 GB, and in blocks half the time


def read_sample(
    path: str | os.PathLike, *, n: int | None = None, where: str | None = None, drop_invalid: bool = False
) -> Any:
    """Read of a large scan the points that its skeleton is made from, in memory that does not grow with the file.

    Of large clouds `RingBuilder` keeps the point nearest to the mean of each cell of a grid. Here it is found while
    reading, block by block: the skeleton of the sample is that of the whole.

    Parameters
    ----------
    path : path-like
        As for `read_cloud`. What ``glsk_o3d.io.clouds.blocks.read_blocks`` cannot read in blocks is read whole.
    n : int, optional
        About how many points; all, if they are not more than twice as many. By default what `RingBuilder` takes: twice
        25000 or, from 152588 points on, 128 times the square root of their number, 1.28 of 100 million.
    where : str, optional
        As for `read_cloud`.
    drop_invalid : bool
        Leave out points with NaN or infinite coordinates, instead of refusing.

    Returns
    -------
    open3d.t.geometry.PointCloud
        Points of the file, float64, and the attribute ``sample_count`` (N, 1) int32: how many points of the file each
        stands for. Filters take it into account; the commands, which begin with a file, count its points.

    Raises
    ------
    FileNotFoundError
    FileFormatError
    InvalidParameterError
    MissingPackageError
        As from `read_cloud`.
    InvalidCloudError
        As from there, and for points that are not finite.

    Notes
    -----
    The file is read four times, a small one twice: how far it reaches, how fine the grid must be, means, and nearest
    points. Points that repeat count, which they do not in memory.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from glsk_o3d import save_tensor_cloud, skeletonize
    >>> from glsk_o3d.samples import torus
    >>> whole = skeletonize(torus(120000).points)
    >>> with TemporaryDirectory() as folder:
    ...     save_tensor_cloud(whole.annotate(), f"{folder}/scan.ply")
    ...     sample = read_sample(f"{folder}/scan.ply")
    >>> len(sample.point.positions) < 60000, int(sample.point.sample_count.numpy().sum())
    (True, 120000)
    >>> bool(np.allclose(skeletonize(sample).vertices, whole.vertices))
    True
    """
    if n is not None and (isinstance(n, bool) or not isinstance(n, int | np.integer) or n < 1):
        raise InvalidParameterError(f"n = {n!r}: must be an int of at least 1")
    size = RingBuilder().sample_size if n is None else lambda total: int(n)
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
    """The sample of a file that a pipeline takes of its points, where that is worth while.

    Parameters
    ----------
    pipeline : Pipeline
    path : path-like
    where : str, optional
    stream : bool, optional
        Whether to; by default where the file has more than ten million points.

    Returns
    -------
    open3d.t.geometry.PointCloud or None
        As from `read_sample`; and where the pipeline drops points that are not finite, the last one is NaN and stands
        for them, so that its report counts them. None if all is to be read: there are too few points to take a sample
        of, or they are not to be read so, or the pipeline takes all.

    Raises
    ------
    InvalidParameterError
        A sample is asked for, and the pipeline takes all points.
    """
    if stream is False:
        return None
    rings, n = pipeline.stages[0], promised_points(path)
    if not isinstance(rings, RingBuilder) or rings.sample_size(LARGE_CLOUD) >= LARGE_CLOUD:
        if stream:
            raise InvalidParameterError("this pipeline takes all points of a cloud: it cannot be given a sample")
        return None
    if stream is None and (n is None or n <= LARGE_CLOUD):
        return None
    points, counts, dropped = _sampled(path, rings.sample_size, where, rings.drop_invalid)
    if dropped:
        points, counts = np.append(points, np.full((1, 3), np.nan), axis=0), np.append(counts, dropped)
    return _cloud(points, counts)
