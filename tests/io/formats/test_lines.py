"""OBJ, VTP, DXF and GraphML: as others write them, and as others read ours."""

import numpy as np
import pytest

from glsk_o3d import Skeleton, save_skeleton
from glsk_o3d.io.scans import read_scan
from glsk_o3d.io.skeletons import read_skeleton


@pytest.mark.parametrize("ending", [".obj", ".ply"])
def test_meshlab_opens_it(skeleton, tmp_path, ending):
    pymeshlab = pytest.importorskip("pymeshlab")
    save_skeleton(skeleton, tmp_path / f"s{ending}")
    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(str(tmp_path / f"s{ending}"))
    mesh = meshes.current_mesh()
    np.testing.assert_array_equal(mesh.vertex_matrix(), skeleton.vertices)
    np.testing.assert_array_equal(mesh.edge_matrix().reshape(-1, 2), skeleton.edges)
    if ending == ".ply":  # it colours by them
        np.testing.assert_array_equal(mesh.vertex_scalar_array(), skeleton.radii)


def test_obj_as_others_write_it(tmp_path):
    (tmp_path / "s.obj").write_text(
        "# x\no name\nv 0 0 0 1\nv 1 0 0\nvn 0 0 1\nv 2 0 0\nl 1/1 2/1 3/2 # c\nl -1 -3\ng\n"
    )
    back = read_skeleton(tmp_path / "s.obj")
    np.testing.assert_array_equal(back.vertices, [[0, 0, 0], [1, 0, 0], [2, 0, 0]])
    np.testing.assert_array_equal(back.edges, [[0, 1], [0, 2], [1, 2]])


def test_vtk_reads_vertices_branches_and_radii(skeleton, tmp_path):
    reader_module = pytest.importorskip("vtkmodules.vtkIOXML", reason="vtk is not installed")
    from vtkmodules.util.numpy_support import vtk_to_numpy

    save_skeleton(skeleton, tmp_path / "s.vtp")
    reader = reader_module.vtkXMLPolyDataReader()
    reader.SetFileName(str(tmp_path / "s.vtp"))
    reader.Update()
    back = reader.GetOutput()
    np.testing.assert_array_equal(vtk_to_numpy(back.GetPoints().GetData()), skeleton.vertices)
    for name, values in (("radius", skeleton.radii), ("confidence", skeleton.confidence)):
        np.testing.assert_array_equal(vtk_to_numpy(back.GetPointData().GetArray(name)), values)
    alone = int((skeleton.degree == 0).sum())
    cells = vtk_to_numpy(back.GetCellData().GetArray("branch"))
    np.testing.assert_array_equal(cells, [*[-1] * alone, *range(len(skeleton.branches))])
    assert back.GetNumberOfVerts() == alone
    for i, path in enumerate(skeleton.branches):
        cell = back.GetCell(alone + i)
        assert [cell.GetPointId(j) for j in range(cell.GetNumberOfPoints())] == path.tolist()


def test_ezdxf_reads_branches_and_lone_vertices(skeleton, tmp_path):
    save_skeleton(skeleton, tmp_path / "s.dxf")
    drawing = pytest.importorskip("ezdxf").readfile(tmp_path / "s.dxf").modelspace()
    lines = drawing.query("POLYLINE")
    assert len(lines) == len(skeleton.branches)
    for line, path in zip(lines, skeleton.branches, strict=True):
        assert line.is_3d_polyline
        np.testing.assert_array_equal([point.xyz for point in line.points()], skeleton.vertices[path])
    points = [point.dxf.location.xyz for point in drawing.query("POINT")]
    assert points == [*map(tuple, skeleton.vertices[skeleton.degree == 0].tolist())]


def test_dxf_is_pairs_of_codes_and_values(tmp_path):
    graph = Skeleton([[0.1, 2, 3], [4, 5, 1e-9], [7, 8, 9]], [[0, 1]], [1, 1, 1], (), (), ())
    save_skeleton(graph, tmp_path / "s.dxf")
    words = (tmp_path / "s.dxf").read_text().split("\n")[:-1]
    pairs = [*zip(map(int, words[::2]), words[1::2], strict=True)]
    assert (pairs[0], pairs[1], pairs[-1]) == ((0, "SECTION"), (2, "ENTITIES"), (0, "EOF"))
    kinds = [value for code, value in pairs if code == 0]
    assert kinds == ["SECTION", "POLYLINE", "VERTEX", "VERTEX", "SEQEND", "POINT", "ENDSEC", "EOF"]
    assert [float(value) for code, value in pairs if code in (10, 20, 30)] == [0.1, 2, 3, 4, 5, 1e-9, 7, 8, 9]


def test_networkx_reads_the_graph_and_its_measures(skeleton, tmp_path):
    save_skeleton(skeleton, tmp_path / "s.graphml")
    back = pytest.importorskip("networkx").read_graphml(tmp_path / "s.graphml", node_type=int)
    assert [*back] == [*range(len(skeleton.vertices))]
    for name, values in (*zip("xyz", skeleton.vertices.T, strict=True), ("radius", skeleton.radii)):
        np.testing.assert_array_equal([facts[name] for _, facts in back.nodes(data=True)], values)
    assert {tuple(sorted(edge)) for edge in back.edges} == {*map(tuple, skeleton.edges.tolist())}
    np.testing.assert_allclose([back.edges[edge]["length"] for edge in skeleton.edges.tolist()], skeleton.edge_lengths)


