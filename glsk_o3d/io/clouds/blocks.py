"""Scans from files a block of points at a time, so that memory does not grow with the file."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import InvalidParameterError
from ..scans import holds_no_points, read_whole, refused_where_damaged, scan_file
from . import las, pcd, ply_points
from .scanned import Scan
from .selection import chosen_points, none_chosen, parsed

BLOCK_ROWS = 1_000_000  # measured: larger blocks are not read faster, and take more memory


def read_blocks(
    path: str | os.PathLike, *, rows: int = BLOCK_ROWS, where: str | None = None, bare: bool = False
) -> Iterator[Scan]:
    """Read a scan a few points at a time, in the order of the file.

    LAS, LAZ, PCD (text and binary) and binary PLY without faces are read in blocks. Everything else is one block: text,
    E57, compressed PCD, whose columns follow each other, and meshes.

    Parameters
    ----------
    path : path-like
    rows : int
        Points to a block.
    where : str, optional
        As for `glsk_o3d.read_cloud`. Blocks have fewer points then, and there is none without.
    bare : bool
        Positions alone are wanted: a condition apart, nothing else is read where that is faster.

    Returns
    -------
    iterator of Scan
        Joined they are what `glsk_o3d.io.scans.read_scan` gives, to the last bit; in a block, attributes are unset
        that are so there.

    Raises
    ------
    FileNotFoundError
    FileFormatError
    InvalidParameterError
    InvalidCloudError
    MissingPackageError
        As from `glsk_o3d.read_cloud`; what shows only while reading, then. Where a binary PLY or PCD or a LAS file
        breaks off, it shows before the first block.

    Notes
    -----
    The scale of colours is that of all of them: where it is not that of the type, these are looked at first, in LAZ
    until one is found that needs sixteen bits.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from glsk_o3d import save_tensor_cloud, skeletonize
    >>> from glsk_o3d.samples import torus
    >>> with TemporaryDirectory() as folder:
    ...     save_tensor_cloud(skeletonize(torus(1000).points).annotate(), f"{folder}/scan.ply")
    ...     [len(block) for block in read_blocks(f"{folder}/scan.ply", rows=400)]
    [400, 400, 200]
    """
    if isinstance(rows, bool) or not isinstance(rows, int) or rows < 1:
        raise InvalidParameterError(f"rows = {rows!r}: must be an int of at least 1")
    path = scan_file(path)
    if where is not None:
        parsed(where)
    reader = _BLOCK_READERS.get(path.suffix.lower())
    with refused_where_damaged(path):
        blocks = None if reader is None else reader.blocks(path, rows, bare and where is None)
    found = iter([read_whole(path)]) if blocks is None else _watched(path, blocks)
    return found if where is None else _selected(found, where)


def promised_points(path: str | os.PathLike) -> int | None:
    """How many points a file holds by its header; None for one that is not read in blocks. Errors as `read_blocks`."""
    path = scan_file(path)
    reader = _BLOCK_READERS.get(path.suffix.lower())
    with refused_where_damaged(path):
        return None if reader is None else reader.promised(path)


def held_types(path: str | os.PathLike) -> dict[str, np.dtype]:
    """Of what type a binary PLY file has its columns, by name: coordinates, normals, colours and attributes.

    Empty for all else. Errors as `read_blocks`.
    """
    path = scan_file(path)
    with refused_where_damaged(path):
        return (ply_points.types(path) or {}) if path.suffix.lower() == ".ply" else {}


def _watched(path: Path, blocks: Iterator[Scan]) -> Iterator[Scan]:
    """The same blocks, and errors as those of files."""
    with refused_where_damaged(path):
        first = next(blocks, None)
    if first is None:
        raise holds_no_points(path)
    yield first
    with refused_where_damaged(path):
        yield from blocks


def _selected(blocks: Iterator[Scan], where: str) -> Iterator[Scan]:
    any_chosen = False
    for block in blocks:
        chosen = chosen_points(block, where)
        if chosen.any():
            any_chosen = True
            yield block[chosen]
    if not any_chosen:
        raise none_chosen(where)


_BLOCK_READERS: dict[str, Any] = {".ply": ply_points, ".pcd": pcd, ".las": las, ".laz": las}
