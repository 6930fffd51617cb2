"""PLY files whatever their tables: those that are right are read, those that are not are refused."""

import io
import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glsk_o3d.errors import FileFormatError
from glsk_o3d.io.formats.ply_tables import Lists, read_tables
from glsk_o3d.io.scans import read_scan

CODES = {"uchar": "B", "int": "i", "float": "f", "double": "d", "ushort": "H"}
FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


def ply(format, *elements):
    """A file of elements: their names, columns ("type name", "list count type name"), and rows of values and lists."""
    head, body = [f"ply\nformat {format} 1.0\ncomment {'x' * 2000}\n"], b""
    for name, columns, rows in elements:
        head += [f"element {name} {len(rows)}\n", *(f"property {column}\n" for column in columns)]
        for row in rows:
            words = []
            for column, value in zip(columns, row, strict=True):
                *_, count, kind, _ = ["", "", *column.split()]
                if column.startswith("list"):
                    words += [(count, len(value)), *((kind, each) for each in value)]
                else:
                    words.append((kind, value))
            if format == "ascii":
                body += (" ".join(repr(value) for _, value in words) + "\n").encode()
            else:
                body += b"".join(struct.pack(FORMATS[format] + CODES[kind], value) for kind, value in words)
    return "".join([*head, "end_header\n"]).encode() + body


XYZ = ["double x", "double y", "double z"]
FACE = ["list uchar int vertex_indices"]
SQUARE = [(0.0, 0.0, 0.5), (1.0, 0.0, 0.5), (1.0, 1.0, 0.5), (0.0, 1.0, 0.5)]


@pytest.fixture
def scan(tmp_path):
    def read(data):
        (tmp_path / "m.ply").write_bytes(data)
        return read_scan(tmp_path / "m.ply")

    return read


@pytest.mark.parametrize("format", FORMATS)
@pytest.mark.parametrize(
    ("faces", "triangles"),
    [
        ([(0, 1, 2), (0, 2, 3)], [[0, 1, 2], [0, 2, 3]]),
        ([(0, 1, 2, 3)], [[0, 1, 2], [0, 2, 3]]),
        ([(0, 1, 2, 3), (3, 1, 0)], [[0, 1, 2], [0, 2, 3], [3, 1, 0]]),
        ([(), (1, 2, 3), (1, 2)], [[1, 2, 3]]),
        ([(0, 1, 9), (0, 1, 2), (0, -1, 2)], [[0, 1, 2]]),
        ([(0, 1, 2, 7)], [[0, 1, 2]]),
        ([], []),
    ],
    ids=str,
)
def test_faces_become_triangles(scan, format, faces, triangles):
    mesh = scan(ply(format, ("vertex", XYZ, SQUARE), ("face", FACE, [(face,) for face in faces])))
    np.testing.assert_array_equal(mesh.positions, SQUARE)
    np.testing.assert_array_equal(mesh.triangles, np.reshape(triangles, (-1, 3)))


ROWS = st.lists(st.tuples(st.lists(st.integers(0, 9), max_size=4), st.integers(-9, 9)), min_size=1, max_size=6)


@settings(max_examples=80, deadline=None)
@given(rows=ROWS, format=st.sampled_from(list(FORMATS)))
def test_lists_of_all_lengths_wherever_they_stand(rows, format):
    elements = ("odd", ["list uchar ushort some", "int more"], rows), ("vertex", XYZ, SQUARE)
    tables = read_tables(io.BytesIO(ply(format, *elements)), ("vertex", "odd"))
    some = tables["odd"]["some"]
    assert isinstance(some, Lists)
    np.testing.assert_array_equal(some.counts, [len(values) for values, _ in rows])
    np.testing.assert_array_equal(some.values, [value for values, _ in rows for value in values])
    np.testing.assert_array_equal(tables["odd"]["more"], [more for _, more in rows])
    np.testing.assert_array_equal(np.column_stack([tables["vertex"][axis] for axis in "xyz"]), SQUARE)


@pytest.mark.parametrize("lists", [[(), (), (), ()], [(1, 2), (3, 4), (5, 6), (7, 8)], [(1,), (), (2, 3), (4, 5, 6)]])
@pytest.mark.parametrize("format", FORMATS)
def test_a_file_that_ends_anywhere_before_its_vertices_do_is_refused(scan, format, lists):
    for elements in (
        [("odd", ["list uchar ushort some", "int more"], [(each, 7) for each in lists]), ("vertex", XYZ, SQUARE)],
        [("vertex", [*XYZ, "list uchar int near"], [(*at, each) for at, each in zip(SQUARE, lists, strict=True)])],
        [("vertex", XYZ, SQUARE)],
    ):
        whole = ply(format, *elements).rstrip(b"\n")
        head, last = whole.index(b"end_header\n"), whole.rindex(b"\n") if format == "ascii" else len(whole) - 1
        for cut in (*range(0, head, 97), *range(head, last, 1 if format == "ascii" else 5), last):
            with pytest.raises(FileFormatError, match=r"m\.ply"):
                scan(whole[:cut])


def test_a_truncated_mesh_of_faces_is_refused(scan):
    faces = [((0, 1, 2),), ((0, 1, 2, 3),), ((1, 2, 3),)]
    for format in FORMATS:
        whole = ply(format, ("vertex", XYZ, SQUARE), ("face", FACE, faces))
        with pytest.raises(FileFormatError, match="it promises 3 rows of 'face' and holds 2: it breaks off"):
            scan(whole[:-8])


def test_properties_of_all_kinds(scan):
    columns = [
        *XYZ,
        "uchar red",
        "uchar green",
        "uchar blue",
        "float nx",
        "float ny",
        "float nz",
        "int class",
        "uchar alpha",
    ]
    rows = [(*place, 255, 0, 51, 0.0, 0.6, 0.8, i, 7) for i, place in enumerate(SQUARE)]
    for format in FORMATS:
        found = scan(ply(format, ("vertex", columns, rows)))
        np.testing.assert_allclose(found.colors, [[1, 0, 0.2]] * 4)
        np.testing.assert_allclose(found.normals, [[0, 0.6, 0.8]] * 4, rtol=1e-6)
        assert {key: values.tolist() for key, values in found.attributes.items()} == {
            "class_": [0, 1, 2, 3],
            "alpha": [7] * 4,
        }
        assert all(values.dtype.isnative for values in found.attributes.values())


@pytest.mark.parametrize(
    ("header", "says"),
    [
        ("element vertex 2\nproperty float x\nproperty float x\nproperty float y\n", "two properties of one name"),
        ("element vertex 2\nproperty float x\nproperty float y\n", "no x, y and z"),
        ("element vertex 2\nproperty list float int x\n", "has the line"),
        ("element vertex 2\n", "m.ply"),
        ("element face 1\nproperty list uchar int vertex_indices\n", "no element 'vertex'"),
        ("comment \n" * 9999, "does not end"),
        ("comment " + "x" * 100_000 + "\n", "has the line"),
    ],
)
def test_headers_that_make_no_sense(scan, header, says):
    with pytest.raises(FileFormatError, match=says):
        scan(f"ply\nformat binary_little_endian 1.0\n{header}end_header\n".encode() + b"\1" * 64)
