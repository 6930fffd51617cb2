"""PCD as others write it: padding, fields of many values and of odd names, compressed columns."""

import tracemalloc

import numpy as np
import open3d as o3d
import pytest

from glsk_o3d.errors import FileFormatError
from glsk_o3d.io.scans import read_scan

HEAD = """VERSION 0.7
FIELDS x y z rgb _ label more
SIZE 4 4 8 4 1 2 4
TYPE F F F F U U F
COUNT 1 1 1 1 3 1 2
POINTS 2
"""
COMPRESSED = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 2\nDATA binary_compressed\n"


def packed(columns):
    """The body of compressed data: columns one after the other, as runs as they are."""
    plain = b"".join(np.ascontiguousarray(values).tobytes() for values in columns)
    runs = b"".join(bytes([len(plain[i : i + 32]) - 1]) + plain[i : i + 32] for i in range(0, len(plain), 32))
    return np.array([len(runs), len(plain)], "<u4").tobytes() + runs


@pytest.mark.parametrize("form", ["ascii", "binary", "binary_compressed"])
def test_padding_and_fields_of_many_values(tmp_path, form):
    row = np.dtype("<f4,<f4,<f8,<u4,3u1,<u2,2<f4")
    rows = np.array([(1, 2, 3, 0xFF3300, (0, 0, 0), 7, (1, 2)), (4, 5, 6, 0x0000FF, (0, 0, 0), 8, (3, 4))], row)
    red, blue = np.array([0xFF3300, 0x0000FF], "<u4").view("<f4").tolist()
    body = {
        "ascii": f"1 2 3 {red!r} 0 0 0 7 1 2\n4 5 6 {blue!r} 0 0 0 8 3 4\n".encode(),
        "binary": rows.tobytes(),
        "binary_compressed": packed(rows[name] for name in row.names),
    }
    (tmp_path / "c.pcd").write_bytes(f"{HEAD}DATA {form}\n".encode() + body[form])
    scan = read_scan(tmp_path / "c.pcd")
    np.testing.assert_array_equal(scan.positions, [[1, 2, 3], [4, 5, 6]])
    np.testing.assert_allclose(scan.colors, [[1, 0.2, 0], [0, 0, 1]])
    assert {name: values.tolist() for name, values in scan.attributes.items()} == {"label": [7, 8]}


@pytest.mark.parametrize(
    ("fields", "attributes"),
    [
        ("x y z normal_x normal_z", ["normal_x", "normal_z"]),
        ("x y z intensity intensity", ["intensity"]),
        ("x y z colors colors_2", ["colors_2", "colors_2_2"]),
    ],
)
def test_fields_of_odd_names(tmp_path, fields, attributes):
    n = len(fields.split())
    values = np.arange(2 * n, dtype="<f4").reshape(n, 2)
    head = f"FIELDS {fields}\nSIZE{' 4' * n}\nTYPE{' F' * n}\nPOINTS 2\nDATA binary_compressed\n"
    (tmp_path / "c.pcd").write_bytes(head.encode() + packed(values))
    scan = read_scan(tmp_path / "c.pcd")
    np.testing.assert_array_equal(scan.positions.T, values[:3])
    assert list(scan.attributes) == attributes
    np.testing.assert_array_equal(scan.attributes[attributes[-1]], values[-1])


def test_room_is_taken_for_no_more_than_the_file_has(tmp_path):
    (tmp_path / "c.pcd").write_bytes(COMPRESSED.encode() + np.array([2**32 - 58, 24], "<u4").tobytes() + b"few")
    tracemalloc.start()
    try:
        with pytest.raises(FileFormatError, match="promises 4294967238 compressed bytes"):
            read_scan(tmp_path / "c.pcd")
        assert tracemalloc.get_traced_memory()[1] < 1 << 24
    finally:
        tracemalloc.stop()


def test_lzf_copies_what_came_before(tmp_path):
    """Open3D packs columns that repeat themselves: short, long and overlapping copies, from near and far."""
    rng = np.random.default_rng(0)
    values = np.concatenate([np.zeros(3000), np.tile(rng.normal(size=7), 400), rng.normal(size=500)])
    for n in (len(values), 301, 9, 2):
        places = np.column_stack([values[-n:], np.roll(values, 5)[-n:], np.sort(values)[-n:]]).astype(np.float32)
        cloud = o3d.t.geometry.PointCloud(o3d.core.Tensor(places))
        o3d.t.io.write_point_cloud(str(tmp_path / "c.pcd"), cloud, compressed=True)
        np.testing.assert_array_equal(read_scan(tmp_path / "c.pcd").positions, places)


@pytest.mark.parametrize("data", [b"", b"\xe0", b"\x20\x05", b"\x05ab", b"\x01ab\xff"])
def test_lzf_that_breaks_off_is_refused(tmp_path, data):
    (tmp_path / "c.pcd").write_bytes(COMPRESSED.encode() + np.array([len(data), 24], "<u4").tobytes() + data)
    with pytest.raises(FileFormatError, match=r"c\.pcd"):
        read_scan(tmp_path / "c.pcd")
