"""``glsk edit``, ``glsk convert`` and ``glsk rig``."""

import json

import numpy as np
import open3d as o3d
import pytest

from glsk_o3d import Skeleton, read_skeleton, save_rig, save_skeleton
from glsk_o3d.cli.options import SKELETON_ENDINGS, TREE_ENDINGS
from glsk_o3d.io.scans import read_mesh
from glsk_o3d.io.skeletons import FORMATS


@pytest.fixture
def file(tmp_path):
    """A ring with a tail of two edges and a twig, and another piece."""
    turn = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    circle = np.column_stack([np.cos(turn), np.sin(turn), 0 * turn])
    vertices = np.concatenate([circle, [[2, 0, 0], [3, 0, 0], [2, 0.2, 0], [9, 0, 0], [9, 1, 0]]])
    edges = [*((i, i + 1) for i in range(11)), (0, 11), (0, 12), (12, 13), (12, 14), (15, 16)]
    save_skeleton(Skeleton(vertices, edges, np.ones(17), (), (), ()), tmp_path / "raw.json")
    return "raw.json"


def test_edits_one_after_the_other(invoke, file, tmp_path):
    words = ["--largest", "--cut-loops", "--root", "x", "--prune-length", "0.5", "--smooth", "2", "--vertices", "5"]
    result = invoke("edit", file, "-o", "new.swc", "-o", "new.json", *words)
    assert result.exit_code == 0, result.output
    done = ["kept one of 2 components", "cut a loop at (", "grows from (-1, ", "pruned 1 of ", "smoothed in 2 passes"]
    done += ["kept 5 of 14 vertices", "vertices 17 -> 5, edges 16 -> 4, components 2 -> 1, loops 1 -> 0, "]
    done.append("wrote new.swc")
    lines = result.stdout.splitlines()
    assert all(line.startswith(start) for line, start in zip(lines, done, strict=False))
    new = read_skeleton(tmp_path / "new.json")
    told = json.loads(invoke("edit", file, "-o", "again.json", *words, "--json").stdout)
    assert told["done"] == lines[:6]
    assert [told[when]["vertices"] for when in ("before", "after")] == [17, 5]
    assert told["files"] == ["again.json"]
    assert invoke("edit", file, "-o", "same.ply").stdout == "all counts are as before\nwrote same.ply\n"
    assert (new.n_components, new.n_loops, len(new.vertices)) == (1, 0, 5)
    assert read_skeleton(tmp_path / "new.swc").length == pytest.approx(new.length)
    result = invoke("edit", file, "-o", "new.ply", "--simplify", 10, "-q")
    assert (result.exit_code, result.output) == (0, "")
    assert read_skeleton(tmp_path / "new.ply").n_loops == 1


def test_convert(invoke, file, tmp_path):
    result = invoke("convert", file, "a.ply", "a.graphml", "a.obj")
    assert result.stdout == "wrote a.ply\nwrote a.graphml\nwrote a.obj\n"
    for name in ("a.ply", "a.graphml", "a.obj"):
        assert read_skeleton(tmp_path / name).n_loops == 1
    assert invoke("convert", file, "a.swc", "--cut-loops").exit_code == 0


@pytest.fixture
def line(tmp_path):
    """Three edges along x, from the thin end to the thick one."""
    edges = [(0, 1), (1, 2), (2, 3)]
    save_skeleton(
        Skeleton([[x, 0, 0] for x in range(-1, 3)], edges, [0.1, 0.2, 0.3, 0.4], (), (), ()), tmp_path / "line.json"
    )
    return "line.json"


