"""``glsk edit``, ``glsk convert`` and ``glsk rig``."""

import json

import numpy as np
import open3d as o3d
import pytest

from glsk_o3d import Skeleton, read_skeleton, save_rig, save_skeleton, skeletonize
from glsk_o3d.cli.options import SKELETON_ENDINGS, TREE_ENDINGS
from glsk_o3d.io.scans import read_mesh
from glsk_o3d.io.skeletons import FORMATS
from glsk_o3d.samples import sauropod


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
    words = ["--largest", "--cut-loops", "--root", "x", "--prune-length", "0.5", "--simplify", "0.6"]
    result = invoke("edit", file, "-o", "new.swc", "-o", "new.json", *words)
    assert result.exit_code == 0, result.output
    counts, first, second = result.stdout.splitlines()
    assert counts.startswith("vertices 17 -> 6, edges 16 -> 5, components 2 -> 1, loops 1 -> 0, ")
    assert (first, second) == ("wrote new.swc", "wrote new.json")
    new = read_skeleton(tmp_path / "new.json")
    facts = json.loads(invoke("edit", file, "-o", "again.json", *words, "--json").stdout)
    assert [facts[when]["vertices"] for when in ("before", "after")] == [17, 6]
    assert facts["files"] == ["again.json"]
    assert (new.n_components, new.n_loops, new.vertices[0, 0]) == (1, 0, new.vertices[:, 0].min())
    assert read_skeleton(tmp_path / "new.swc").length == pytest.approx(new.length)
    assert invoke("edit", file, "-o", "same.ply").stdout == "all counts are as before\nwrote same.ply\n"
    assert invoke("edit", file, "-o", "new.ply", "--simplify", 10, "-q").output == ""
    assert read_skeleton(tmp_path / "new.ply").n_loops == 1


def test_detail_is_turned(invoke, tmp_path):
    save_skeleton(skeletonize(sauropod(2000).points), tmp_path / "animal.json")
    result = invoke("edit", "animal.json", "-o", "less.json", "--limb", 1)
    assert "leaves 6 -> 0" in result.stdout
    assert len(read_skeleton(tmp_path / "less.json").leaves) == 0
    assert "leaves 0 -> 6" in invoke("edit", "less.json", "-o", "more.json", "--limb", 0.5).stdout
    save_skeleton(read_skeleton(tmp_path / "less.json"), tmp_path / "plain.ply")
    seen = invoke("edit", "less.json", "--limb", 0, "--preview", "more.png", "--report", "more.html")
    assert seen.stdout.splitlines()[1:] == ["wrote more.png", "wrote more.html"]
    refused = invoke("edit", "plain.ply", "-o", "same.json", "--limb", 0)
    assert refused.exit_code == 1
    assert "plain.ply: holds no decisions about limbs" in refused.output
    assert "less than or equal to 1" in invoke("edit", "less.json", "-o", "more.json", "--limb", 1.5).output


def test_convert(invoke, file, tmp_path):
    result = invoke("convert", file, "a.ply", "-o", "a.obj")
    assert result.stdout == "wrote a.ply\nwrote a.obj\n"
    for name in ("a.ply", "a.obj"):
        assert read_skeleton(tmp_path / name).n_loops == 1
    assert invoke("convert", file, "a.swc", "--cut-loops", "--json").stdout == '{\n  "files": [\n    "a.swc"\n  ]\n}\n'


@pytest.fixture
def line(tmp_path):
    """Three edges along x, from the thin end to the thick one."""
    along, edges = [[x, 0, 0] for x in range(-1, 3)], [(0, 1), (1, 2), (2, 3)]
    save_skeleton(Skeleton(along, edges, [0.1, 0.2, 0.3, 0.4], (), (), ()), tmp_path / "line.json")
    return "line.json"


@pytest.mark.parametrize(("word", "x"), [("x", -1), ("thickest", 2), ("1", 0), ("-0.9,0.1,0", -1)])
def test_a_root_in_all_words(invoke, line, tmp_path, word, x):
    names = [f"t.{name}" for name in ("swc", "urdf", "glb")]
    outputs = [item for name in (*names, "e.json") for item in ("-o", name)]
    assert invoke("edit", line, *outputs, "--root", word).stderr == ""
    for name in names:
        save_skeleton(read_skeleton(line), tmp_path / f"expected-{name}", root=[x, 0, 0])
        assert (tmp_path / name).read_bytes() == (tmp_path / f"expected-{name}").read_bytes()
    assert read_skeleton("e.json").vertices[0].tolist() == [x, 0, 0]


