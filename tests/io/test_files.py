import contextlib
import dataclasses
import io
import json
import math
import os
import pickle
import stat
import sys

import networkx
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from networkx.algorithms.isomorphism import categorical_node_match

from glsk_o3d.errors import FileFormatError, MissingPackageError
from glsk_o3d.interop.writing import write_atomically
from glsk_o3d.io import files
from glsk_o3d.io.files import read_cloud, read_skeleton, save_skeleton
from glsk_o3d.report import Report
from glsk_o3d.skeleton import Skeleton

ARRAYS = ("vertices", "edges", "radii", "confidence", "vertex_of_point", "points", "normals")
SAME_ORDER = (".ply", ".obj", ".graphml")
WITH_RADII = (".ply", ".swc", ".graphml")
GRAPHS = (".ply", ".obj", ".graphml", ".swc", ".cgal", ".polylines.txt")
ALL = (*GRAPHS, ".json", ".npz")


def assert_identical(back, skeleton):
    for name in ARRAYS:
        a, b = getattr(back, name), getattr(skeleton, name)
        assert a.dtype == b.dtype, name
        assert a.shape == b.shape, name
        # To the last bit, signed zeros included; a NaN need only stay one.
        np.testing.assert_array_equal(np.where(a != a, 0, a).view("i8"), np.where(b != b, 0, b).view("i8"), name)
        np.testing.assert_array_equal(a != a, b != b, name)
    assert files._dumps(back.report.to_dict()) == files._dumps(skeleton.report.to_dict())


def isomorphic(a, b, radii):
    """Whether two skeletons have the same positions (and radii) joined in the same way."""
    graphs = [skeleton.to_networkx() for skeleton in (a, b)]
    keys = ["position", "radius"] if radii else ["position"]
    return networkx.is_isomorphic(*graphs, node_match=categorical_node_match(keys, [None] * len(keys)))


# ---------------------------------------------------------------------------------------------------- round trips


@pytest.mark.parametrize("ending", [".json", ".npz"])
def test_json_and_npz_keep_everything(skeleton, tmp_path, ending):
    save_skeleton(skeleton, tmp_path / f"s{ending}")
    assert_identical(read_skeleton(tmp_path / f"s{ending}"), skeleton)


@pytest.mark.parametrize("ending", [".json", ".npz"])
def test_skeletons_without_cloud_or_vertices(bare, tmp_path, ending):
    for skeleton in (bare, Skeleton((), (), (), (), (), ())):
        save_skeleton(skeleton, tmp_path / f"s{ending}")
        assert_identical(read_skeleton(tmp_path / f"s{ending}"), skeleton)


@pytest.mark.parametrize("ending", GRAPHS)
def test_graph_formats(skeleton, tmp_path, ending):
    cut = ending == ".swc" and skeleton.n_loops
    save_skeleton(skeleton, tmp_path / f"s{ending}", cut_loops=bool(cut))
    back = read_skeleton(tmp_path / f"s{ending}")
    if cut:
        return
    assert isomorphic(back, skeleton, ending in WITH_RADII)
    if ending in SAME_ORDER:
        np.testing.assert_array_equal(back.vertices, skeleton.vertices)
        np.testing.assert_array_equal(back.edges, skeleton.edges)
    if ending not in WITH_RADII:
        assert np.isnan(back.radii).all()
    assert np.isnan(back.confidence).all()
    assert len(back.confidence) == len(back.vertices)
    assert len(back.radii) == len(back.vertices)
    assert len(back.points) == len(back.normals) == len(back.vertex_of_point) == 0


@st.composite
def random_skeletons(draw):
    m = draw(st.integers(1, 12))
    pairs = [(i, j) for j in range(m) for i in range(j)]
    edges = draw(st.lists(st.sampled_from(pairs), unique=True, max_size=16)) if pairs else []
    number = st.floats(allow_nan=False, allow_infinity=False, width=64, max_value=1e150, min_value=-1e150)
    vertices = draw(st.lists(st.tuples(number, number, number), min_size=m, max_size=m, unique=True))
    radii = draw(st.lists(st.floats(0, 1e300), min_size=m, max_size=m))
    owners = draw(st.lists(st.integers(-1, m - 1), max_size=4))
    anything = st.tuples(*[st.floats()] * 3)
    points, normals = (draw(st.lists(anything, min_size=len(owners), max_size=len(owners))) for _ in "pn")
    confidence = draw(st.none() | st.lists(st.floats(0, 1), min_size=m, max_size=m))
    measured = {} if confidence is None else dict(confidence=confidence)
    return Skeleton(vertices, sorted(edges), radii, owners, points, normals, Report(versions={}), **measured)


