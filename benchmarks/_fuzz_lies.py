"""Files that promise what they do not hold, that unfold to more than memory, or that name others that never end."""

from __future__ import annotations

import io
import os
import re
import struct
import tempfile
import zipfile
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import numpy as np
from _fuzz_files import clouds, read

import glsk_o3d as glsk
from glsk_o3d import samples
from glsk_o3d.io.scans import read_scan

Change = Callable[[int], bytes]  # a file in which a promise is this number
Promises = Iterator[tuple[str, int, Change]]  # what is promised, the number, and how to change it
PAGE, PAGE_DATA = 1024, 1020  # published: E57's pages, without and with what checks them
SIZES = (1, 2, 3, 7, 60, 400)
FAR = (10**6, -(10**6), 2**16, 2**31, 2**32, 2**62)


# ---------------------------------------------------------------------------------------------------------------- lies


def lie_case(rng: np.random.Generator, folder: Path) -> tuple[str, str, list[str], int]:
    """One promise that is wrong by one, a few, or a million, where all that checks it has been redone.

    A finding is also a point that the file does not hold.
    """
    n = int(rng.choice(SIZES))
    none = (".csv", ".txt", ".xyz", ".obj")  # which have none, or are read by Open3D
    names = [name for name in seeds(n) if name.split()[1] not in none]
    name = names[rng.integers(len(names))]
    data, places = seeds(n)[name]
    kind, ending = name.split()[:2]
    listed = list(_promises(ending, data))
    what, number, change = listed[rng.integers(len(listed))]
    step = (
        rng.choice([1, -1]) if rng.random() < 0.4 else rng.integers(-9, 10) if rng.random() < 0.4 else rng.choice(FAR)
    )
    told, findings, found = read(kind, ending, wrong := change(max(number + int(step), 0)), folder)
    if found is not None:
        got = found.vertices if kind == "skeleton" else found.positions
        if len(got) > len(places) or not {*map(tuple, got.tolist())} <= {*map(tuple, places.tolist())}:
            findings.append(f"{what} {number} {step:+d} gives points that are not there")
    return f"{kind} {ending}", told, findings, len(wrong)


@cache
def seeds(n: int) -> dict[str, tuple[bytes, np.ndarray]]:
    """Sound files of about n points, and the points that each holds."""
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        for name, data in clouds(Path(folder), n).items():
            ending = name.split()[1]
            path = Path(folder, f"read{ending}")
            path.write_bytes(data)
            found[name] = data, read_scan(path).positions
    ring = samples.torus(60)
    skeleton = glsk.Skeleton(ring.nodes, ring.edges, ring.radii, (), (), ())
    with tempfile.TemporaryDirectory() as folder:
        glsk.save_skeleton(skeleton, Path(folder, "k.npz"))
        found["skeleton .npz"] = Path(folder, "k.npz").read_bytes(), skeleton.vertices
    return found


def _promises(ending: str, data: bytes) -> Promises:
    """What a file says of how much there is."""
    if ending in (".ply", ".pcd"):
        patterns = {
            ".ply": rb"element \w+ (\d+)",
            ".pcd": rb"(?:POINTS|WIDTH|HEIGHT|COUNT(?: \d+)*) (\d+)",
        }
        for match in re.finditer(patterns[ending], data[:1000]):
            for group in range(1, len(match.groups()) + 1):
                yield _word(data, match, group)
        width = re.search(rb"WIDTH (\d+)\nHEIGHT 1\n(.*\n)?POINTS \d+", data[:1000])
        if width:  # all that says it, alike
            rest = width[2] or b""
            yield (
                "WIDTH and POINTS",
                int(width[1]),
                lambda n: data.replace(width[0], b"WIDTH %d\nHEIGHT 1\n%sPOINTS %d" % (n, rest, n)),
            )
        packed = data.find(b"binary_compressed\n")
        if packed >= 0:
            yield from (_bytes(data, packed + 18 + at, 4) for at in (0, 4))
    elif ending == ".stl":
        yield _bytes(data, 80, 4)
    elif ending in (".las", ".laz"):
        yield from _las(data, ending == ".laz")
    elif ending == ".e57":
        yield from _e57(data)
    elif ending == ".npz":
        yield from _npz(data)