# -------------------------------------------------------------------------------------------------------------- meshes

CUBE = [(x, y, z) for x in (0, 1 / 3) for y in (0, 1) for z in (0, 1)]
QUADS = [(1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4)]
POINTS = "".join(f"v {500000 + x!r} {y} {z}\n" for x, y, z in CUBE)
FIRST = "mtllib no.mtl\nusemtl grey\nvt 0 0\nvt 1 0\nvn 0 0 1\no a\n"
FORMS = {
    "plain": "f {a} {b} {c} {d}\n",
    "v/vt/vn": "f {a}/1/1 {b}/2/1 {c}/1/1 {d}/2/1\n",
    "v//vn": "f {a}//1 {b}//1 {c}//1 {d}//1\n",
    "v/vt": "f {a}/2 {b}/2 {c}/2 {d}/2\n",
    "materials": "usemtl m{a}\ng g{a}\nf {a} {b} {c} {d}\n",
    "triangles": "f {a} {b} {c}\nf {a} {c} {d}\n",
    "continued": "f {a} {b} \\\n{c} {d} # {a}\n",
    "with lines": "l 1 2\nf {a} {b} {c} {d}\n",
}


def area(scan):
    a, b, c = (scan.positions[corner] for corner in scan.triangles.T)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


@pytest.mark.parametrize("ends", ["\n", "\r\n"])
@pytest.mark.parametrize("form", FORMS.values(), ids=FORMS)
@pytest.mark.parametrize("shift", [0, -9], ids=["", "negative"])
def test_polygons_of_obj(tmp_path, form, ends, shift):
    corners = [dict(zip("abcd", np.add(quad, shift), strict=True)) for quad in QUADS]
    faces = [(FORMS["triangles"] if i < 3 else form).format(**corner) for i, corner in enumerate(corners)]
    (tmp_path / "m.obj").write_bytes((FIRST + POINTS + "".join(faces)).replace("\n", ends).encode())
    scan = read_scan(tmp_path / "m.obj")
    np.testing.assert_array_equal(scan.positions, np.array(CUBE) + [500000, 0, 0])  # with all digits
    assert scan.triangles.shape == (12, 3)
    np.testing.assert_allclose(area(scan), 2 + 4 / 3, rtol=1e-9)


def test_negative_corners_count_back_from_their_line(tmp_path):
    layers = [f"v 0 0 {z}\nv 1 0 {z}\nv 1 1 {z}\nv 0 1 {z}\nf -4 -3 -2 -1\n" for z in range(3)]
    (tmp_path / "m.obj").write_text("".join(layers))
    scan = read_scan(tmp_path / "m.obj")
    first = np.array([[0, 1, 2], [0, 2, 3]])
    np.testing.assert_array_equal(scan.triangles, np.concatenate([first, first + 4, first + 8]))
    assert area(scan) == 3


@pytest.mark.parametrize("n", [3, 4, 5, 64])
def test_polygons_of_many_corners(tmp_path, n):
    angle = 2 * np.pi * np.arange(n) / n
    text = "".join(f"v {np.cos(a)} {np.sin(a)} 0 {a / 7} 0.5 1\n" for a in angle) + "v 9 9 9 0 0 0\n"
    (tmp_path / "m.obj").write_text(text + "f " + " ".join(map(str, range(1, n + 1))))
    scan = read_scan(tmp_path / "m.obj")
    assert (len(scan), len(scan.triangles)) == (n + 1, n - 2)
    np.testing.assert_allclose(area(scan), n / 2 * np.sin(2 * np.pi / n))
    np.testing.assert_allclose(scan.colors[:-1], np.column_stack([angle / 7, 0 * angle + 0.5, 0 * angle + 1]))


@pytest.mark.parametrize(("corner", "of_vertices"), [("{0}//{0}", True), ("{0}/1/{0}", True), ("{0}//1", False)])
def test_normals_of_vertices_are_read(tmp_path, corner, of_vertices):
    normals = "".join(f"vn {x} {y} {z}\n" for x, y, z in CUBE)
    faces = "".join("f " + " ".join(corner.format(i) for i in quad) + "\n" for quad in QUADS)
    (tmp_path / "m.obj").write_text(POINTS + "vt 0 0\n" + normals + faces)
    scan = read_scan(tmp_path / "m.obj")
    assert (scan.normals is not None) == of_vertices
    if of_vertices:
        np.testing.assert_array_equal(scan.normals, CUBE)


def test_an_obj_file_of_points_is_a_cloud(tmp_path):
    (tmp_path / "m.obj").write_text(POINTS)
    assert (len(read_scan(tmp_path / "m.obj")), len(read_scan(tmp_path / "m.obj").triangles)) == (8, 0)
