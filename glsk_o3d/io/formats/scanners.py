"""LAS, LAZ and E57, the files of laser scanners: full digits, and all that is known of each return.

They are read by laspy with lazrs (extra ``las``) and by pye57 (extra ``e57``).
"""

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from ...interop.packages import require, require_for
from ..paths import NoPoints, check_budget, check_promised
from ..scan import COLOR_CHANNELS, Scan, brightest, scan_of

VLR_BYTES = 54  # published: LAS 1.4 R15, of the head of a record
LAYERED = 3  # published: LASzip's way to pack in which chunks have layers
LAYERS = {10: 9, 11: 1, 12: 2, 13: 1}  # published: of the parts of a point, by their types; others have one per byte
_E57_PLACE = ["cartesianX", "cartesianY", "cartesianZ"]
_E57_COLORS = dict(zip(("colorRed", "colorGreen", "colorBlue"), COLOR_CHANNELS, strict=True))
_E57_INVALID = "cartesianInvalidState"
_E57_BYTES = 32  # derived: of a point with all that is read of it


def blocks(path: Path, rows: int, bare: bool) -> tuple[int, Iterator[Scan]]:
    """The number of points, and the points, in blocks of so many."""
    require_for(path.suffix)
    size = path.stat().st_size
    with path.open("rb") as stream:
        head, start, records = struct.unpack("<94xHII", stream.read(104).ljust(104, b"\0"))
        check_promised(start, size, "bytes before its points")
        check_promised(records, (start - head) // VLR_BYTES, "records")  # laspy would look for each
        stream.seek(0)
        header = require("laspy").LasHeader.read_from(stream)
        n, room = header.point_count, size - header.offset_to_point_data
        if header.are_points_compressed:
            check_budget(n * header.point_format.size, size)
            _check_chunks(stream, header, size)
        else:
            check_promised(n, room // header.point_format.size)
    return n, _blocks(path, rows, bare)


def _check_chunks(stream: BinaryIO, header: Any, size: int) -> None:
    """Raise ValueError where a LAZ file of so many bytes promises more: lazrs would believe it, and not come back."""

    def number(place: int, length: int) -> int:
        stream.seek(place)
        return int.from_bytes(stream.read(length), "little")

    record = header.vlrs.get("LasZipVlr")[0].record_data
    chunk, n_items = struct.unpack_from("<12xI16xH", record)
    items = np.frombuffer(record, "<u2", 3 * n_items, 34).reshape(-1, 3)
    point = int(items[:, 1].sum())
    layers = sum(LAYERS.get(kind, width) for kind, width, _ in items.tolist()) if record[0] == LAYERED else 0
    place = header.offset_to_point_data + 8
    table = number(place - 8, 8)
    if table == 2**64 - 1:  # it was not known yet, and stands at the end
        table = number(size - 8, 8)
    chunks = number(min(table, size) + 4, 4)
    # each has a whole point; of those that the table does not have lazrs would believe all
    sound = 0 < point == header.point_format.size and place <= table < size
    sound = sound and -(-header.point_count // (chunk or 1)) <= chunks <= size / max(point, 1)
    for _ in range(chunks if sound and layers else 0):
        lengths = [number(place + point + 4 * layer, 4) for layer in range(1, 1 + layers)]
        place += point + 4 * (1 + layers) + sum(lengths)
        sound = sound and place <= table
    if not sound:
        raise ValueError("its chunks, or their table, promise more than it holds: it is damaged")


def _blocks(path: Path, rows: int, bare: bool) -> Iterator[Scan]:
    with _opened(path, "decompress_z" if bare else "all") as file:
        n = file.header.point_count
        top = _brightest(path, rows) if rows < n and not bare else None
        for begin in range(0, n, rows):
            points = file.read_points(rows)
            if len(points) < min(rows, n - begin):
                check_promised(n, begin + len(points))
            names = [] if bare else [name for name in file.header.point_format.dimension_names if name not in "XYZ"]
            columns = {name: np.asarray(points[name]) for name in ("x", "y", "z", *names)}
            columns = {name: values for name, values in columns.items() if values.ndim == 1}
            yield scan_of(columns, top)


def _opened(path: Path, parts: str = "all") -> Any:
    """laspy's reader of some parts of the points, in one thread: in many, lazrs takes what memory a file asks for."""
    laspy = require("laspy")
    selection = laspy.DecompressionSelection
    chosen = selection.all() if parts == "all" else getattr(selection.base(), parts)()
    return laspy.open(path, laz_backend=laspy.LazBackend.Lazrs, decompression_selection=chosen, read_evlrs=False)


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


def read_e57(path: Path) -> Scan:
    """The points of all scans of an E57 file, moved by their poses; ``scan`` says which one each is from."""
    with require("pye57").E57(str(path)) as file:
        headers = [file.get_header(i) for i in range(file.scan_count)]
        check_budget(_E57_BYTES * sum(header.point_count for header in headers), path.stat().st_size)
        scans = [_e57_scan(file, header) for header in headers]
    if not scans:
        raise NoPoints("it holds no scan")
    number = np.repeat(np.arange(len(scans)), [len(scan["x"]) for scan in scans])
    names = set.intersection(*map(set, scans))  # that all have
    return scan_of({name: np.concatenate([scan[name] for scan in scans]) for name in names} | {"scan": number})


def _e57_scan(file: Any, header: Any) -> dict[str, np.ndarray]:
    """The fields of a scan's valid points: pye57's own `read_scan` returns also those that are not there."""
    names = [name for name in ("intensity", *_E57_COLORS, _E57_INVALID) if name in header.point_fields]
    data, buffers = file.make_buffers([*_E57_PLACE, *names], header.point_count)
    check_promised(header.point_count, header.points.reader(buffers).read())
    if (invalid := data.pop(_E57_INVALID, None)) is not None:
        data = {name: values[invalid == 0] for name, values in data.items()}
    xyz = np.column_stack([data.pop(name) for name in _E57_PLACE])
    if header.has_pose():
        xyz = file.to_global(xyz, header.rotation, header.translation)
    return {_E57_COLORS.get(name, name): values for name, values in data.items()} | dict(zip("xyz", xyz.T, strict=True))