def _word(data: bytes, match: re.Match[bytes], group: int) -> tuple[str, int, Change]:
    start, stop = match.span(group)
    return match[0].decode(), int(match[group]), lambda n: data[:start] + str(n).encode() + data[stop:]


def _bytes(data: bytes, at: int, length: int) -> tuple[str, int, Change]:
    number = int.from_bytes(data[at : at + length], "little")
    return (
        f"byte {at}",
        number,
        lambda n: data[:at] + (n % 256**length).to_bytes(length, "little") + data[at + length :],
    )


def _las(data: bytes, packed: bool) -> Promises:
    yield from (_bytes(data, at, length) for at, length in ((107, 4), (105, 2), (100, 4), (94, 2), (96, 4)))
    if data[25] >= 4:
        yield from (_bytes(data, at, length) for at, length in ((247, 8), (243, 4), (235, 8)))
    if packed:
        record, start = data.index(b"laszip encoded") - 2 + 54, int.from_bytes(data[96:100], "little")
        table = int.from_bytes(data[start : start + 8], "little")
        yield from (_bytes(data, record + at, length) for at, length in ((12, 4), (32, 2), (36, 2)))
        yield from (_bytes(data, at, length) for at, length in ((start, 8), (table + 4, 4)))


def _e57(data: bytes) -> Promises:
    content = b"".join(data[i : i + PAGE_DATA] for i in range(0, len(data), PAGE))
    for match in re.finditer(rb'(?:recordCount|fileOffset)="(\d+)"', content):
        what, number, change = _word(content, match, 1)
        yield what, number, lambda n, change=change: e57(change(n))
    # of the file, of the section of points, and of its first packet
    for at, length in ((16, 8), (24, 8), (32, 8), (48 + 8, 8), (48 + 16, 8), (80 + 2, 2), (80 + 4, 2), (80 + 6, 2)):
        what, number, change = _bytes(content, at, length)
        yield what, number, lambda n, change=change, told=at < 48: e57(change(n), told)


