"""PLY: skeletons in other programs, and tables of all kinds: those that are right are read, others are refused."""

import struct
from dataclasses import replace

import numpy as np
import pytest

from glsk_o3d import save_skeleton
from glsk_o3d.errors import FileFormatError
from glsk_o3d.io.scans import read_scan
from glsk_o3d.io.skeletons import read_skeleton

CODES = {"uchar": "B", "int": "i", "float": "f", "double": "d", "ushort": "H"}
FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
XYZ = ["double x", "double y", "double z"]
FACE = ["list uchar int vertex_indices"]
SQUARE = [(0.0, 0.0, 0.5), (1.0, 0.0, 0.5), (1.0, 1.0, 0.5), (0.0, 1.0, 0.5)]
all_formats = pytest.mark.parametrize("format", FORMATS)


def ply(format, *elements):
    """A file of elements: their names, columns ("type name", "list count type name"), and rows of values and lists."""
    head, body = [f"ply\r\nformat {format} 1.0\r\ncomment {'x' * 2000}\n"], b""
    for name, columns, rows in elements:
        head += [f"element {name} {len(rows)}\n", *(f"property {column}\n" for column in columns)]
        for row in rows:
            words = []
            for column, value in zip(columns, row, strict=True):
                *_, count, kind, _ = ["", "", *column.split()]
                if column.startswith("list"):
                    words += [(count, len(value)), *((kind, item) for item in value)]
                else:
                    words.append((kind, value))
            if format == "ascii":
                body += (" ".join(repr(value) for _, value in words) + "\n").encode()
            else:
                body += b"".join(struct.pack(FORMATS[format] + CODES[kind], value) for kind, value in words)
    return "".join([*head, "end_header\n"]).encode() + body


@pytest.fixture
def scan(tmp_path):
    def read(data):
        (tmp_path / "m.ply").write_bytes(data)
        return read_scan(tmp_path / "m.ply")

    return read


# ----------------------------------------------------------------------------------------------------------- skeletons


def test_ply_in_open3d_and_written_by_it(skeleton, tmp_path):
    import open3d as o3d

    if not len(skeleton.edges):
        pytest.skip("Open3D reads no line set without lines")
    path = str(tmp_path / "s.ply")
    save_skeleton(skeleton, path)
    lines = o3d.io.read_line_set(path)
    np.testing.assert_array_equal(np.asarray(lines.points), skeleton.vertices)
    np.testing.assert_array_equal(np.asarray(lines.lines), skeleton.edges)
    cloud = o3d.t.io.read_point_cloud(path)
    np.testing.assert_array_equal(cloud.point["radius"].numpy().ravel(), skeleton.radii)
    for text in (True, False):
        o3d.io.write_line_set(path, skeleton.to_line_set(), write_ascii=text)
        back = read_skeleton(path)
        np.testing.assert_allclose(back.vertices, skeleton.vertices, rtol=1e-5 if text else 0)
        np.testing.assert_array_equal(back.edges, skeleton.edges)
        assert np.isnan(back.radii).all()


def test_the_half_axes_come_back(tree, tmp_path):
    flat = replace(tree, half_width=2 * tree.radii, half_thickness=tree.radii / 2)
    save_skeleton(flat, tmp_path / "s.ply")
    back = read_skeleton(tmp_path / "s.ply")
    for name in ("radii", "half_width", "half_thickness"):
        np.testing.assert_array_equal(getattr(back, name), getattr(flat, name))
    (tmp_path / "s.ply").write_bytes((tmp_path / "s.ply").read_bytes().replace(b" half_", b" some_"))
    np.testing.assert_array_equal(read_skeleton(tmp_path / "s.ply").half_width, tree.radii)


@all_formats
def test_lines_of_others_in_all_byte_orders(tmp_path, format):
    vertices = "vertex", [*XYZ, "float radius"], [(0.0, 0.5, 1.0, 2.0), (3.0, 4.0, 5.0, 6.0)]
    edges = "edge", ["ushort vertex1", "int vertex2"], [(1, 0)]
    (tmp_path / "s.ply").write_bytes(ply(format, vertices, ("face", FACE, []), edges))
    back = read_skeleton(tmp_path / "s.ply")
    np.testing.assert_array_equal(back.vertices, [[0, 0.5, 1], [3, 4, 5]])
    np.testing.assert_array_equal(back.edges, [[0, 1]])
    np.testing.assert_array_equal(back.radii, [2, 6])


# --------------------------------------------------------------------------------------------------------------- scans


