"""LAS, LAZ and E57, the files of laser scanners: full digits, and all that is known of each return.

They are read by laspy with lazrs (extra ``las``) and by pye57 (extra ``e57``), which believe what a header says.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from ...interop.packages import require, require_for
from ..paths import breaks_off
from ..scan import COLOR_CHANNELS, NoPoints, Scan, brightest, named_attributes, unit_colors

VLR_BYTES, EVLR_BYTES = 54, 60  # published: LAS 1.4 R15, of the heads of records
PACKED_RECORD, LAYERED = 22204, 3  # published: LASzip's own record, and its way to pack in which chunks have layers
LAYERS = {10: 9, 11: 1, 12: 2, 13: 1}  # published: of the parts of a point, by their types; others have one per byte
MOST_PACKED = 200  # fitted: points of a LAZ file per byte; of flat grids there are 93, of a million in one place 140
_E57_PLACE = ["cartesianX", "cartesianY", "cartesianZ"]
_E57_COLORS = ["colorRed", "colorGreen", "colorBlue"]


def blocks(path: Path, rows: int, bare: bool) -> tuple[int, Iterator[Scan]]:
    """What is 0 in all of a block is unset in it. A file that promises more than its bytes hold is refused: laspy would
    look for each point, lazrs take memory.
    """
    require_for(path.suffix)
    with path.open("rb") as stream:
        points = _check_header(stream, path.stat().st_size, path.suffix.lower() == ".laz")
    return points, _blocks(path, rows, bare)


def _blocks(path: Path, rows: int, bare: bool) -> Iterator[Scan]:
    with _opened(path, "decompress_z" if bare else "all") as file:
        n = file.header.point_count
        top = _brightest(path, rows) if rows < n and not bare else None
        for begin in range(0, n, rows):
            points = file.read_points(rows)
            if len(points) < min(rows, n - begin):
                raise breaks_off(n, begin + len(points))
            yield _scan(points, top, bare)


@contextmanager
def _opened(path: Path, parts: str) -> Iterator[Any]:
    """laspy's reader of some parts of the points.

    In one thread: in many, lazrs takes all memory that a file asks for, and ends the process where there is none.
    """
    laspy = require("laspy")
    selection = laspy.DecompressionSelection
    chosen = selection.all() if parts == "all" else getattr(selection.base(), parts)()
    try:
        with laspy.open(path, laz_backend=laspy.LazBackend.Lazrs, decompression_selection=chosen) as file:
            yield file
    except BaseException as error:  # what lazrs does not expect is none of Python's own exceptions
        if type(error).__name__ != "PanicException":
            raise
        raise ValueError(f"lazrs cannot read it: {error}") from None


def _scan(points: Any, top: float | None, bare: bool) -> Scan:
    """Some of the points; `top` is the largest number among the colours of all, None if these are all."""
    positions = np.ascontiguousarray(np.column_stack([points.x, points.y, points.z]), float)
    if bare:
        return Scan(positions)
    names = [name for name in points.point_format.dimension_names if name not in ("X", "Y", "Z")]
    colors = np.column_stack([points[name] for name in COLOR_CHANNELS]) if set(COLOR_CHANNELS) <= set(names) else None
    held = ((name, np.asarray(points[name])) for name in names if name not in COLOR_CHANNELS)
    attributes = named_attributes((name, values) for name, values in held if values.ndim == 1)
    unset = frozenset(name for name, values in attributes.items() if not values.any())
    if colors is not None:
        top = brightest(colors) if top is None else top
        colors = unit_colors(colors, top) if top else None
    return Scan(positions, colors, None, attributes, unset=unset)


def _brightest(path: Path, rows: int) -> float:
    """The largest number among all colours, or the first that is not of eight bits; 0 if there are none."""
    top = 0.0
    with _opened(path, "decompress_rgb") as file:
        if {*COLOR_CHANNELS} <= {*file.header.point_format.dimension_names}:
            for points in file.chunk_iterator(rows):
                top = max(top, *(brightest(np.asarray(points[name])) for name in COLOR_CHANNELS))
                if top > 255:
                    break
    return top


def _check_header(stream: BinaryIO, size: int, packed: bool) -> int:
    """The points of a file of so many bytes; ValueError where it promises more than they hold."""
    head = stream.read(375)
    if len(head) < 227 or head[:4] != b"LASF":
        raise ValueError("it does not start with the header of a LAS file")

    def number(at: int, length: int) -> int:
        return int.from_bytes(head[at : at + length], "little")

    is_14 = (head[24], head[25]) >= (1, 4) and len(head) >= 255
    points, start, point_bytes = number(247, 8) if is_14 else number(107, 4), number(96, 4), number(105, 2)
    least = 1 / MOST_PACKED if packed else 1
    records = [(number(100, 4), VLR_BYTES), (number(243, 4) * is_14, EVLR_BYTES), (points, least)]
    if any(count * length > size for count, length in records) or start > size:
        raise ValueError(f"its header promises more than its {size} bytes can hold")
    if packed:
        _check_packed(stream, size, number(94, 2), number(100, 4), start, points, point_bytes)
    elif size - start < points * point_bytes:
        raise breaks_off(points, (size - start) // point_bytes)
    return points


def _check_packed(
    stream: BinaryIO, size: int, at: int, records: int, start: int, points: int, point_bytes: int
) -> None:
    """The same of what LASzip says: the bytes of a point, the number of chunks, and how long their layers are."""

    def number(length: int, place: int | None = None) -> int:
        if place is not None:
            stream.seek(place)
        return int.from_bytes(stream.read(length), "little")

    layers, together = 0, 1
    for _ in range(records):
        kind, length = number(2, at + 18), number(2)
        if kind == PACKED_RECORD:
            layered = number(2, at + VLR_BYTES) == LAYERED
            together = max(
                number(4, at + VLR_BYTES + 12), 1
            )  # points of a chunk; the largest number if each has its own
            items = np.frombuffer(stream.read(6 * number(2, at + VLR_BYTES + 32)), "<u2").reshape(-1, 3)
            if items[:, 1].sum() != point_bytes:
                raise ValueError(f"its points have {point_bytes} bytes, and those that are packed {items[:, 1].sum()}")
            layers = sum(LAYERS.get(kind, wide) for kind, wide, _ in items.tolist()) * layered
        at += VLR_BYTES + length
    table = number(8, start)
    if table == 2**64 - 1:  # it was not known yet, and stands at the end
        table = number(8, size - 8)
    chunks = number(4, min(table, size) + 4)
    # each has a whole point; of those that the table does not have lazrs would believe all
    place, sound = start + 8, start < table < size and -(-points // together) <= chunks <= size / max(point_bytes, 1)
    for _ in range(chunks * (layers > 0) * sound):
        stream.seek(place + point_bytes + 4)
        lengths = np.frombuffer(stream.read(4 * layers), "<u4")
        place += point_bytes + 4 + 4 * layers + int(lengths.sum(dtype=np.uint64))
        if place > table:
            sound = False
            break
    if not sound:
        raise ValueError(f"its table of chunks, or one of them, promises more than its {size} bytes can hold")


def read_e57(path: Path) -> Scan:
    """The points of all scans of an E57 file, moved by their poses; ``scan`` says which one each is from."""
    with require("pye57").E57(str(path)) as file:
        options = dict(intensity=True, colors=True, ignore_missing_fields=True)
        scans = [file.read_scan(i, **options) for i in range(file.scan_count)]
    if not scans:
        raise NoPoints("it holds no scan")
    sizes = [len(scan[_E57_PLACE[0]]) for scan in scans]

    def together(names: list[str]) -> np.ndarray:
        return np.column_stack([np.concatenate([scan[name] for scan in scans]) for name in names])

    attributes = {"scan": np.repeat(np.arange(len(scans)), sizes)}
    if any("intensity" in scan for scan in scans):
        held = (scan.get("intensity", np.full(n, np.nan)) for scan, n in zip(scans, sizes, strict=True))
        attributes["intensity"] = np.concatenate(list(held))
    colored = all(name in scan for scan in scans for name in _E57_COLORS)
    colors = unit_colors(together(_E57_COLORS)) if colored else None
    return Scan(together(_E57_PLACE).astype(float), colors, None, attributes)