@given(skeleton=random_skeletons())
@settings(max_examples=60, deadline=None, suppress_health_check=list(HealthCheck))
def test_random_graphs_through_every_format(skeleton):
    for ending in (".json", ".npz"):
        write, read = files._FORMATS[ending]
        assert_identical(read(write(skeleton)), skeleton)
    for ending in GRAPHS:
        write, read = files._FORMATS[ending]
        if ending != ".swc":
            assert isomorphic(read(write(skeleton)), skeleton, ending in WITH_RADII)
            continue
        tree = read(write(skeleton, cut_loops=True))
        assert tree.n_loops == 0
        assert tree.n_components == skeleton.n_components
        assert sorted(map(tuple, tree.vertices)) == sorted(map(tuple, skeleton.vertices))


@given(data=st.binary(max_size=200), ending=st.sampled_from(ALL))
@settings(max_examples=150, deadline=None, suppress_health_check=list(HealthCheck))
def test_any_bytes_give_a_skeleton_or_a_format_error(tmp_path_factory, data, ending):
    path = tmp_path_factory.getbasetemp() / f"any{ending}"
    path.write_bytes(data)
    with contextlib.suppress(FileFormatError):
        assert isinstance(read_skeleton(path), Skeleton)


@pytest.mark.parametrize("ending", ALL)
def test_broken_off_files(tree, tmp_path, ending):
    path = tmp_path / f"s{ending}"
    save_skeleton(tree, path)
    whole = path.read_bytes()
    for cut in range(0, len(whole) - 1, max(1, len(whole) // 60)):
        path.write_bytes(whole[:cut])
        try:
            back = read_skeleton(path)
        except FileFormatError:
            continue
        assert ending in (".obj", ".swc", ".cgal", ".polylines.txt"), (
            "only a format of independent lines can end anywhere"
        )
        assert len(back.vertices) <= len(tree.vertices)


def test_saving_twice_gives_the_same_bytes(tree, tmp_path):
    for ending in ALL:
        for name in "ab":
            tree.save(tmp_path / f"{name}{ending}")
        assert (tmp_path / f"a{ending}").read_bytes() == (tmp_path / f"b{ending}").read_bytes()


# ------------------------------------------------------------------------------------------- what others make of it


def test_ply_in_open3d(skeleton, tmp_path):
    import open3d as o3d

    if not len(skeleton.edges):
        pytest.skip("Open3D reads no line set without lines")
    skeleton.save(tmp_path / "s.ply")
    lines = o3d.io.read_line_set(str(tmp_path / "s.ply"))
    np.testing.assert_array_equal(np.asarray(lines.points), skeleton.vertices)
    np.testing.assert_array_equal(np.asarray(lines.lines), skeleton.edges)
    cloud = o3d.t.io.read_point_cloud(str(tmp_path / "s.ply"))
    np.testing.assert_array_equal(cloud.point["radius"].numpy().ravel(), skeleton.radii)


@pytest.mark.parametrize(("ending", "tolerance"), [(".ply", 0), (".obj", 0)])
def test_ply_and_obj_in_meshlab(skeleton, tmp_path, ending, tolerance):
    pymeshlab = pytest.importorskip("pymeshlab")
    skeleton.save(tmp_path / f"s{ending}")
    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(str(tmp_path / f"s{ending}"))
    mesh = meshes.current_mesh()
    np.testing.assert_allclose(mesh.vertex_matrix(), skeleton.vertices, rtol=0, atol=tolerance)
    np.testing.assert_array_equal(mesh.edge_matrix().reshape(-1, 2), skeleton.edges)


def test_ply_written_by_open3d(tree, tmp_path):
    import open3d as o3d

    for text in (True, False):
        o3d.io.write_line_set(str(tmp_path / "s.ply"), tree.to_line_set(), write_ascii=text)
        back = read_skeleton(tmp_path / "s.ply")
        np.testing.assert_allclose(back.vertices, tree.vertices, rtol=1e-5 if text else 0)
        np.testing.assert_array_equal(back.edges, tree.edges)
        assert np.isnan(back.radii).all()


def test_ply_of_all_byte_orders_gives_the_same(tmp_path):
    header = "ply\r\nformat {} 1.0\r\ncomment x\r\nelement vertex 2\r\nproperty double x\r\nproperty double y\r\n"
    header += (
        "property double z\r\nproperty float radius\r\nelement face 0\r\nproperty list uchar int vertex_indices\r\n"
    )
    header += "element edge 1\r\nproperty ushort vertex1\r\nproperty int vertex2\r\nend_header\r\n"
    bodies = {"ascii": b"0 0.5 1 2\n3 4 5 6\n1 0\n"}
    for name, order in (("binary_little_endian", "<"), ("binary_big_endian", ">")):
        kinds = [(c, order + k) for c, k in zip("xyzr", ("f8", "f8", "f8", "f4"), strict=True)]
        rows = np.array([(0, 0.5, 1, 2), (3, 4, 5, 6)], kinds)
        bodies[name] = rows.tobytes() + np.array((1, 0), [("a", order + "u2"), ("b", order + "i4")]).tobytes()
    for name, body in bodies.items():
        (tmp_path / "s.ply").write_bytes(header.format(name).encode() + body)
        back = read_skeleton(tmp_path / "s.ply")
        np.testing.assert_array_equal(back.vertices, [[0, 0.5, 1], [3, 4, 5]])
        np.testing.assert_array_equal(back.edges, [[0, 1]])
        np.testing.assert_array_equal(back.radii, [2, 6])


def test_json_is_strict_and_says_what_it_is(tree, tmp_path):
    tree.save(tmp_path / "s.json")

    def refuse(word):
        raise AssertionError(word)

    values = json.loads((tmp_path / "s.json").read_text(), parse_constant=refuse)
    assert (values["format"], values["format_version"]) == ("glsk-o3d skeleton", 1)
    assert values["points"][0] == [None] * 3
    assert values["points"][1] == ["Infinity", "-Infinity", -0.0]
    numbers = [*values["report"]["iterations"][0].values()]
    assert None in numbers
    assert "Infinity" in numbers


def test_npz_is_plain(tree, tmp_path):
    tree.save(tmp_path / "s.npz")
    with np.load(tmp_path / "s.npz", allow_pickle=False) as archive:
        assert archive["format"] == "glsk-o3d skeleton"
        np.testing.assert_array_equal(archive["vertices"], tree.vertices)


def test_obj_as_others_write_it(tmp_path):
    (tmp_path / "s.obj").write_text(
        "# x\no name\nv 0 0 0 1\nv 1 0 0\nvn 0 0 1\nv 2 0 0\nl 1/1 2/1 3/2 # c\nl -1 -3\ng\n"
    )
    back = read_skeleton(tmp_path / "s.obj")
    np.testing.assert_array_equal(back.vertices, [[0, 0, 0], [1, 0, 0], [2, 0, 0]])
    np.testing.assert_array_equal(back.edges, [[0, 1], [0, 2], [1, 2]])


def test_swc_as_others_write_it(tmp_path):
    (tmp_path / "s.swc").write_text("# x\n\n 30 3 1 1 1 0.5 7\n7 1 0 0 0 2 -1\n9 3 2 0 0 .5 30 extra\n")
    back = read_skeleton(tmp_path / "s.swc")
    np.testing.assert_array_equal(back.edges, [[0, 1], [0, 2]])
    np.testing.assert_array_equal(back.radii, [0.5, 2, 0.5])


def test_swc_rows(forest, tmp_path):
    forest.save(tmp_path / "s.swc")
    rows = [line.split() for line in (tmp_path / "s.swc").read_text().splitlines() if line[0] != "#"]
    numbers, parents = [int(row[0]) for row in rows], [int(row[6]) for row in rows]
    assert numbers == [*range(1, 7)]
    assert all(parent < number for parent, number in zip(parents, numbers, strict=True))
    assert parents.count(-1) == forest.n_components == 3


def test_swc_refuses_loops_or_cuts_the_longest_edges(loop, tmp_path):
    with pytest.raises(FileFormatError, match=r"2 loop.*cut_loops=True"):
        loop.save(tmp_path / "s.swc")
    assert not list(tmp_path.iterdir())
    loop.save(tmp_path / "s.swc", cut_loops=True)
    tree = read_skeleton(tmp_path / "s.swc")
    assert len(tree.edges) == len(loop.edges) - loop.n_loops
    assert (tree.n_loops, tree.n_components) == (0, 1)
    # Of two loops sharing the chord both the chord and one more edge go: the chord is the longest.
    lengths = np.sort(loop.edge_lengths)
    assert tree.length == pytest.approx(lengths[:5].sum())
    assert tree.edge_lengths.max() < lengths[-1]


def test_swc_keeps_edges_of_no_length(make, tmp_path):
    make(np.zeros((3, 3)), [[0, 1], [1, 2]]).save(tmp_path / "s.swc")
    assert len(read_skeleton(tmp_path / "s.swc").edges) == 2


def test_graphml_as_others_write_it(tmp_path):
    graph = networkx.MultiDiGraph()
    graph.add_nodes_from([("a", dict(x=0, y=0.5, z=1)), ("b", dict(x=1.0, y=1.0, z=1.0, radius=2.0))])
    graph.add_edges_from([("b", "a"), ("a", "b"), ("a", "a")])
    networkx.write_graphml_xml(graph, tmp_path / "s.graphml")
    back = read_skeleton(tmp_path / "s.graphml")
    np.testing.assert_array_equal(back.edges, [[0, 1]])
    np.testing.assert_array_equal(back.radii, [np.nan, 2])


def test_graphml_in_networkx(tree, tmp_path):
    tree.save(tmp_path / "s.graphml")
    graph = networkx.read_graphml(tmp_path / "s.graphml", node_type=int)
    assert [graph.nodes[i]["radius"] for i in range(6)] == tree.radii.tolist()
    assert [graph.edges[edge]["length"] for edge in tree.edges.tolist()] == tree.edge_lengths.tolist()


def test_polylines_have_a_line_per_branch(tree, forest, tmp_path):
    tree.save(tmp_path / "s.cgal")
    lines = (tmp_path / "s.cgal").read_text().splitlines()
    assert sorted(int(line.split()[0]) for line in lines) == [2, 3, 3]
    forest.save(tmp_path / "s.polylines.txt")
    lines = (tmp_path / "s.polylines.txt").read_text().splitlines()
    assert sorted(int(line.split()[0]) for line in lines) == [1, 2, 3]


# ------------------------------------------------------------------------------------------- refusals and failures


def doctored(tree, **changes):
    values = json.loads(files._write_json(tree))
    values.update(changes)
    return json.dumps({key: value for key, value in values.items() if value is not ...}).encode()


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"format": "other"}, "not marked"),
        ({"format_version": 2}, "format_version 2.*update glsk-o3d"),
        ({"edges": [[0, 6]]}, "vertex that is not there"),
        ({"edges": [[-1, 2]]}, "vertex that is not there"),
        ({"edges": [[0, 1.5]]}, "edges has"),
        ({"edges": [0, 1]}, "edges has"),
        ({"vertices": [[0, 1]]}, "vertices has"),
        ({"vertices": "abc"}, "valid"),
        ({"radii": [1.0]}, "1 radii for 6 vertices"),
        ({"confidence": [0.5] * 5}, "5 confidences for 6 vertices"),
        ({"confidence": []}, "0 confidences for 6 vertices"),
        ({"confidence": [[0.5]] * 6}, "confidence has"),
        ({"vertex_of_point": [9] * 7}, "vertex_of_point"),
        ({"points": [[0, 0, 0]]}, "differ in length"),
        ({"report": {"iterations": [{"iteration": 1}]}}, "missing"),
        ({"report": None}, "valid"),
    ],
)
def test_json_that_makes_no_sense(tree, tmp_path, changes, says):
    (tmp_path / "s.json").write_bytes(doctored(tree, **changes))
    with pytest.raises(FileFormatError, match=says):
        read_skeleton(tmp_path / "s.json")