def test_formats_of_trees_are_those_of_the_table():
    assert {ending for ending, format in FORMATS.items() if format.trees} == {f".{ending}" for ending in TREE_ENDINGS}
    assert set(FORMATS) == {f".{ending}" for ending in SKELETON_ENDINGS}


@pytest.mark.parametrize("ending", ["ply", "obj", "stl", "xyz"])
def test_a_mesh_or_a_cloud_hangs_on_the_bones(invoke, tmp_path, y, ending):
    file = tmp_path / f"surface.{ending}"
    octahedron = o3d.geometry.TriangleMesh.create_octahedron(0.5)
    octahedron.compute_triangle_normals()
    if ending == "xyz":
        surface = np.random.default_rng(3).uniform(-0.5, 0.5, size=(40, 3))
        np.savetxt(file, surface)
    else:
        assert o3d.io.write_triangle_mesh(str(file), octahedron, write_triangle_uvs=False)
        surface = read_mesh(file)
    result = invoke("rig", y, file, "-o", "r.glb", "--root", "0,0,-0.5", "--up", "y")
    bones = save_rig(read_skeleton(tmp_path / y), tmp_path / "expected.glb", surface, root=(0, 0, -0.5), up="y")
    assert result.stdout == f"{len(bones.edges)} bones\nwrote r.glb\n"
    assert (tmp_path / "r.glb").read_bytes() == (tmp_path / "expected.glb").read_bytes()
    facts = json.loads(invoke("rig", y, "-o", "r.glb", "--json").stdout)
    assert facts == {"bones": len(bones.edges), "files": ["r.glb"]}
    few = invoke("rig", y, file, "-o", "few.glb", "--joints", 4, "--symmetric")
    save_rig(read_skeleton(tmp_path / y), tmp_path / "expected.glb", surface, joints=4, symmetric=True)
    assert few.stdout == "3 bones\nwrote few.glb\n"
    assert (tmp_path / "few.glb").read_bytes() == (tmp_path / "expected.glb").read_bytes()
    assert "outside of the cloud" in invoke("rig", y, file, "-o", "far.glb", "--root", "9,9,9").output


@pytest.mark.parametrize("ending", ["obj", "glb"])
def test_the_texture_of_a_mesh_goes_into_its_rig(invoke, tmp_path, y, ending):
    trimesh, images = pytest.importorskip("trimesh"), pytest.importorskip("PIL.Image")
    pixels = np.random.default_rng(1).integers(0, 256, (4, 4, 3), np.uint8)
    box = o3d.geometry.TriangleMesh.create_box(create_uv_map=True).translate([-0.5, -0.5, -0.5])
    corners, uv = np.asarray(box.vertices)[np.asarray(box.triangles)].reshape(-1, 3), np.asarray(box.triangle_uvs)
    look = trimesh.visual.TextureVisuals(uv=uv, image=images.fromarray(pixels))
    mesh = trimesh.Trimesh(corners, np.arange(36).reshape(-1, 3), process=False, visual=look)
    mesh.export(tmp_path / f"box.{ending}")
    assert invoke("rig", y, f"box.{ending}", "-o", "r.glb").exit_code == 0
    (rigged,) = trimesh.load(tmp_path / "r.glb").geometry.values()
    np.testing.assert_array_equal(rigged.visual.material.baseColorTexture.convert("RGB"), pixels)
    known = np.column_stack([corners, uv])
    written = np.column_stack([rigged.vertices, rigged.visual.uv])
    assert {*map(tuple, written.round(5) + 0)} == {*map(tuple, known.round(5) + 0)}


def test_a_rig_alone_has_its_tubes_and_loops_are_cut_if_one_says_so(invoke, ring_file, tmp_path):
    assert invoke("rig", ring_file, "-o", "r.glb", "--cut-loops").exit_code == 0
    save_rig(read_skeleton(tmp_path / ring_file), tmp_path / "expected.glb", cut_loops=True)
    assert (tmp_path / "r.glb").read_bytes() == (tmp_path / "expected.glb").read_bytes()
