"""LAS, LAZ and E57, the files of laser scanners: full digits, and all that is known of each return.

They are read by laspy with lazrs (extra ``las``) and by pye57 (extra ``e57``), which believe what a header says: it is
checked before. XML of E57 may neither name other files nor be nested as no scanner does.
"""

import io
import struct
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO
from xml.parsers import expat

import numpy as np

from ...interop.packages import require, require_for
from ..paths import check_budget, check_promised
from ..scan import COLOR_CHANNELS, NoPoints, Scan, brightest, named_attributes, unit_colors

VLR_BYTES, EVLR_BYTES = 54, 60  # published: LAS 1.4 R15, of the heads of records
PACKED_RECORD, LAYERED = 22204, 3  # published: LASzip's own record, and its way to pack in which chunks have layers
LAYERS = {10: 9, 11: 1, 12: 2, 13: 1}  # published: of the parts of a point, by their types; others have one per byte
PAGE, PAGE_DATA = 1024, 1020  # published: E57's bytes of a page, and those before its checksum
DEEPEST_XML, WIDEST_XML = 100, 5000  # fitted: E57 needs 8 elements inside each other, and one in another for each scan
_E57_PLACE = ["cartesianX", "cartesianY", "cartesianZ"]
_E57_POLAR = ["sphericalRange", "sphericalAzimuth", "sphericalElevation"]
_E57_COLORS = ["colorRed", "colorGreen", "colorBlue"]
_E57_BYTES = 32  # derived: of a point with all that is read of it


class _Part(io.FileIO):
    """A file that ends where its points do: lazrs would go on with what follows them."""

    end = sys.maxsize

    def readinto(self, buffer: Any) -> int | None:
        return super().readinto(memoryview(buffer)[: max(self.end - self.tell(), 0)])


def blocks(path: Path, rows: int, bare: bool) -> tuple[int, Iterator[Scan]]:
    """What is 0 in all of a block is unset in it. A file that promises more than its bytes hold is refused: laspy would
    look for each point, lazrs take memory.
    """
    require_for(path.suffix)
    with path.open("rb") as stream:
        points, end = _check_header(stream, path.stat().st_size, path.suffix.lower() == ".laz")
    return points, _blocks(path, end, rows, bare)


def _blocks(path: Path, end: int, rows: int, bare: bool) -> Iterator[Scan]:
    with _opened(path, end, "decompress_z" if bare else "all") as file:
        n = file.header.point_count
        top = _brightest(path, end, rows) if rows < n and not bare else None
        for begin in range(0, n, rows):
            points = file.read_points(rows)
            if len(points) < min(rows, n - begin):
                check_promised(n, begin + len(points))
            yield _scan(points, top, bare)


@contextmanager
def _opened(path: Path, end: int, parts: str) -> Iterator[Any]:
    """laspy's reader of some parts of the points, which end at a byte.

    In one thread: in many, lazrs takes all memory that a file asks for, and ends the process where there is none.
    """
    laspy = require("laspy")
    selection = laspy.DecompressionSelection
    chosen = selection.all() if parts == "all" else getattr(selection.base(), parts)()
    options = dict(laz_backend=laspy.LazBackend.Lazrs, decompression_selection=chosen, read_evlrs=False)
    try:
        with _Part(path) as stream, laspy.open(stream, **options) as file:
            _ = file.point_source  # which reads what stands behind the points
            stream.end = end
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


def _brightest(path: Path, end: int, rows: int) -> float:
    """The largest number among all colours, or the first that is not of eight bits; 0 if there are none."""
    top = 0.0
    with _opened(path, end, "decompress_rgb") as file:
        if {*COLOR_CHANNELS} <= {*file.header.point_format.dimension_names}:
            for points in file.chunk_iterator(rows):
                top = max(top, *(brightest(np.asarray(points[name])) for name in COLOR_CHANNELS))
                if top > 255:
                    break
    return top


