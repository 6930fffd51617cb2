"""GLB, the binary files of glTF 2.0: their chunks, and files of others that are made safe for Open3D to read."""

import json
from base64 import b64decode, b64encode
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from ..paths import check_budget, check_promised, existing_file

MAGIC, JSON_CHUNK, BINARY_CHUNK = 0x46546C67, 0x4E4F534A, 0x004E4942  # published: glTF 2.0, 4.4
COMPONENT_BYTES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}  # published: glTF 2.0, 3.6.2.2
COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}  # published: glTF 2.0, 3.6.2.2
DEEPEST = 500  # fitted: nodes inside each other; what reads them calls itself
PART_BYTES = 12000  # measured: that Open3D takes for a part of a mesh beyond its arrays
MOST_REPEATED = 16  # fitted: times the size of a file that its meshes may take, since nodes share them
_OF_NODES = ("mesh", "matrix", "translation", "rotation", "scale")
_OF_PRIMITIVES = ("attributes", "indices", "mode", "material")


def binary(tree: dict[str, Any], data: bytes | bytearray) -> bytes:
    """A tree and its buffer as the chunks of a binary file."""
    text = json.dumps(tree, separators=(",", ":"), allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    body = bytes(data) + bytes(-len(data) % 4)
    chunks = b"".join(
        len(chunk).to_bytes(4, "little") + kind.to_bytes(4, "little") + chunk
        for kind, chunk in ((JSON_CHUNK, text), (BINARY_CHUNK, body))
    )
    return b"".join(n.to_bytes(4, "little") for n in (MAGIC, 2, 12 + len(chunks))) + chunks


def embedded(tree: dict[str, Any], data: bytes | bytearray) -> bytes:
    """The same as text: the buffer is in it as a data URI."""
    uri = "data:application/octet-stream;base64," + b64encode(data).decode()
    buffers = [{"byteLength": len(data), "uri": uri}]
    return json.dumps({**tree, "buffers": buffers}, separators=(",", ":"), allow_nan=False).encode()


def alone(path: Path) -> bytes:
    """The meshes of a glTF or GLB file, and the nodes that place them, as a binary file that names no other.

    ValueError where it promises more than it holds, or nodes and meshes repeat or are nested beyond all use.
    """
    content = path.read_bytes()
    text, chunk = _chunks(content)
    tree = json.loads(text)
    if not str(tree["asset"]["version"]).startswith("2."):
        raise ValueError("it is not glTF 2.0")
    size, data, views = len(content), bytearray(), []
    starts = []
    for buffer in tree.get("buffers", []):
        held, more = _buffer(buffer, chunk, path)
        size += more
        check_budget(len(data) + len(held), size, MOST_REPEATED)
        starts.append((len(data), len(held)))
        data += held + bytes(-len(held) % 4)
    for view in tree.get("bufferViews", []):
        start, length = starts[view["buffer"]]
        check_promised(_whole(view, "byteOffset", 0) + _whole(view, "byteLength"), length, "bytes of a buffer")
        views.append({**view, "buffer": 0, "byteOffset": start + view.get("byteOffset", 0)})
    meshes = [
        [{key: each[key] for key in _OF_PRIMITIVES if key in each} for each in mesh["primitives"]]
        for mesh in tree["meshes"]
    ]
    taken = [sum(_taken(each, tree["accessors"], views) for each in mesh) for mesh in meshes]
    roots, nodes = _placed(tree)
    check_budget(sum(taken[node["mesh"]] for node in nodes if "mesh" in node), size, MOST_REPEATED)
    kept = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": roots}],
        "nodes": nodes,
        "meshes": [{"primitives": mesh} for mesh in meshes],
        "accessors": tree["accessors"],
        "bufferViews": views,
        "buffers": [{"byteLength": len(data)}],
        "materials": [{} for _ in tree.get("materials", [])],  # meshes of one are joined
    }
    return binary({key: value for key, value in kept.items() if value != []}, data)


