"""PCD, the files of PCL: text, binary and compressed; every field with one value, read without trust."""

from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import BinaryIO

import numpy as np

from ..paths import binary_rows, check_promised, numbers, text_lines
from ..scan import Scan, scan_of

_NORMALS = {f"normal_{axis}": f"n{axis}" for axis in "xyz"}
_TYPES = {kind + size for kind, sizes in (("F", "48"), ("I", "1248"), ("U", "1248")) for size in sizes}
_PLACE = (" x", " y", " z")  # after the number of the field
_PACKED_COLORS, _SHIFTS = ("rgb", "rgba"), {"red": 16, "green": 8, "blue": 0}


def blocks(path: Path, rows: int, bare: bool) -> tuple[int | None, Iterator[Scan]]:
    """Compressed data, whose columns follow each other, are read whole."""
    with path.open("rb") as stream:
        row, points, form = read_header(stream)
        start = stream.tell()
    if form == "binary_compressed":
        return None, map(_compressed, [path])
    if form not in ("ascii", "binary"):
        raise ValueError(f"its data are {form!r}, which is unknown")
    least = row.itemsize if form == "binary" else 2 * sum(row[name].shape[0] for name in row.names or ())
    check_promised(points, (path.stat().st_size - start + (form == "ascii")) // least)  # text may lack its last end
    return points, _blocks(path, start, row, points, form == "binary", rows, bare)


def read_header(stream: BinaryIO) -> tuple[np.dtype, int, str]:
    """The type of a row, the number of points, and the form of the data, which the stream gives next."""
    header: dict[str, list[str]] = {}
    while "DATA" not in header:
        line = stream.readline(1 << 16)
        if not line:
            raise ValueError("its header has no DATA")
        key, *values = line.decode("ascii", "replace").split() or ["#"]
        header[key] = values
    names, sizes, kinds = header["FIELDS"], header["SIZE"], header["TYPE"]
    counts = [int(count) for count in header.get("COUNT", ["1"] * len(names))]
    points, (form,) = int(header["POINTS"][0]), header["DATA"]
    if points < 0 or min(counts, default=0) < 1:
        raise ValueError("its header has a negative count")
    if not all(kind + size in _TYPES for kind, size in zip(kinds, sizes, strict=True)):
        raise ValueError("its header has unknown types")
    fields = zip(names, sizes, kinds, counts, strict=True)
    row = np.dtype([(f"{i} {name}", f"<{kind.lower()}{size}", (n,)) for i, (name, size, kind, n) in enumerate(fields)])
    return row, points, form


def _blocks(path: Path, start: int, row: np.dtype, points: int, binary: bool, rows: int, bare: bool) -> Iterator[Scan]:
    for table in (binary_rows if binary else _text_rows)(path, start, row, points, rows):
        yield _scan({name: table[name] for name in row.names or () if not bare or name[-2:] in _PLACE})


@np.errstate(invalid="ignore")
def _text_rows(path: Path, start: int, row: np.dtype, points: int, rows: int) -> Iterator[np.ndarray]:
    """The rows of text, as `binary_rows` gives those of binary data."""
    names = row.names or ()
    ends = np.cumsum([row[name].shape[0] for name in names])
    with path.open("rb") as stream:
        stream.seek(start)
        lines = text_lines(stream)
        for begin in range(0, points, rows):
            n = min(rows, points - begin)
            values = numbers(islice(lines, n)).reshape(-1, ends[-1])
            if len(values) < n:
                check_promised(points, begin + len(values))
            table = np.empty(len(values), row)
            for name, columns in zip(names, np.split(values, ends[:-1], axis=1), strict=True):
                table[name] = columns
            yield table


def _compressed(path: Path) -> Scan:
    """The points of compressed data: Open3D crashes on padding and fields of one name, and mixes up types."""
    with path.open("rb") as stream:
        row, points, _ = read_header(stream)
        packed, size = np.frombuffer(stream.read(8).ljust(8, b"\0"), "<u4").tolist()
        # before they are read: room for all that is promised is taken at once
        check_promised(packed, path.stat().st_size - stream.tell(), "compressed bytes")
        data = stream.read(packed)
    check_promised(points * row.itemsize, size, "bytes")
    unpacked, columns, start = _unpacked(data, size), {}, 0
    for name in row.names or ():  # one after the other
        base, n = row[name].base, row[name].shape[0]
        columns[name] = np.frombuffer(unpacked, base, points * n, start).reshape(points, n)
        start += points * n * base.itemsize
    return _scan(columns)


def _unpacked(data: bytes, size: int) -> bytes:
    """What LZF has packed, of so many bytes: runs of bytes as they are, and copies of what came before."""
    unpacked, position = bytearray(), 0
    while position < len(data) and len(unpacked) < size:
        control, position = data[position], position + 1
        if control < 32:  # a run
            unpacked += data[position : position + control + 1]
            position += control + 1
            continue
        length, distance = (control >> 5) + 2, (control & 31) << 8
        if length == 9:
            length, position = length + data[position], position + 1
        start, position = len(unpacked) - distance - data[position] - 1, position + 1
        if start < 0:
            raise ValueError("its compressed data are damaged")
        copied = unpacked[start : start + length]
        unpacked += (copied * (length // len(copied) + 1))[:length]  # it may overlap its copy
    check_promised(size, len(unpacked), "bytes")
    return bytes(unpacked)


def _scan(fields: dict[str, np.ndarray]) -> Scan:
    columns = {name.partition(" ")[2]: values[:, 0] for name, values in fields.items() if values.shape[1] == 1}
    columns.pop("_", None)  # padding
    if _NORMALS.keys() <= columns.keys():
        columns |= {name: columns.pop(of_pcl) for of_pcl, name in _NORMALS.items()}
    packed = next((columns.pop(name) for name in _PACKED_COLORS if name in columns), None)
    if packed is not None:  # in the bits of a number of four bytes
        bits = np.ascontiguousarray(packed, packed.dtype if packed.dtype.itemsize == 4 else np.uint32).view(np.uint32)
        columns |= {name: (bits >> shift & 255).astype(np.uint8) for name, shift in _SHIFTS.items()}
    return scan_of(columns, 255)