def _check_header(stream: BinaryIO, size: int, packed: bool) -> tuple[int, int]:
    """The points of a file of so many bytes, and where they end; ValueError where it promises more than they hold."""
    head = stream.read(375)
    if len(head) < 227 or head[:4] != b"LASF":
        raise ValueError("it does not start with the header of a LAS file")

    def number(at: int, length: int) -> int:
        return int.from_bytes(head[at : at + length], "little")

    is_14 = (head[24], head[25]) >= (1, 4) and len(head) >= 255
    points, start, point_bytes = number(247, 8) if is_14 else number(107, 4), number(96, 4), number(105, 2)
    header, records = number(94, 2), number(100, 4)
    check_promised(start, size, "bytes before its points")
    check_promised(records, (start - header) // VLR_BYTES, "records")
    check_promised(number(243, 4) * is_14, size // EVLR_BYTES, "records behind its points")
    if packed:
        check_budget(points * point_bytes, size)
        return points, _check_packed(stream, size, header, records, start, points, point_bytes)
    check_promised(points, (size - start) // max(point_bytes, 1))
    return points, size


def _check_packed(stream: BinaryIO, size: int, at: int, records: int, start: int, points: int, point_bytes: int) -> int:
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
            together = number(4, at + VLR_BYTES + 12) or 1  # points of a chunk; the largest number if each has its own
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
    return table


def read_e57(path: Path) -> Scan:
    """The points of all scans of an E57 file, moved by their poses; ``scan`` says which one each is from."""
    pye57 = require("pye57")
    _check_xml(path)
    with pye57.E57(str(path)) as file:
        headers, left = [file.get_header(i) for i in range(file.scan_count)], path.stat().st_size
        check_budget(_E57_BYTES * sum(header.point_count for header in headers), left)
        for header in headers:  # two may name the same bytes
            fields = pye57.libe57.StructureNode(header.points.prototype())
            bits = max(sum(_bits(fields[name]) for name in header.point_fields), 1)
            check_promised(header.point_count, 8 * left // bits)
            left -= header.point_count * bits // 8
        scans = [_e57_scan(file, header) for header in headers]
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


def _check_xml(path: Path) -> None:
    """Raise ValueError where the XML of an E57 file declares or names what is not in it, or is nested too deeply."""
    with path.open("rb") as stream:
        at, length, page = struct.unpack("<24x3Q", stream.read(48).ljust(48, b"\0"))
        if page != PAGE:
            raise ValueError("it does not start with the header of an E57 file")
        check_promised(at + length, path.stat().st_size, "bytes")
        stream.seek(at - at % PAGE)
        pages = stream.read(at % PAGE + length + (length // PAGE_DATA + 2) * (PAGE - PAGE_DATA))
    data = b"".join(pages[i : i + PAGE_DATA] for i in range(0, len(pages), PAGE))
    parser, inside = expat.ParserCreate(), [0]  # how many elements each of those that are open has

    def start(*_: Any) -> None:
        inside[-1] += 1
        inside.append(0)
        if len(inside) > DEEPEST_XML or inside[-2] > WIDEST_XML:
            raise ValueError(f"its XML has more than {DEEPEST_XML} elements inside each other, or {WIDEST_XML} in one")

    def end(_: str) -> None:
        inside.pop()

    def doctype(*_: Any) -> None:
        raise ValueError("its XML has a DOCTYPE, which may name other files")

    parser.StartElementHandler, parser.EndElementHandler, parser.StartDoctypeDeclHandler = start, end, doctype
    parser.Parse(data[min(at % PAGE, PAGE_DATA) :][:length], True)


def _bits(node: Any) -> int:
    """What a field of a point takes in an E57 file."""
    if hasattr(node, "precision"):
        return 64 if node.precision().name == "E57_DOUBLE" else 32
    return int(node.maximum() - node.minimum()).bit_length() if hasattr(node, "maximum") else 0


def _e57_scan(file: Any, header: Any) -> dict[str, np.ndarray]:
    """The fields of a scan's valid points: pye57's own `read_scan` returns also those that are not there."""
    cartesian = set(_E57_PLACE) <= set(header.point_fields)
    place, invalid = (_E57_PLACE, "cartesianInvalidState") if cartesian else (_E57_POLAR, "sphericalInvalidState")
    more = [name for name in ("intensity", *_E57_COLORS, invalid) if name in header.point_fields]
    data, buffers = file.make_buffers([*place, *more], header.point_count)
    check_promised(header.point_count, header.points.reader(buffers).read())
    if (wrong := data.pop(invalid, None)) is not None:
        data = {name: values[wrong == 0] for name, values in data.items()}
    xyz = np.column_stack([data[name] for name in place])
    if not cartesian:
        xyz = require("pye57").utils.convert_spherical_to_cartesian(xyz)
    if header.has_pose():
        xyz = file.to_global(xyz, header.rotation, header.translation)
    return data | dict(zip(_E57_PLACE, xyz.T, strict=True))