def _chunks(content: bytes) -> tuple[bytes, bytes]:
    """The text of a file and its own buffer, empty if it has none."""
    if content[:4] != MAGIC.to_bytes(4, "little"):
        return content, b""
    check_promised(int.from_bytes(content[8:12], "little"), len(content), "bytes")
    found, at = {}, 12
    while at + 8 <= len(content):
        length, kind = (int.from_bytes(content[at + i : at + i + 4], "little") for i in (0, 4))
        check_promised(length, len(content) - at - 8, "bytes")
        found.setdefault(kind, content[at + 8 : at + 8 + length])
        at += 8 + length
    return found[JSON_CHUNK], found.get(BINARY_CHUNK, b"")


def _buffer(buffer: dict[str, Any], chunk: bytes, path: Path) -> tuple[bytes, int]:
    """What a buffer holds, and how much of it is in another file."""
    length, uri = _whole(buffer, "byteLength"), buffer.get("uri")
    if uri is None or uri.startswith("data:"):
        held = chunk if uri is None else b64decode(uri.partition(",")[2])
        check_promised(length, len(held), "bytes of a buffer")
        return held[:length], 0
    other = existing_file(path.parent / unquote(uri))
    check_promised(length, other.stat().st_size, f"bytes of {other.name}")
    with other.open("rb") as stream:
        return stream.read(length), length


def _taken(primitive: dict[str, Any], accessors: list[dict[str, Any]], views: list[dict[str, Any]]) -> int:
    """The bytes of a primitive's arrays, each of which must be there and have as many rows as the others."""
    total, rows = PART_BYTES, set()
    for name in (*primitive["attributes"], "indices"):
        number = primitive.get("indices") if name == "indices" else primitive["attributes"][name]
        if number is None:
            continue
        accessor = accessors[number]
        if "bufferView" not in accessor or "sparse" in accessor:
            raise ValueError(f"its {name} are sparse, or packed by an extension, which is not read")
        view, count = views[accessor["bufferView"]], _whole(accessor, "count")
        item = COMPONENT_BYTES[accessor["componentType"]] * COMPONENTS[accessor["type"]]
        stride = max(_whole(view, "byteStride", item), item)
        room = view["byteLength"] - _whole(accessor, "byteOffset", 0)
        check_promised(count, (room - item) // stride + 1, f"rows of {name}")
        total += count * item
        rows |= {count} if name != "indices" else set()
    if len(rows) > 1:
        raise ValueError(f"its vertices are {' or '.join(map(str, sorted(rows)))}")
    return total


def _placed(tree: dict[str, Any]) -> tuple[list[int], list[dict[str, Any]]]:
    """The roots of the scene, and all nodes; those without a mesh in or below them are empty and named by none."""
    nodes, order = tree["nodes"], []
    left, seen = list(tree["scenes"][tree.get("scene", 0)]["nodes"]), set()
    while left:
        node = left.pop()
        if node in seen:
            raise ValueError(f"its node {node} stands in two places")
        seen.add(node)
        order.append(node)
        left += nodes[node].get("children", [])
    kept, depth = [dict[str, Any]() for _ in nodes], [0] * len(nodes)
    for node in reversed(order):
        children = [child for child in nodes[node].get("children", []) if depth[child]]
        if "mesh" in nodes[node] or children:
            depth[node] = 1 + max((depth[child] for child in children), default=0)
            kept[node] = {key: nodes[node][key] for key in _OF_NODES if key in nodes[node]}
            kept[node] |= {"children": children} if children else {}
    if max(depth, default=0) > DEEPEST:
        raise ValueError(f"its nodes are nested {max(depth)} deep, and at most {DEEPEST} are read")
    return [node for node in tree["scenes"][tree.get("scene", 0)]["nodes"] if depth[node]], kept


def _whole(facts: dict[str, Any], key: str, default: int | None = None) -> int:
    """A number of things or bytes."""
    value = facts.get(key, default)
    if not isinstance(value, int) or value < 0:
        raise ValueError(f"its {key} is {value!r}")
    return value
