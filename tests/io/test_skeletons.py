"""The table of formats: what is true of all of them."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from glsk_o3d.data.report import Report
from glsk_o3d.data.skeleton import Skeleton
from glsk_o3d.errors import FileFormatError
from glsk_o3d.io.formats.graphs import as_forest, graph_skeleton
from glsk_o3d.io.skeletons import FORMATS, READABLE, holds_skeleton, read_skeleton, save_skeleton


@st.composite
def random_skeletons(draw):
    m = draw(st.integers(1, 12))
    pairs = [(i, j) for j in range(m) for i in range(j)]
    edges = draw(st.lists(st.sampled_from(pairs), unique=True, max_size=16)) if pairs else []
    number = st.floats(allow_nan=False, allow_infinity=False, width=64, max_value=1e150, min_value=-1e150)
    vertices = draw(st.lists(st.tuples(number, number, number), min_size=m, max_size=m, unique=True))
    radii = draw(st.lists(st.floats(0, 1e150), min_size=m, max_size=m))
    owners = np.array(draw(st.lists(st.integers(-1, m - 1), max_size=4)), int)
    anything, size = st.tuples(*[st.floats()] * 3), dict(min_size=len(owners), max_size=len(owners))
    points = np.reshape(draw(st.lists(anything, **size)), (-1, 3))
    owners = np.where((np.abs(points) <= 1e150).all(axis=1), owners, -1)
    normals = draw(st.lists(st.sampled_from([(0, 0.6, 0.8), (np.nan,) * 3, (-1, 0, -0.0)]), **size))
    confidence = draw(st.none() | st.lists(st.floats(0, 1), min_size=m, max_size=m))
    measured = {} if confidence is None else dict(confidence=confidence)
    return Skeleton(vertices, sorted(edges), radii, owners, points, normals, Report(versions={}), **measured)


@given(skeleton=random_skeletons())
@settings(max_examples=40, deadline=None, suppress_health_check=list(HealthCheck))
def test_random_graphs_through_every_format(assert_identical, skeleton):
    for ending in (".json", ".npz"):
        assert_identical(FORMATS[ending].read(FORMATS[ending].write(skeleton)), skeleton)
    for ending in (".ply", ".obj"):
        back = FORMATS[ending].read(FORMATS[ending].write(skeleton))
        np.testing.assert_array_equal(back.vertices, skeleton.vertices)
        np.testing.assert_array_equal(back.edges, skeleton.edges)
        np.testing.assert_array_equal(back.radii, skeleton.radii if ending == ".ply" else np.nan)
        assert np.isnan(back.confidence).all()
        assert len(back.points) == len(back.normals) == len(back.vertex_of_point) == 0
    tree = FORMATS[".swc"].read(FORMATS[".swc"].write(as_forest(skeleton, True, None)))
    assert (tree.n_loops, tree.n_components) == (0, skeleton.n_components)
    assert sorted(map(tuple, tree.vertices)) == sorted(map(tuple, skeleton.vertices))


@pytest.mark.parametrize("ending", READABLE)
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
        assert ending in (".obj", ".swc"), "only a format of independent lines can end anywhere"
        assert len(back.vertices) <= len(tree.vertices)


@pytest.mark.parametrize("ending", FORMATS)
def test_saving_is_deterministic_and_refuses_loops_in_trees(tree, loop, tmp_path, ending):
    for name in "ab":
        save_skeleton(tree, tmp_path / f"{name}{ending}")
    assert (tmp_path / f"a{ending}").read_bytes() == (tmp_path / f"b{ending}").read_bytes()
    if ending not in READABLE:
        with pytest.raises(FileFormatError, match="only written"):
            read_skeleton(tmp_path / f"a{ending}")
    if FORMATS[ending].trees:
        with pytest.raises(FileFormatError, match=r"2 loop.*cut_loops"):
            save_skeleton(loop, tmp_path / f"c{ending}")
        assert not (tmp_path / f"c{ending}").exists()
        save_skeleton(loop, tmp_path / f"c{ending}", cut_loops=True)


PLY = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n"
DAMAGED = {
    ".json": ["[]", "[" * 100_000, "{"],
    ".npz": ["PK"],
    ".obj": ["v 1 2\n", "v 1 2 three\n", *(f"v 1 2 3\nv 4 5 6\nl {line}\n" for line in ("0 1", "1 3", "1 -3"))],
    ".swc": [
        *("1 0 0 0 0 1 2\n", "1 0 0 0 0 1 -1\n1 0 0 0 0 1 -1\n"),
        *("1 0 0 0 0 1\n", "1 0 0 0 0 1 nan\n2 0 0 0 0\n"),
    ],
    ".ply": [
        *(PLY + f"end_header\n1 2 3\n{row}\n" for row in ("4 5", "4 five 6")),
        PLY + "element edge 1\nproperty int vertex1\nproperty int vertex2\nend_header\n1 2 3\n4 5 6\n0 2\n",
        PLY.replace("ascii", "binary_little_endian") + "end_header\nabc",
        PLY.replace("ascii", "klingon") + "end_header\n",
        PLY.replace("float x", "quaternion x") + "end_header\n",
        PLY.replace("vertex 2", "vertex -2") + "end_header\n",
        PLY.replace("vertex 2", "vertex 999999999999") + "end_header\n1 2 3\n",
        PLY.replace("vertex 2", "vertices 2") + "end_header\n1 2 3\n4 5 6\n",
        PLY.replace("float x", "float u") + "end_header\n1 2 3\n4 5 6\n",
        "ply\n",
    ],
}


@pytest.mark.parametrize("ending", READABLE)
def test_damaged_files(tmp_path, ending):
    for text in ("", "\0\xff garbage\n" * 9, *DAMAGED.get(ending, ())):
        (tmp_path / f"s{ending}").write_text(text, encoding="latin-1")
        with pytest.raises(FileFormatError, match=rf"s\{ending}"):
            read_skeleton(tmp_path / f"s{ending}")


def test_endings(tree, tmp_path, assert_identical):
    for name in ("s.vtk", "s", "s.txt"):
        with pytest.raises(FileFormatError, match=r"\.ply.*\.obj.*\.json.*\.urdf"):
            save_skeleton(tree, tmp_path / name)
    assert not list(tmp_path.iterdir())
    for name in ("S.JSON", *(f"s{ending}" for ending in READABLE)):
        assert not holds_skeleton(tmp_path / name)
        save_skeleton(tree, tmp_path / name)
        assert holds_skeleton(tmp_path / name)
    assert_identical(read_skeleton(tmp_path / "S.JSON"), tree)


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
    assert not holds_skeleton(path)
    with pytest.raises(FileFormatError, match=rf"c\{ending}: is a cloud"):
        read_skeleton(path)


def test_edges_of_others_are_sorted_and_each_is_there_once():
    skeleton = graph_skeleton(np.eye(4)[:, :3], [[3, 2], [1, 0], [0, 1], [2, 2]])
    np.testing.assert_array_equal(skeleton.edges, [[0, 1], [2, 3]])
    assert graph_skeleton([], []).vertices.shape == (0, 3)