@pytest.mark.parametrize("name", [*ARRAYS, "report"])
def test_json_and_npz_that_lack_something(tree, tmp_path, name):
    values = json.loads(files._write_json(tree))
    del values[name]
    (tmp_path / "s.json").write_text(json.dumps(values))
    with np.load(io.BytesIO(files._write_npz(tree))) as archive:
        np.savez(tmp_path / "s.npz", **{key: archive[key] for key in archive.files if key != name})
    for ending in (".json", ".npz"):
        with pytest.raises(FileFormatError):
            read_skeleton(tmp_path / f"s{ending}")


def test_npz_never_unpickles(tree, tmp_path):
    class Bomb:
        def __reduce__(self):
            return os.mkdir, (str(tmp_path / "went off"),)

    with np.load(io.BytesIO(files._write_npz(tree))) as archive:
        values = dict(archive)
    np.savez(tmp_path / "s.npz", **{**values, "points": np.array([Bomb()], object)})
    (tmp_path / "t.npz").write_bytes(pickle.dumps(Bomb()))
    for name in "st":
        with pytest.raises(FileFormatError):
            read_skeleton(tmp_path / f"{name}.npz")
    assert not (tmp_path / "went off").exists()


PLY = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n"


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("s.ply", PLY + "end_header\n1 2 3\n4 5\n"),
        ("s.ply", PLY + "element edge 1\nproperty int vertex1\nproperty int vertex2\nend_header\n1 2 3\n4 5 6\n0 2\n"),
        ("s.ply", PLY.replace("ascii", "binary_little_endian") + "end_header\nabc"),
        ("s.ply", PLY.replace("ascii", "klingon") + "end_header\n"),
        ("s.ply", PLY.replace("float x", "quaternion x") + "end_header\n"),
        ("s.ply", PLY.replace("vertex 2", "vertex -2") + "end_header\n"),
        ("s.ply", PLY.replace("vertex 2", "vertex 999999999999") + "end_header\n1 2 3\n"),
        ("s.ply", PLY.replace("vertex 2", "vertices 2") + "end_header\n1 2 3\n4 5 6\n"),
        ("s.ply", PLY.replace("float x", "float u") + "end_header\n1 2 3\n4 5 6\n"),
        ("s.ply", "ply\n"),
        ("s.obj", "v 1 2\n"),
        ("s.obj", "v 1 2 three\n"),
        ("s.obj", "v 1 2 3\nv 4 5 6\nl 0 1\n"),
        ("s.obj", "v 1 2 3\nv 4 5 6\nl 1 3\n"),
        ("s.obj", "v 1 2 3\nv 4 5 6\nl 1 -3\n"),
        ("s.swc", "1 0 0 0 0 1 2\n"),
        ("s.swc", "1 0 0 0 0 1 -1\n1 0 0 0 0 1 -1\n"),
        ("s.swc", "1 0 0 0 0 1\n"),
        ("s.swc", "1 0 0 0 0 1 nan\n2 0 0 0 0\n"),
        ("s.graphml", "<graphml/>"),
        ("s.graphml", "<html><p>"),
        ("s.cgal", "2 0 0 0 1 1\n"),
        ("s.cgal", "0\n"),
        ("s.cgal", "1.5 0 0 0 1 1\n"),
        ("s.json", "[]"),
        ("s.json", "[" * 100_000),
        ("s.json", "{"),
        ("s.npz", "PK"),
        *((f"s{ending}", "") for ending in ALL),
        *((f"s{ending}", "\0\xff garbage\n" * 9) for ending in ALL),
    ],
)
def test_hostile_skeleton_files(tmp_path, name, text):
    (tmp_path / name).write_text(text, encoding="latin-1")
    with pytest.raises(FileFormatError, match=name):
        read_skeleton(tmp_path / name)