@pytest.mark.parametrize(
    ("word", "x"), [("x", -1), ("-x", 2), ("thickest", 2), ("1", 0), ("0.9,0.1,0", 1), ("-0.9,0.1,0", -1)]
)
def test_a_root_in_all_words(invoke, line, tmp_path, word, x):
    names = [f"t.{name}" for name in ("swc", "urdf", "glb")]
    result = invoke("convert", line, *names, "--root", word)
    assert (result.exit_code, result.stderr) == (0, ""), result.output
    for name in names:
        save_skeleton(read_skeleton(line), tmp_path / f"expected-{name}", root=[x, 0, 0])
        assert (tmp_path / name).read_bytes() == (tmp_path / f"expected-{name}").read_bytes()
    assert read_skeleton(tmp_path / "t.swc").vertices[0].tolist() == [x, 0, 0]
    assert invoke("edit", line, "-o", "e.json", "--root", word).stdout.startswith(f"grows from ({x}, 0, 0)\n")


def test_a_root_is_for_formats_of_trees(invoke, line):
    assert invoke("convert", line, "a.ply", "a.swc", "--root", "-x").exit_code == 0
    assert [read_skeleton(path).vertices[0].tolist() for path in ("a.ply", "a.swc")] == [[-1, 0, 0], [2, 0, 0]]
    assert "a.swc: root = 7: there are vertices 0 to 3" in invoke("convert", line, "a.swc", "--root", "7").stderr


def test_formats_of_trees_are_those_of_the_table():
    assert {ending for ending, format in FORMATS.items() if format.trees} == {f".{ending}" for ending in TREE_ENDINGS}
    assert set(FORMATS) == {f".{ending}" for ending in SKELETON_ENDINGS}


# -------------------------------------------------------------------------------------------------------------- the rig


@pytest.fixture
def cloud(tmp_path):
    points = np.random.default_rng(3).normal(size=(40, 3))
    np.savetxt(tmp_path / "cloud.xyz", points)
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    assert o3d.io.write_point_cloud(str(tmp_path / "cloud.ply"), cloud)
    return points


@pytest.mark.parametrize("ending", ["ply", "obj", "stl"])
def test_a_mesh_hangs_on_the_bones(invoke, tmp_path, y, ending):
    octahedron = o3d.geometry.TriangleMesh.create_octahedron()
    octahedron.compute_triangle_normals()
    assert o3d.io.write_triangle_mesh(str(tmp_path / f"mesh.{ending}"), octahedron, write_triangle_uvs=False)
    result = invoke("rig", y, f"mesh.{ending}", "-o", "r.glb", "--root", "0,0,-0.5", "--up", "y")
    assert (result.exit_code, result.stderr) == (0, "")
    skeleton, mesh = read_skeleton(tmp_path / y), read_mesh(tmp_path / f"mesh.{ending}")
    bones = save_rig(skeleton, tmp_path / "expected.glb", mesh, root=(0, 0, -0.5), up="y")
    told = f"{len(bones.edges)} bones move {len(mesh.vertices)} vertices and 8 triangles\nwrote r.glb\n"
    assert result.stdout == told
    assert (tmp_path / "r.glb").read_bytes() == (tmp_path / "expected.glb").read_bytes()


@pytest.mark.parametrize("ending", ["ply", "xyz"])
def test_a_cloud_hangs_on_the_bones(invoke, tmp_path, y, cloud, ending):
    result = invoke("rig", y, f"cloud.{ending}", "-o", "r.glb", "--root", "2")
    assert f" bones move {len(cloud)} points\n" in result.stdout
    save_rig(read_skeleton(tmp_path / y), tmp_path / "expected.glb", cloud, root=2)
    assert (tmp_path / "r.glb").read_bytes() == (tmp_path / "expected.glb").read_bytes()


def test_alone_it_has_its_tubes_and_loops_are_cut_if_one_says_so(invoke, ring_file, tmp_path):
    result = invoke("rig", ring_file, "-o", "r.glb", "--cut-loops")
    bones = save_rig(read_skeleton(tmp_path / ring_file), tmp_path / "expected.glb", cut_loops=True)
    assert result.stdout == f"{len(bones.edges)} bones move the skeleton's own surface\nwrote r.glb\n"
    assert (tmp_path / "r.glb").read_bytes() == (tmp_path / "expected.glb").read_bytes()
