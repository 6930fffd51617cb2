"""`glsk rig`: what it writes is what `save_rig` writes, and what it refuses it refuses first."""

import numpy as np
import open3d as o3d
import pytest

from glsk_o3d import Skeleton, read_skeleton, save_rig
from glsk_o3d.io.scans import read_mesh


@pytest.fixture
def octahedron(tmp_path):
    mesh = o3d.geometry.TriangleMesh.create_octahedron()
    for ending in ("ply", "obj", "stl"):
        mesh.compute_triangle_normals()
        assert o3d.io.write_triangle_mesh(str(tmp_path / f"mesh.{ending}"), mesh, write_triangle_uvs=False)
    return mesh


@pytest.fixture
def cloud(tmp_path):
    points = np.random.default_rng(3).normal(size=(40, 3))
    np.savetxt(tmp_path / "cloud.xyz", points)
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    assert o3d.io.write_point_cloud(str(tmp_path / "cloud.ply"), cloud)
    return points


@pytest.fixture
def ring(tmp_path):
    turn = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    circle = np.column_stack([np.cos(turn), np.sin(turn), 0 * turn])
    Skeleton(circle, [*((i, i + 1) for i in range(11)), (0, 11)], np.full(12, 0.1), (), (), ()).save(tmp_path / "o.ply")
    return "o.ply"


@pytest.mark.parametrize("ending", ["ply", "obj", "stl"])
@pytest.mark.usefixtures("octahedron")
def test_a_mesh_hangs_on_the_bones(invoke, tmp_path, y, ending):
    result = invoke("rig", y, f"mesh.{ending}", "-o", "r.glb", "--root", "0,0,-0.5", "--up", "y")
    assert (result.exit_code, result.stderr) == (0, "")
    skeleton, mesh = read_skeleton(tmp_path / y), read_mesh(tmp_path / f"mesh.{ending}")
    told = f"{len(skeleton.edges)} bones move {len(mesh.vertices)} vertices and 8 triangles\nwrote r.glb\n"
    assert result.stdout == told
    save_rig(skeleton, tmp_path / "expected.glb", mesh, root=(0, 0, -0.5), up="y")
    assert (tmp_path / "r.glb").read_bytes() == (tmp_path / "expected.glb").read_bytes()


@pytest.mark.parametrize("ending", ["ply", "xyz"])
def test_a_cloud_hangs_on_the_bones(invoke, tmp_path, y, cloud, ending):
    result = invoke("rig", y, f"cloud.{ending}", "-o", "r.glb", "--root", "2")
    assert f" bones move {len(cloud)} points\n" in result.stdout
    save_rig(read_skeleton(tmp_path / y), tmp_path / "expected.glb", cloud, root=2)
    assert (tmp_path / "r.glb").read_bytes() == (tmp_path / "expected.glb").read_bytes()


def test_alone_it_has_its_tubes(invoke, tmp_path, y):
    result = invoke("rig", y, "-o", "r.glb", "-q")
    assert (result.exit_code, result.output) == (0, "")
    save_rig(read_skeleton(tmp_path / y), tmp_path / "expected.glb")
    assert (tmp_path / "r.glb").read_bytes() == (tmp_path / "expected.glb").read_bytes()


def test_loops_are_cut_if_one_says_so(invoke, refused, ring, tmp_path):
    assert "1 loop(s): pass cut_loops=True to drop" in refused(1, "rig", ring, "-o", "r.glb")
    result = invoke("rig", ring, "-o", "r.glb", "--cut-loops")
    assert result.stdout == "11 bones move the skeleton's own surface\nwrote r.glb\n"
    save_rig(read_skeleton(tmp_path / ring), tmp_path / "expected.glb", cut_loops=True)
    assert (tmp_path / "r.glb").read_bytes() == (tmp_path / "expected.glb").read_bytes()


@pytest.mark.parametrize(
    ("code", "words", "message"),
    [
        (2, ["y.ply"], "nothing to write: give one output with -o"),
        (2, ["none.ply", "-o", "r.fbx"], "r.fbx: the rig is binary glTF and its name ends in .glb"),
        (2, ["y.ply", "-o", "r.glb", "--up", "x"], "up = 'x': must be one of z, y"),
        (2, ["y.ply", "r.glb", "-o", "r.glb"], "r.glb: is an input: choose another name"),
        (1, ["none.ply", "-o", "no/r.glb"], "no: no such folder: make it before writing r.glb"),
        (1, ["none.ply", "-o", "r.glb"], "none.ply: no such file"),
        (1, ["y.ply", "none.ply", "-o", "r.glb"], "none.ply: no such file"),
        (1, ["y.ply", "y.ply", "-o", "r.glb"], "y.ply: is a skeleton, not a scan"),
        (1, ["cloud.ply", "-o", "r.glb"], "cloud.ply: is a cloud, not a skeleton: make one with glsk_o3d.skeletonize"),
        (1, ["y.ply", "junk.ply", "-o", "r.glb"], "junk.ply: not a valid .ply file: it does not start with 'ply'"),
        (1, ["y.ply", "nan.xyz", "-o", "r.glb"], "nan.xyz: the surface has points that are not finite: drop them"),
        (1, ["bare.obj", "-o", "r.glb"], "a rig needs radii or points: read the skeleton from"),
        (2, ["y.ply", "-o", "r.glb", "--root", "up"], "root = 'up': must be an axis, x to -z, 'thickest', a vertex"),
        (2, ["y.ply", "-o", "r.glb", "--root", "99"], "root = 99: there are vertices 0 to "),
    ],
)
@pytest.mark.usefixtures("cloud")
def test_refuses(refused, tmp_path, y, code, words, message):
    (tmp_path / "junk.ply").write_text("hello")
    (tmp_path / "nan.xyz").write_text("0 0 0\n0 nan 1\n")
    read_skeleton(tmp_path / y).save(tmp_path / "bare.obj")
    assert refused(code, "rig", *words).startswith(message)