def test_graphml_without_coordinates(tmp_path):
    networkx.write_graphml_xml(networkx.path_graph(2), tmp_path / "s.graphml")
    with pytest.raises(FileFormatError, match="node '0' lacks x, y or z"):
        read_skeleton(tmp_path / "s.graphml")


def test_endings(tree, tmp_path):
    for name in ("s.vtk", "s", "s.txt"):
        with pytest.raises(FileFormatError, match=r"\.ply, \.obj, \.json.*\.polylines\.txt"):
            tree.save(tmp_path / name)
    with pytest.raises(FileFormatError, match="format 'vtk'"):
        tree.save(tmp_path / "s.ply", format="vtk")
    assert not list(tmp_path.iterdir())
    tree.save(tmp_path / "S.JSON")
    assert_identical(read_skeleton(tmp_path / "S.JSON"), tree)
    for format in ("npz", ".NPZ"):
        tree.save(tmp_path / "s.bak", format=format)
        assert_identical(read_skeleton(tmp_path / "s.bak", format=format), tree)


@pytest.mark.parametrize("read", [read_skeleton, read_cloud])
def test_what_is_not_a_file(tmp_path, read):
    with pytest.raises(FileNotFoundError, match=r"none\.ply: no such file"):
        read(tmp_path / "none.ply")
    (tmp_path / "folder.ply").mkdir()
    with pytest.raises(FileFormatError, match="is a folder"):
        read(str(tmp_path / "folder.ply"))