@all_formats
@pytest.mark.parametrize(
    ("faces", "triangles"),
    [
        ([(0, 1, 2), (0, 2, 3)], [[0, 1, 2], [0, 2, 3]]),
        ([(0, 1, 2, 3)], [[0, 1, 2], [0, 2, 3]]),
        ([(0, 1, 2, 3), (3, 1, 0)], [[0, 1, 2], [0, 2, 3], [3, 1, 0]]),
        ([(1, 2, 3), (1, 2), (0,)], [[1, 2, 3]]),
        ([], []),
    ],
    ids=str,
)
def test_faces_become_triangles(scan, format, faces, triangles):
    mesh = scan(ply(format, ("vertex", XYZ, SQUARE), ("face", FACE, [(face,) for face in faces])))
    np.testing.assert_array_equal(mesh.positions, SQUARE)
    np.testing.assert_array_equal(mesh.triangles, np.reshape(triangles, (-1, 3)))


@all_formats
@pytest.mark.parametrize("face", [(), (0, 1, 9), (0, -1, 2), (0, 1, 2, 7)], ids=str)
def test_faces_of_what_is_no_vertex_are_refused(scan, format, face):
    with pytest.raises(FileFormatError, match="a face has no corners, or one that is no vertex"):
        scan(ply(format, ("vertex", XYZ, SQUARE), ("face", FACE, [((0, 1, 2, 3),), (face,)])))


@pytest.mark.parametrize("face", ["3 0 1 1.5", "2.7 0 1 2", "-1 0"])
def test_fractions_and_negative_counts_in_faces_are_refused(scan, face):
    whole = ply("ascii", ("vertex", XYZ, SQUARE), ("face", FACE, [((0, 1, 2),)]))
    with pytest.raises(FileFormatError, match=r"no vertex|impossible"):
        scan(whole.replace(b"3 0 1 2\n", f"{face}\n".encode()))


@all_formats
def test_a_wrong_count_of_points_is_seen_by_what_follows_them(scan, format):
    whole = ply(format, ("vertex", XYZ, SQUARE), ("camera", ["int number"], [(7,)]))
    assert len(scan(whole)) == 4
    with pytest.raises(FileFormatError, match="more than its header promises"):
        scan(whole.replace(b"element vertex 4", b"element vertex 3"))


@all_formats
def test_properties_of_all_kinds(scan, format):
    columns = [*XYZ, *(f"uchar {name}" for name in ("red", "green", "blue")), *(f"float n{axis}" for axis in "xyz")]
    columns += ["int class", "uchar alpha"]
    rows = [(*place, 255, 0, 51, 0.0, 0.6, 0.8, i, 7) for i, place in enumerate(SQUARE)]
    mesh = scan(ply(format, ("vertex", columns, rows)))
    np.testing.assert_allclose(mesh.colors, [[1, 0, 0.2]] * 4)
    np.testing.assert_allclose(mesh.normals, [[0, 0.6, 0.8]] * 4, rtol=1e-6)
    attributes = {key: values.tolist() for key, values in mesh.attributes.items()}
    assert attributes == {"class_": [0, 1, 2, 3], "alpha": [7] * 4}
    assert all(values.dtype.isnative for values in mesh.attributes.values())


@pytest.mark.parametrize("lists", [[(), (), (), ()], [(1, 2), (3, 4), (5, 6), (7, 8)], [(1,), (), (2, 3), (4, 5, 6)]])
@all_formats
def test_a_file_that_ends_anywhere_before_its_tables_do_is_refused(scan, format, lists):
    faces = [((0, 1, 2),), ((0, 1, 2, 3),), ((1, 2, 3),)]
    for elements in (
        [("odd", ["list uchar ushort some", "int more"], [(items, 7) for items in lists]), ("vertex", XYZ, SQUARE)],
        [
            (
                "vertex",
                [*XYZ, "list uchar int near"],
                [(*place, items) for place, items in zip(SQUARE, lists, strict=True)],
            )
        ],
        [("vertex", XYZ, SQUARE), ("face", FACE, faces)],
    ):
        whole = ply(format, *elements).rstrip(b"\n")
        np.testing.assert_array_equal(scan(whole + b"\n" * (format == "ascii")).positions, SQUARE)
        head, last = whole.index(b"end_header\n"), whole.rindex(b"\n") if format == "ascii" else len(whole) - 1
        for cut in (*range(0, head, 97), *range(head, last, 5), last):
            with pytest.raises(FileFormatError, match=r"m\.ply"):
                scan(whole[:cut])