def e57(content: bytes, told: bool = False) -> bytes:
    """Content in pages with checksums; the length of the file and its XML are said as they are unless that was told."""
    start = content.find(b"<?xml")
    if not told and start >= 0:
        ends = [match.end() for match in re.finditer(rb"</e57Root>\s*", content)]
        text = content[start : ends[-1] if ends else None]
        pages = -(-len(content) // PAGE_DATA)
        head = struct.pack("<Q", pages * PAGE), struct.pack("<Q", len(text))
        content = content[:16] + head[0] + content[24:32] + head[1] + content[40:]
    content += bytes(-len(content) % PAGE_DATA)
    parts = (content[i : i + PAGE_DATA] for i in range(0, len(content), PAGE_DATA))
    return b"".join(part + _crc32c(part).to_bytes(4, "big") for part in parts)


@cache
def _table() -> list[int]:
    table = []
    for value in range(256):
        for _ in range(8):
            value = value >> 1 ^ (0x82F63B78 if value & 1 else 0)  # published: the polynomial of CRC-32C
        table.append(value)
    return table


def _crc32c(data: bytes) -> int:
    value, table = 0xFFFFFFFF, _table()
    for byte in data:
        value = table[(value ^ byte) & 255] ^ value >> 8
    return value ^ 0xFFFFFFFF


def _npz(data: bytes) -> Promises:
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        held = {name: archive.read(name) for name in archive.namelist()}

    def change(name: str, place: slice, n: int) -> bytes:
        stream, size = io.BytesIO(), len(held[name])
        changed = held[name][: place.start] + str(n).encode().ljust(place.stop - place.start) + held[name][place.stop :]
        with zipfile.ZipFile(stream, "w") as archive:
            for each, content in held.items():
                archive.writestr(each, changed[: size + 20] if each == name else content)
        return stream.getvalue()

    for name, content in held.items():
        match = re.search(rb"\((\d+),", content[:128])
        if match:
            place = slice(*match.span(1))
            yield name, int(match[1]), lambda n, where=(name, place): change(*where, n)


# --------------------------------------------------------------------------------------------------------------- bombs


def bomb_case(rng: np.random.Generator, folder: Path) -> tuple[str, str, list[str], int]:
    """A file that is small for what it asks for."""
    name = [*BOMBS][rng.integers(len(BOMBS))]
    n = int(10 ** rng.uniform(1, 6.5))
    kind, ending = name.split()[:2]
    told, findings, _ = read(kind, ending, data := BOMBS[name](n), folder)
    return name, told, findings, len(data)


def _ply_of(rows: int, row: bytes, kind: str = "binary_little_endian 1.0", name: str = "face") -> bytes:
    xyz = "".join(f"property float {axis}\n" for axis in "xyz")
    lists = f"element {name} {rows}\nproperty list uchar int vertex_indices\n"
    head = f"ply\nformat {kind}\nelement vertex 1\n{xyz}{lists}end_header\n".encode()
    return head + (b"\0" * 12 if kind[0] == "b" else b"1 2 3\n") + row * (rows // (2 if b"\1" in row[1:] else 1))


def _pcd_of(points: int, data: bytes, kept: str, fields: str = "x y z", counts: str = "1 1 1") -> bytes:
    words = [" ".join([word] * len(fields.split())) for word in "4F"]
    head = f"VERSION .7\nFIELDS {fields}\nSIZE {words[0]}\nTYPE {words[1]}\nCOUNT {counts}\nWIDTH {points}\nHEIGHT 1\n"
    return f"{head}POINTS {points}\nDATA {kept}\n".encode() + data


def _lzf(n: int) -> bytes:
    """A run of zeros, then copies of three bytes."""
    copies = b"\x20\0" * n
    size = 1 + 3 * n
    packed = b"\0\0" + copies
    missing = -size % 12
    packed += bytes([missing - 1, *[0] * missing]) if missing else b""
    size += missing
    return _pcd_of(size // 12, struct.pack("<II", len(packed), size) + packed, "binary_compressed")


def _e57_of(old: bytes, new: bytes) -> bytes:
    data = seeds(60)["cloud .e57"][0] if "cloud .e57" in seeds(60) else b"\0" * 100
    content = b"".join(data[i : i + PAGE_DATA] for i in range(0, len(data), PAGE)).rstrip(b"\0")
    return e57(content.replace(old, new))


def _scans(n: int) -> bytes:
    data = seeds(60)["cloud .e57"][0] if "cloud .e57" in seeds(60) else b"\0" * 100
    content = b"".join(data[i : i + PAGE_DATA] for i in range(0, len(data), PAGE))
    scan = re.search(rb"<vectorChild.*?</vectorChild>", content, re.DOTALL)
    return _e57_of(scan[0], scan[0] * min(n, 1000)) if scan else data


def _entities(root: str) -> bytes:
    inner = "".join(f'<!ENTITY {chr(98 + i)} "{("&" + chr(97 + i) + ";") * 10}">' for i in range(9))
    return f'<!DOCTYPE {root} [<!ENTITY a "{"x" * 100}">{inner}]>'.encode()


def _zipped(n: int) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(seeds(60)["skeleton .npz"][0])) as old, zipfile.ZipFile(stream, "w", 8) as new:
        for name in old.namelist():
            new.writestr(name, old.read(name) + bytes(30 * n))
    return stream.getvalue()


BOMBS: dict[str, Callable[[int], bytes]] = {
    "cloud .pcd count": lambda n: _pcd_of(1, b"1 2 3\n", "ascii", "x y z a", f"1 1 1 {100 * n}"),
    "cloud .pcd fields": lambda n: _pcd_of(
        10, b"1 2 3\n", "ascii", "x y z" + " a" * min(n, 9000), "1 1 1" + " 9999" * min(n, 9000)
    ),
    "cloud .pcd copies": lambda n: _lzf(4 * n),
    "cloud .pcd zeros": lambda n: _pcd_of(10**9, b"\0" * n, "binary_compressed"),
    "cloud .ply empty": lambda n: _ply_of(6 * n, b"\0"),
    "cloud .ply uneven": lambda n: _ply_of(2 * n, b"\0\1\0\0\0\0"),
    "cloud .ply text": lambda n: _ply_of(6 * n, b"0\n", "ascii 1.0"),
    "cloud .ply other": lambda n: _ply_of(6 * n, b"\0", name="other"),
    "cloud .ply other uneven": lambda n: _ply_of(2 * n, b"\0\1\0\0\0\0", name="other"),
    "cloud .ply nothing": lambda n: (
        b"ply\nformat ascii 1.0\nelement x %d\nelement vertex 1\n" % n**3
        + b"property float x\nproperty float y\nproperty float z\nend_header\n1 2 3\n"
    ),
    "cloud .e57 scans": _scans,
    "cloud .e57 constant": lambda n: _e57_of(b'recordCount="60"', b'recordCount="%d"' % n**2),
    "cloud .xyz short": lambda n: b"1 2 3\n" * n,
    "cloud .xyz uneven": lambda n: b"1 2 3\n4 5\n" * min(n, 10**6),
    "cloud .xyz wide": lambda n: b"1 " * (3 * n) + b"\n",
    "cloud .csv commas": lambda n: b"1,2,3,,,\n" * n,
    "cloud .obj polygon": lambda n: b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf" + b" 1 2 3" * min(n, 300000) + b"\n",
    "cloud .obj faces": lambda n: b"v 0 0 0\nv 1 0 0\nv 0 1 0\n" + b"f 1 2 3\n" * min(n, 400000),
    "cloud .obj groups": lambda n: b"v 0 0 0\nv 1 0 0\nv 0 1 0\n" + b"g a\nf 1 2 3\n" * min(n, 100000),
    "cloud .stl text": lambda n: (
        b"solid a\n"
        + b"facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
        * min(n, 100000)
        + b"endsolid a\n"
    ),
    "skeleton .npz zeros": _zipped,
    "skeleton .json brackets": lambda n: b"[" * n,
    "skeleton .swc rows": lambda n: b"1 0 0 0 0 0 -1\n" * n,
    "script .mlx entities": lambda n: _entities("FilterScript") + b"<FilterScript>&h;</FilterScript>",
    "script .mlx deep": lambda n: b"<FilterScript>" * n + b"</FilterScript>" * n,
}
"""What unfolds, by kind and ending, of a size."""


# --------------------------------------------------------------------------------------------------------------- named


def named_case(rng: np.random.Generator, folder: Path) -> tuple[str, str, list[str], int]:
    """A file that names another, which is a pipe, a device, a folder, a loop of links, or missing."""
    other = folder / ["pipe", "zero", "folder", "loop", "missing", "sound"][rng.integers(6)]
    makers = {
        "pipe": lambda: os.mkfifo(other),
        "zero": lambda: other.symlink_to("/dev/zero"),
        "folder": other.mkdir,
        "loop": lambda: other.symlink_to(other),
        "sound": lambda: other.write_bytes(b"map_Kd sound\n" * 9),
    }
    if not os.path.lexists(other) and other.name in makers:
        makers[other.name]()
    name = [*NAMING][rng.integers(len(NAMING))]
    kind, ending = name.split()[:2]
    at = str(rng.choice([other.name, str(other), f"./{other.name}", f"../{folder.name}/{other.name}"]))
    (folder / "given.mtl").write_text(f"newmtl a\n{rng.choice(MAPS)} {at}\n")
    told, findings, _ = read(kind, ending, data := NAMING[name](at), folder)
    return name, told, findings, len(data)


MAPS = ("map_Kd", "map_Ka", "map_Ks", "bump", "map_Bump -bm 1", "norm", "disp", "map_d", "refl -type sphere", "map_Pr")
_TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n"


NAMING: dict[str, Callable[[str], bytes]] = {
    "cloud .obj mtllib": lambda at: f"mtllib {at}\n{_TRIANGLE}".encode(),
    "cloud .obj goes on": lambda at: f"mt\\\nllib {at}\n{_TRIANGLE}".encode(),
    "cloud .obj map": lambda at: f"mtllib given.mtl\n{_TRIANGLE}".encode(),
    "script .mlx entity": lambda at: f'<!DOCTYPE FilterScript SYSTEM "{at}"><FilterScript/>'.encode(),
    "list .txt clouds": lambda at: f"{at}\n".encode(),
}
"""What names another file, by kind and ending."""