def test_no_folder_to_save_in(tree, tmp_path):
    with pytest.raises(FileNotFoundError, match=r"missing: no such folder.*s\.ply"):
        tree.save(tmp_path / "missing" / "s.ply")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("ending", ALL)
def test_failure_keeps_the_old_file_and_leaves_nothing(tree, tmp_path, monkeypatch, ending):
    path = tmp_path / f"s{ending}"
    path.write_text("old")

    def fail(*_):
        raise OSError("disk full")

    with monkeypatch.context() as patch:
        patch.setattr("os.replace", fail)
        with pytest.raises(OSError, match="disk full"):
            tree.save(path)
    with monkeypatch.context() as patch:
        patch.setattr("pathlib.Path.write_bytes", lambda self, data: open(self, "wb").close() or fail())
        with pytest.raises(OSError, match="disk full"):
            tree.save(path)
    assert [file.name for file in tmp_path.iterdir()] == [path.name]
    assert path.read_text() == "old"


def test_interrupted_write_leaves_nothing(tmp_path):
    def interrupt(temporary):
        temporary.write_text("half")
        assert temporary.parent == tmp_path
        assert temporary.suffix == ".png"
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_atomically(tmp_path / "p.png", interrupt)
    assert not list(tmp_path.iterdir())


def test_written_files_look_like_ordinary_ones(tmp_path):
    (tmp_path / "plain").write_text("")
    write_atomically(tmp_path / "new", lambda temporary: temporary.write_text("x"))
    assert (tmp_path / "new").stat().st_mode == (tmp_path / "plain").stat().st_mode
    (tmp_path / "new").chmod(0o600)
    write_atomically(tmp_path / "new", lambda temporary: temporary.write_text("y"))
    assert stat.S_IMODE((tmp_path / "new").stat().st_mode) == 0o600
    (tmp_path / "link").symlink_to("new")
    write_atomically(tmp_path / "link", lambda temporary: temporary.write_text("z"))
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "new").read_text() == "z"
    long = tmp_path / ("n" * 250)
    write_atomically(long, lambda temporary: temporary.write_text("x"))
    assert long.exists()


