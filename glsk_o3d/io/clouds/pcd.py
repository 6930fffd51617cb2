"""PCD, the files of PCL: text, binary and compressed; every field with one value, read without trust."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path
from typing import BinaryIO

import numpy as np

from ..paths import breaks_off
from .scanned import Scan, named_attributes

_PCD_NORMALS = ["normal_x", "normal_y", "normal_z"]
_PCD_TYPES = {kind + size for kind, sizes in (("F", "48"), ("I", "1248"), ("U", "1248")) for size in sizes}
_PLACE = (" x", " y", " z")  # after the number of the field
_PACKED_COLORS = ("rgb", "rgba")


def read(path: Path) -> Scan:
    """The points of a compressed PCD file, which `blocks` does not read; ValueError where it is damaged.

    Unpacked here: Open3D crashes on padding, on fields of one name and on a part of the normals, and mixes up types.
    """
    row, points, kept, start = _header(path)
    if kept != "binary_compressed":
        raise ValueError(f"its data are {kept!r}, which is not understood")
    with path.open("rb") as stream:
        stream.seek(start)
        packed, size = np.frombuffer(stream.read(8).ljust(8, b"\0"), "<u4").tolist()
        data = stream.read(packed)
    if len(data) < packed or size < points * row.itemsize:
        raise ValueError("its compressed data break off")
    unpacked, columns, at = _unpacked(data, size), {}, 0
    for name in row.names or ():  # one after the other
        base, n = row[name].base, row[name].shape[0]
        columns[name] = np.frombuffer(unpacked, base, points * n, at).reshape(points, n)
        at += points * n * base.itemsize
    return _scan(columns)


def _unpacked(data: bytes, size: int) -> bytes:
    """What LZF has packed, of so many bytes: runs as they are, and copies of what came before (liblzf's format)."""
    out, at = bytearray(), 0
    while at < len(data) and len(out) < size:
        control = data[at]
        at += 1
        if control < 32:
            out += data[at : at + control + 1]
            at += control + 1
            continue
        length = control >> 5
        if length == 7:
            length += data[at]
            at += 1
        start = len(out) - ((control & 31) << 8) - data[at] - 1
        at, length = at + 1, length + 2
        if start < 0:
            raise ValueError("its compressed data make no sense")
        piece = out[start : start + length]
        out += (piece * (length // len(piece) + 1))[:length]  # it may overlap what it makes
    if len(out) != size:
        raise ValueError("its compressed data break off")
    return bytes(out)


def blocks(path: Path, rows: int, bare: bool = False) -> Iterator[Scan] | None:
    """The points of a PCD file, so many at a time, or positions alone if `bare`; None for compressed data, whose
    columns follow each other. ValueError where it is damaged or breaks off.
    """
    row, points, kept, start = _header(path)
    if kept not in _ROW_READERS:
        return None
    found = _blocks(path, start, row, points, _ROW_READERS[kept], rows)
    return (_scan({name: columns[name] for name in columns if not bare or name[-2:] in _PLACE}) for columns in found)


def promised(path: Path) -> int | None:
    """The points that the header promises; None where they have to be read whole. ValueError where it breaks off."""
    _, points, kept, _ = _header(path)
    return points if kept in _ROW_READERS else None


def _header(path: Path) -> tuple[np.dtype, int, str, int]:
    """The type of a row, the number of points, how the data are kept and where they begin.

    ValueError where it makes no sense, or where binary data break off.
    """
    header: dict[str, list[str]] = {}
    with path.open("rb") as stream:
        while "DATA" not in header:
            line = stream.readline(1 << 16)
            if not line:
                raise ValueError("its header has no DATA")
            key, *values = line.decode("ascii", "replace").split() or ["#"]
            header[key] = values
        start = stream.tell()
    names, sizes, kinds = header["FIELDS"], header["SIZE"], header["TYPE"]
    counts = [int(count) for count in header.get("COUNT", ["1"] * len(names))]
    points, (data,) = int(header["POINTS"][0]), header["DATA"]
    if points < 0 or min(counts, default=0) < 1:
        raise ValueError("its header counts less than nothing")
    if not all(kind + size in _PCD_TYPES for kind, size in zip(kinds, sizes, strict=True)):
        raise ValueError("its header has types that are not understood")
    fields = zip(names, sizes, kinds, counts, strict=True)
    row = np.dtype([(f"{i} {name}", f"<{kind.lower()}{size}", (n,)) for i, (name, size, kind, n) in enumerate(fields)])
    there = (path.stat().st_size - start) // row.itemsize
    if data == "binary" and there < points:
        raise breaks_off(points, there)
    return row, points, data, start


def _blocks(
    path: Path, start: int, row: np.dtype, points: int, read_rows: _RowReader, rows: int
) -> Iterator[dict[str, np.ndarray]]:
    with path.open("rb") as stream:
        stream.seek(start)
        for begin in range(0, points, rows):
            n = min(rows, points - begin)
            columns, found = read_rows(stream, row, n)
            if found < n:
                raise breaks_off(points, begin + found)
            yield columns


def _scan(columns: dict[str, np.ndarray]) -> Scan:
    known = {name.partition(" ")[2]: values[:, 0] for name, values in columns.items() if values.shape[1] == 1}
    if not set("xyz") <= known.keys():
        raise ValueError("it has no fields x, y and z")
    positions = np.column_stack([known.pop(axis) for axis in "xyz"]).astype(float)
    packed = next((known.pop(name) for name in _PACKED_COLORS if name in known), None)
    normals = None
    if set(_PCD_NORMALS) <= known.keys():
        normals = np.column_stack([known.pop(name) for name in _PCD_NORMALS]).astype(float)
    known.pop("_", None)  # padding
    attributes = named_attributes((name, np.ascontiguousarray(values)) for name, values in known.items())
    return Scan(positions, None if packed is None else _colors(packed), normals, attributes)


def _colors(packed: np.ndarray) -> np.ndarray:
    """Red, green and blue from 0 to 1 of the bits of a number of four bytes."""
    bits = np.ascontiguousarray(packed, packed.dtype if packed.dtype.itemsize == 4 else np.uint32).view(np.uint32)
    return np.stack([bits >> 16 & 255, bits >> 8 & 255, bits & 255], axis=1) / 255


def _text(stream: BinaryIO, row: np.dtype, n: int) -> tuple[dict[str, np.ndarray], int]:
    """The next n rows, or those that are left, and how many they are."""
    lines = [line.decode("ascii", "replace") for line in islice((line for line in stream if line.strip()), n)]
    widths = [row[name].shape[0] for name in row.names or ()]
    shape = len(lines), sum(widths)
    table = np.loadtxt(lines, ndmin=2, comments=None, usecols=range(shape[1])) if lines else np.empty(shape)
    parts = np.split(table, np.cumsum(widths)[:-1], axis=1)
    with np.errstate(invalid="ignore"):
        columns = {name: part.astype(row[name].base) for name, part in zip(row.names or (), parts, strict=True)}
    return columns, len(lines)


def _binary(stream: BinaryIO, row: np.dtype, n: int) -> tuple[dict[str, np.ndarray], int]:
    data = stream.read(n * row.itemsize)
    table = np.frombuffer(data, row, len(data) // row.itemsize)
    return {name: table[name] for name in row.names or ()}, len(table)


_RowReader = Callable[[BinaryIO, np.dtype, int], tuple[dict[str, np.ndarray], int]]
_ROW_READERS: dict[str, _RowReader] = {"ascii": _text, "binary": _binary}
