"""glTF files that promise more than they hold."""

import base64
import json
import struct

import numpy as np
import pytest

from glsk_o3d.errors import FileFormatError
from glsk_o3d.io.scans import read_scan

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], "<f4")
FACES = np.array([[0, 2, 1], [0, 1, 3]], "<u2")


@pytest.fixture
def tree():
    """A mesh of two triangles."""
    content = FACES.tobytes() + CORNERS.tobytes()
    return {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 1}, "indices": 0}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5123, "count": 6, "type": "SCALAR"},
            {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0] * 3, "max": [1] * 3},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 12},
            {"buffer": 0, "byteOffset": 12, "byteLength": 48, "byteStride": 12},
        ],
        "buffers": [{"byteLength": 60, "uri": "data:;base64," + base64.b64encode(content).decode()}],
    }


def glb(tree):
    content = base64.b64decode(tree["buffers"][0].pop("uri").partition(",")[2])
    words = json.dumps(tree).encode()
    words += b" " * (-len(words) % 4)
    chunks = struct.pack("<I4s", len(words), b"JSON") + words + struct.pack("<I4s", len(content), b"BIN\0") + content
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


@pytest.mark.parametrize("ending", [".gltf", ".glb"])
def test_sound_files_are_read(tmp_path, tree, ending):
    path = tmp_path / f"m{ending}"
    path.write_bytes(json.dumps(tree).encode() if ending == ".gltf" else glb(tree))
    assert {*map(tuple, read_scan(path).positions.tolist())} == {*map(tuple, CORNERS.tolist())}


@pytest.mark.parametrize("ending", [".gltf", ".glb"])
@pytest.mark.parametrize(
    ("place", "number"),
    [
        (("accessors", 0, "count"), 7),
        (("accessors", 1, "count"), 10**9),
        (("accessors", 1, "byteOffset"), 4),
        (("bufferViews", 1, "byteLength"), 49),
        (("bufferViews", 1, "byteOffset"), 13),
        (("bufferViews", 0, "byteOffset"), -1),
        (("buffers", 0, "byteLength"), 10**12),
    ],
)
def test_what_reaches_past_the_end_is_refused(tmp_path, tree, place, number, ending):
    table, row, name = place
    tree[table][row][name] = number
    path = tmp_path / f"m{ending}"
    path.write_bytes(json.dumps(tree).encode() if ending == ".gltf" else glb(tree))
    with pytest.raises(FileFormatError, match=rf"not a valid {ending} file: (its|a buffer)"):
        read_scan(path)