def test_folders_and_devices_are_not_replaced(tree, tmp_path):
    (tmp_path / "s.ply").mkdir()
    for path in (tmp_path / "s.ply", os.devnull):
        with pytest.raises(OSError, match="not a file"):
            tree.save(path, format="ply")


def test_without_networkx(tree, tmp_path, monkeypatch):
    tree.save(tmp_path / "s.graphml")
    monkeypatch.setitem(sys.modules, "networkx", None)
    for action in (lambda: tree.save(tmp_path / "t.graphml"), lambda: read_skeleton(tmp_path / "s.graphml")):
        with pytest.raises(MissingPackageError, match="networkx"):
            action()


# ---------------------------------------------------------------------------------------------------------- clouds

XYZ = np.random.default_rng(1).normal(size=(50, 3))


@pytest.fixture
def cloud():
    import open3d as o3d

    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(XYZ))
    cloud.normals = o3d.utility.Vector3dVector(XYZ / np.linalg.norm(XYZ, axis=1, keepdims=True))
    cloud.colors = o3d.utility.Vector3dVector(np.abs(XYZ) / 10)
    return cloud


@pytest.mark.parametrize("name", ["c.ply", "c.pcd", "c.xyz", "c.xyzn", "c.xyzrgb", "c.pts", "C.PLY", "c é.Pcd"])
@pytest.mark.parametrize("options", [{}, {"write_ascii": True}, {"compressed": True}], ids=str)
def test_clouds_that_open3d_writes(cloud, tmp_path, name, options):
    import open3d as o3d

    plain = tmp_path / f"plain.{name.lower().split('.')[1]}"
    assert o3d.io.write_point_cloud(str(plain), cloud, **options)
    plain.rename(tmp_path / name)
    back = read_cloud(tmp_path / name)
    np.testing.assert_allclose(np.asarray(back.points), XYZ, rtol=1e-5)  # six digits in text
    assert back.has_normals() == (name.lower().split(".")[1] in ("ply", "pcd", "xyzn"))
    assert back.has_colors() == (name.lower().split(".")[1] in ("ply", "pcd", "xyzrgb", "pts"))


