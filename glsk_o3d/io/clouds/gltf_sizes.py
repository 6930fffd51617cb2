"""glTF: whether what a file says of its arrays is in it; Open3D takes it at its word, and reads past the end."""

from __future__ import annotations

import base64
import json
import struct
from pathlib import Path
from typing import Any

# published: glTF 2.0, 3.6.2: bytes of the components of accessors, and how many an element has
COMPONENT_BYTES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
GLB_HEAD, GLB_CHUNK_HEAD = 12, 8  # published: glTF 2.0, 4.4


def check_sizes(path: Path) -> None:
    """Raise ValueError where an accessor of a glTF or GLB file reaches past its view, or a view past its buffer."""
    data = path.read_bytes()
    content = None
    if data[:4] == b"glTF":
        data, content = _chunks(data)
    tree = json.loads(data)
    held = [_held(buffer, content if i == 0 else None, path) for i, buffer in enumerate(tree.get("buffers", []))]
    views = tree.get("bufferViews", [])
    for i, view in enumerate(views):
        if not 0 <= _whole(view, "byteOffset", 0) <= held[_whole(view, "buffer")] - _whole(view, "byteLength"):
            raise ValueError(f"its view {i} reaches past the end of a buffer")
    for i, accessor in enumerate(tree.get("accessors", [])):
        if "bufferView" not in accessor:
            continue
        view = views[_whole(accessor, "bufferView")]
        element = COMPONENT_BYTES[accessor["componentType"]] * COMPONENTS[accessor["type"]]
        stride = max(_whole(view, "byteStride", 0), element)
        needed = _whole(accessor, "byteOffset", 0) + stride * (_whole(accessor, "count") - 1) + element
        if needed > _whole(view, "byteLength"):
            raise ValueError(f"its accessor {i} reaches past the end of its view")


def _chunks(data: bytes) -> tuple[bytes, bytes]:
    """The JSON of a GLB file, and what follows it."""
    (length,) = struct.unpack_from("<I", data, GLB_HEAD)
    start = GLB_HEAD + GLB_CHUNK_HEAD
    rest = data[start + length :]
    return data[start : start + length], rest[GLB_CHUNK_HEAD:]


def _held(buffer: dict[str, Any], content: bytes | None, path: Path) -> int:
    """Bytes of a buffer that are there, but no more than it says."""
    uri = buffer.get("uri")
    if uri is None:
        there = len(content or b"")
    elif uri.startswith("data:"):
        there = len(base64.b64decode(uri.partition(",")[2]))
    else:
        there = (path.parent / uri).stat().st_size
    if there < _whole(buffer, "byteLength"):
        raise ValueError(f"a buffer should have {buffer['byteLength']} bytes and has {there}")
    return int(buffer["byteLength"])


def _whole(table: dict[str, Any], name: str, otherwise: int | None = None) -> int:
    value = table.get(name, otherwise)
    if type(value) is not int or value < 0:
        raise ValueError(f"its {name} is {value!r}, not a whole number")
    return value
