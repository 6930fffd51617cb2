"""PCD, the files of PCL: text, binary and compressed; every field with one value, read without trust."""

from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import BinaryIO

import numpy as np

from ...interop.packages import import_open3d
from ..paths import check_promised, number_rows, text_lines
from ..scan import Scan, named_attributes

_NORMALS = ["normal_x", "normal_y", "normal_z"]
_TYPES = {kind + size for kind, sizes in (("F", "48"), ("I", "1248"), ("U", "1248")) for size in sizes}
_PLACE = (" x", " y", " z")  # after the number of the field
MOST_PACKED = 88  # derived: LZF's longest copy, of 264 bytes, takes three
_PACKED_COLORS = ("rgb", "rgba")


def blocks(path: Path, rows: int, bare: bool) -> tuple[int | None, Iterator[Scan]]:
    """Compressed data, whose columns follow each other, are read whole."""
    with path.open("rb") as stream:
        row, points, kept = read_header(stream)
        start = stream.tell()
    if kept == "binary_compressed":
        return None, map(_compressed, [path])
    if kept not in ("ascii", "binary"):
        raise ValueError(f"its data are {kept!r}, which is unknown")
    least = row.itemsize if kept == "binary" else 2 * sum(row[name].shape[0] for name in row.names or ())
    check_promised(points, (path.stat().st_size - start + (kept == "ascii")) // least)  # text may lack its last end
    return points, _blocks(path, start, row, points, kept == "binary", rows, bare)


def read_header(stream: BinaryIO) -> tuple[np.dtype, int, str]:
    """The type of a row, the number of points, and how the data are kept, which the stream gives next."""
    header: dict[str, list[str]] = {}
    while "DATA" not in header:
        line = stream.readline(1 << 16)
        if not line:
            raise ValueError("its header has no DATA")
        key, *values = line.decode("ascii", "replace").split() or ["#"]
        header[key] = values
    names, sizes, kinds = header["FIELDS"], header["SIZE"], header["TYPE"]
    counts = [int(count) for count in header.get("COUNT", ["1"] * len(names))]
    points, (kept,) = int(header["POINTS"][0]), header["DATA"]
    if points < 0 or min(counts, default=0) < 1:
        raise ValueError("its header has a negative count")
    if {"WIDTH", "HEIGHT"} <= header.keys() and int(header["WIDTH"][0]) * int(header["HEIGHT"][0]) != points:
        raise ValueError(f"its header promises {points} points, and another width and height")
    if not all(kind + size in _TYPES for kind, size in zip(kinds, sizes, strict=True)):
        raise ValueError("its header has unknown types")
    fields = zip(names, sizes, kinds, counts, strict=True)
    row = np.dtype([(f"{i} {name}", f"<{kind.lower()}{size}", (n,)) for i, (name, size, kind, n) in enumerate(fields)])
    return row, points, kept


def _blocks(path: Path, start: int, row: np.dtype, points: int, binary: bool, rows: int, bare: bool) -> Iterator[Scan]:
    with path.open("rb") as stream:
        stream.seek(start)
        lines = text_lines(stream)
        for begin in range(0, points, rows):
            n = min(rows, points - begin)
            table = np.frombuffer(stream.read(n * row.itemsize), row) if binary else _text(lines, row, n)
            if len(table) < n:
                check_promised(points, begin + len(table))
            yield _scan({name: table[name] for name in row.names or () if not bare or name[-2:] in _PLACE})


def _text(lines: Iterator[str], row: np.dtype, n: int) -> np.ndarray:
    """The next n rows, or those that are left."""
    names = row.names or ()
    ends = np.cumsum([row[name].shape[0] for name in names])
    numbers = number_rows(lines, n, ends[-1])
    table = np.empty(len(numbers), row)
    with np.errstate(invalid="ignore"):
        for name, values in zip(names, np.split(numbers, ends[:-1], axis=1), strict=True):
            table[name] = values
    return table


def _compressed(path: Path) -> Scan:
    """The points of compressed data.

    Open3D crashes on padding, on fields of one name and on a part of the normals, and mixes up types.
    """
    with path.open("rb") as stream:
        row, points, _ = read_header(stream)
        packed, size = np.frombuffer(stream.read(8).ljust(8, b"\0"), "<u4").tolist()
        check_promised(packed, path.stat().st_size - stream.tell(), "compressed bytes")
        data = stream.read(packed)
    check_promised(size, MOST_PACKED * packed, "bytes")
    if size != points * row.itemsize:
        raise ValueError(f"its {points} points have {points * row.itemsize} bytes, and those that are packed {size}")
    unpacked, columns, at = _unpacked(data, size), {}, 0
    for name in row.names or ():  # one after the other
        base, n = row[name].base, row[name].shape[0]
        columns[name] = np.frombuffer(unpacked, base, points * n, at).reshape(points, n)
        at += points * n * base.itemsize
    return _scan(columns)


def _unpacked(data: bytes, size: int) -> bytes:
    """What LZF has packed, of so many bytes. Open3D unpacks it as a cloud whose coordinates are eight bytes each."""
    o3d, missing = import_open3d(), -size % 24
    data += bytes([missing - 1, *[0] * missing] if missing else [])  # a run of so many bytes as they are
    n = (size + missing) // 24
    head = (
        f"FIELDS x y z\nSIZE 8 8 8\nTYPE U U U\nCOUNT 1 1 1\nWIDTH {n}\nHEIGHT 1\nPOINTS {n}\nDATA binary_compressed\n"
    )
    sizes = np.array([len(data), size + missing], "<u4").tobytes()
    with TemporaryDirectory() as folder, o3d.utility.VerbosityContextManager(o3d.utility.VerbosityLevel.Error):
        path = Path(folder, "bytes.pcd")
        path.write_bytes(head.encode() + sizes + data)
        cloud = o3d.t.io.read_point_cloud(str(path))
    unpacked = cloud.point.positions.numpy().T.tobytes() if "positions" in cloud.point else b""
    check_promised(size, len(unpacked), "bytes")
    return unpacked[:size]


def _scan(columns: dict[str, np.ndarray]) -> Scan:
    known = {name.partition(" ")[2]: values[:, 0] for name, values in columns.items() if values.shape[1] == 1}
    if not set("xyz") <= known.keys():
        raise ValueError("it has no fields x, y and z")
    positions = np.column_stack([known.pop(axis) for axis in "xyz"]).astype(float)
    packed = next((known.pop(name) for name in _PACKED_COLORS if name in known), None)
    normals = None
    if set(_NORMALS) <= known.keys():
        normals = np.column_stack([known.pop(name) for name in _NORMALS]).astype(float)
    known.pop("_", None)  # padding
    attributes = named_attributes((name, np.ascontiguousarray(values)) for name, values in known.items())
    return Scan(positions, None if packed is None else _colors(packed), normals, attributes)


def _colors(packed: np.ndarray) -> np.ndarray:
    """Red, green and blue from 0 to 1 of the bits of a number of four bytes."""
    bits = np.ascontiguousarray(packed, packed.dtype if packed.dtype.itemsize == 4 else np.uint32).view(np.uint32)
    return np.stack([bits >> 16 & 255, bits >> 8 & 255, bits & 255], axis=1) / 255