@pytest.mark.parametrize("ending", ["off", "obj", "stl", "gltf", "ply"])
def test_meshes_give_their_vertices(tmp_path, ending):
    import open3d as o3d

    mesh = o3d.geometry.TriangleMesh.create_octahedron()
    mesh.compute_vertex_normals()
    o3d.io.write_triangle_mesh(str(tmp_path / f"m.{ending}"), mesh)
    back = np.unique(np.asarray(read_cloud(tmp_path / f"m.{ending}").points).round(6), axis=0)
    np.testing.assert_array_equal(back, np.unique(np.asarray(mesh.vertices), axis=0))


@pytest.mark.parametrize("ending", ALL)
def test_a_skeleton_is_no_scan(skeleton, tmp_path, ending):
    skeleton.save(tmp_path / f"s{ending}", **({"cut_loops": True} if ending == ".swc" else {}))
    with pytest.raises(FileFormatError, match=rf"s\{ending}: is a skeleton, not a scan"):
        read_cloud(tmp_path / f"s{ending}")


@pytest.mark.parametrize("name", ["c.npz", "c.json", "c.txt"])
def test_what_is_neither_scan_nor_skeleton(tmp_path, name):
    (tmp_path / name).write_text("{}")
    with pytest.raises(FileFormatError, match=rf"{name}: unknown ending; known are \.ply, \.pcd"):
        read_cloud(tmp_path / name)


@pytest.mark.parametrize("ending", [".ply", ".obj"])
@pytest.mark.parametrize("mesh", [False, True])
def test_a_scan_is_no_skeleton(cloud, tmp_path, ending, mesh):
    import open3d as o3d

    path = tmp_path / f"c{ending}"
    if mesh:
        o3d.io.write_triangle_mesh(str(path), o3d.geometry.TriangleMesh.create_octahedron())
    elif ending == ".ply":
        o3d.io.write_point_cloud(str(path), cloud)
    else:
        path.write_text("v 0 0 0\nv 1 0 0\n")
    with pytest.raises(FileFormatError, match=rf"c\{ending}: is a cloud, not a skeleton: make one with"):
        read_skeleton(path)


@pytest.mark.parametrize("ending", ["ply", "off", "obj", "stl", "gltf"])
@pytest.mark.parametrize(("resolution", "coarse"), [(5, True), (40, False)])
def test_a_mesh_with_few_vertices_is_told(tmp_path, caplog, ending, resolution, coarse):
    import open3d as o3d

    mesh = o3d.geometry.TriangleMesh.create_sphere(2.0, resolution).translate((1000, 0, 0))
    mesh.compute_vertex_normals()
    o3d.io.write_triangle_mesh(str(tmp_path / f"m.{ending}"), mesh)
    cloud, triangles = files.read_scan(tmp_path / f"m.{ending}")
    assert len(triangles) == len(mesh.triangles)
    assert triangles.max() < len(cloud.points)
    assert ("vertices of this mesh are far apart" in caplog.text) == coarse


def test_a_mesh_whose_triangles_name_what_is_not_there(tmp_path, caplog):
    (tmp_path / "m.ply").write_text(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n"
    )
    assert len(read_cloud(tmp_path / "m.ply").points) == 3
    assert not caplog.text


def test_nan_passes_through(tmp_path):
    (tmp_path / "c.xyz").write_text("nan 0 0\n1 2 3\n")
    assert np.isnan(np.asarray(read_cloud(tmp_path / "c.xyz").points)[0, 0])


@pytest.mark.parametrize("ending", files.CLOUD_ENDINGS + files.MESH_ENDINGS)
@pytest.mark.parametrize("data", [b"", b"\n", b"hello world\nthis is text\n" * 5, bytes(range(256)) * 4, b"\0" * 500])
def test_files_without_a_cloud(tmp_path, capfd, ending, data):
    (tmp_path / f"c{ending}").write_bytes(data)
    with pytest.raises(FileFormatError, match=rf"c\{ending}"):
        read_cloud(tmp_path / f"c{ending}")
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("ending", ["ply", "pcd", "pts"])
@pytest.mark.parametrize("options", [{}, {"write_ascii": True}, {"compressed": True}], ids=str)
def test_clouds_that_break_off_are_refused_wherever(cloud, tmp_path, capfd, ending, options):
    import open3d as o3d

    path = tmp_path / f"c.{ending}"
    o3d.io.write_point_cloud(str(path), cloud, **options)
    whole = path.read_bytes()
    last = whole.rstrip(b"\n").rfind(b"\n") if ending == "pts" or "write_ascii" in options else len(whole) - 1
    for cut in {*range(0, last, max(1, len(whole) // 80)), last}:
        path.write_bytes(whole[:cut])
        with pytest.raises(FileFormatError, match=path.name):
            read_cloud(path)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("name", "text", "says"),
    [
        ("c.ply", PLY + "end_header\n1 2 3\n4 five 6\n", "five"),
        (
            "c.ply",
            PLY.replace("vertex 2", "vertex 99999999999") + "end_header\n1 2 3\n",
            "promises 99999999999 points and",
        ),
        ("c.ply", PLY.replace("vertex 2", "vertex 0") + "end_header\n", "no points"),
        ("c.ply", PLY.replace("vertex 2", "face 2") + "end_header\n1 2 3\n4 5 6\n", "vertex"),
        ("c.pts", "1 2 3\n4 5 6\n", "number of points"),
        ("c.pts", "2\n1 2 3\n4 x 6\n", "x"),
        ("c.pts", "99999999999999\n1 2 3\n", "holds 1"),
        ("c.pcd", "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 5\n", "DATA"),
        ("c.pcd", "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS -5\nDATA ascii\n1 2 3\n", r"c\.pcd"),
        (
            "c.pcd",
            "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 99999999999\nDATA binary\n1 2 3\n",
            "promises 99999999999",
        ),
        ("c.xyz", "1,2,3\n4,5,6\n", "no points"),
        ("c.obj", "v 1 2 3\nv 4 5 6\n", "no points"),
    ],
)
def test_damaged_clouds(tmp_path, name, text, says):
    (tmp_path / name).write_text(text)
    with pytest.raises(FileFormatError, match=says):
        read_cloud(tmp_path / name)


def test_skipped_lines_are_logged(tmp_path, caplog):
    (tmp_path / "c.xyz").write_text("# a comment\n1 2 3\n4 5\n\n7 8 9\n")
    assert len(read_cloud(tmp_path / "c.xyz").points) == 2
    assert "1 of 3 lines hold no point" in caplog.text
    caplog.clear()
    (tmp_path / "c.xyz").write_text("# a comment\n1 2 3\n7 8 9\n")
    read_cloud(tmp_path / "c.xyz")
    assert not caplog.text


def test_unknown_cloud_endings(tmp_path):
    (tmp_path / "c.las").write_bytes(b"LASF")
    with pytest.raises(FileFormatError, match=r"\.ply, \.pcd, .*\.glb"):
        read_cloud(tmp_path / "c.las")


def test_verbosity_is_restored(tmp_path):
    import open3d as o3d

    (tmp_path / "c.xyz").write_text("1 2 3\n")
    with o3d.utility.VerbosityContextManager(o3d.utility.VerbosityLevel.Debug):
        read_cloud(tmp_path / "c.xyz")
        assert o3d.utility.get_verbosity_level() == o3d.utility.VerbosityLevel.Debug


@pytest.mark.parametrize("ending", [".json", ".npz"])
def test_numbers_of_the_report_come_back_as_they_were(tree, tmp_path, ending):
    tree.save(tmp_path / f"s{ending}")
    records = (tree.report.iterations, read_skeleton(tmp_path / f"s{ending}").report.iterations)
    for before, after in zip(*records, strict=True):
        for a, b in zip(dataclasses.astuple(before), dataclasses.astuple(after), strict=True):
            assert type(b) in (int, float)
            assert isinstance(b, float) == isinstance(a, float)
            assert a == b or (math.isnan(a) and math.isnan(b))
