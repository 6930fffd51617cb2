"""A rig in a glTF library: turning a bone moves the surface of its limb alone."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from glsk_o3d import Skeleton, skeletonize, to_tubes
from glsk_o3d.errors import FileFormatError, InvalidCloudError, InvalidParameterError, SkeletonWarning
from glsk_o3d.io.formats.gltf import save_rig
from glsk_o3d.samples import sauropod

KINDS = {5121: "u1", 5123: "u2", 5125: "u4", 5126: "f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


def accessor(file, number):
    entry = file.accessors[number]
    view = file.bufferViews[entry.bufferView]
    data = file.binary_blob()[view.byteOffset : view.byteOffset + view.byteLength]
    return np.frombuffer(data, f"<{KINDS[entry.componentType]}").reshape(entry.count, WIDTHS[entry.type])


def world(file, turned=None):
    """Matrices of all nodes, one of which may be turned by an angle about its own x."""
    matrices = {}

    def visit(number, above):
        node, matrix = file.nodes[number], np.eye(4)
        matrix[:3, 3] = node.translation or 0
        matrix[:3, :3] = Rotation.from_quat(node.rotation or [0, 0, 0, 1]).as_matrix()
        if turned is not None and turned[0] == number:
            matrix[:3, :3] = matrix[:3, :3] @ Rotation.from_euler("x", turned[1]).as_matrix()
        matrices[number] = above @ matrix
        for child in node.children or ():
            visit(child, matrices[number])

    for root in file.scenes[file.scene].nodes:
        visit(root, np.eye(4))
    return matrices


def skinned(file, turned=None):
    """Where the skin puts the surface, as glTF 2.0, 3.7.3.3 has it."""
    matrices, skin, attributes = world(file, turned), file.skins[0], file.meshes[0].primitives[0].attributes
    inverse = accessor(file, skin.inverseBindMatrices).reshape(-1, 4, 4).transpose(0, 2, 1)
    moves = np.stack([matrices[joint] for joint in skin.joints]) @ inverse
    place = np.pad(accessor(file, attributes.POSITION), ((0, 0), (0, 1)), constant_values=1)
    weights, joints = accessor(file, attributes.WEIGHTS_0), accessor(file, attributes.JOINTS_0)
    return np.einsum("nk,nkij,nj->ni", weights, moves[joints], place)[:, :3]


@pytest.fixture
def rig(tmp_path):
    library = pytest.importorskip("pygltflib")

    def make(skeleton, mesh=None, **options):
        make.armature = save_rig(skeleton, tmp_path / "r.glb", mesh, cut_loops=True, **options)
        return library.GLTF2().load(str(tmp_path / "r.glb"))

    return make


@pytest.mark.parametrize(("up", "offset"), [("z", 4e6), ("y", 0.0)])
def test_at_rest_the_surface_and_the_joints_are_in_their_places(tree, rig, up, offset):
    cloud = np.random.default_rng(3).normal(size=(40, 3))
    moved = Skeleton(tree.vertices + offset, tree.edges, tree.radii, (), (), ())
    file = rig(moved, cloud + offset, up=up)
    turn = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]] if up == "z" else np.eye(3))
    np.testing.assert_allclose(skinned(file), (cloud + offset) @ turn.T, rtol=0, atol=1e-5)
    bones = rig.armature
    assert len({node.name for node in file.nodes}) == len(bones.edges) + 2
    heads = np.array([world(file)[joint][:3, 3] for joint in file.skins[0].joints])
    np.testing.assert_allclose(heads, bones.vertices[bones.edges[:, 0]] @ turn.T, rtol=0, atol=1e-5)


def test_turning_a_bone_moves_its_limb_alone(rig):
    fork = Skeleton([[0, 0, 0], [0, 0, 1], [0, 1, 2], [0, -1, 2]], [[0, 1], [1, 2], [1, 3]], [0.1] * 4, (), (), ())
    cloud = np.array([[0, 0, 0.2], [0, 0, 0.8], [0, 0.9, 1.9], [0, -0.9, 1.9], [0, 0.25, 1.25]])
    file = rig(fork, cloud, up="y", root=0)
    along_y = next(joint for joint in file.skins[0].joints if (world(file)[joint][:3, 3] == [0, 0, 1]).all())
    before, after = skinned(file), skinned(file, (along_y, np.pi))
    moved = np.linalg.norm(after - before, axis=1)
    np.testing.assert_allclose(moved[[0, 1]], 0, atol=1e-6)
    assert sorted(moved[[2, 3]] > 0.1) == [False, True]
    (tip,) = (i for i in (2, 3) if moved[i] > 0.1)
    np.testing.assert_allclose(after[tip], [0, -cloud[tip, 1], 2 - cloud[tip, 2]], atol=1e-6)


def test_triangles_normals_and_colours_go_along(tree, rig):
    import open3d as o3d

    mesh = to_tubes(tree, (1.0, 0.5, 0.0))
    for surface in (mesh, o3d.t.geometry.TriangleMesh.from_legacy(mesh)):
        file = rig(tree, surface)
        part = file.meshes[0].primitives[0]
        assert part.mode == 4
        np.testing.assert_array_equal(accessor(file, part.indices).reshape(-1, 3), np.asarray(mesh.triangles))
        normals = accessor(file, part.attributes.NORMAL)
        np.testing.assert_allclose(normals, np.asarray(mesh.vertex_normals), atol=1e-6)
        # sRGB's half is 0.214 in linear light
        np.testing.assert_allclose(accessor(file, part.attributes.COLOR_0)[0], [1, 0.2140, 0], atol=1e-3)
    bare = rig(tree, np.asarray(mesh.vertices)).meshes[0].primitives[0]
    assert (bare.mode, bare.attributes.NORMAL, bare.attributes.COLOR_0) == (0, None, None)


def textured_box(kind):
    """A box of two materials, one with an image whose corner at u = v = 0 is blue, as Open3D reads and holds it."""
    import open3d as o3d

    mesh = o3d.geometry.TriangleMesh.create_box(create_uv_map=True)
    image = np.full((8, 8, 3), 200, np.uint8)
    image[-1, 0] = [0, 0, 255]
    if kind == "legacy":  # Open3D holds the lowest row first
        mesh.textures = [o3d.geometry.Image(), o3d.geometry.Image(np.ascontiguousarray(image[::-1]))]
        mesh.triangle_material_ids = o3d.utility.IntVector([1] * 10 + [0] * 2)
        return mesh, image
    tensor = o3d.t.geometry.TriangleMesh.from_legacy(mesh)
    tensor.material.set_default_properties()
    tensor.material.texture_maps["albedo"] = o3d.t.geometry.Image(o3d.core.Tensor(image))
    tensor.material.scalar_properties["metallic"] = 0.25
    return tensor, image


@pytest.mark.parametrize("kind", ["legacy", "tensor"])
def test_textures_and_materials_go_along(rig, tmp_path, kind):
    trimesh = pytest.importorskip("trimesh")
    mesh, image = textured_box(kind)
    line = Skeleton([[0.5, 0.5, 0.2], [0.5, 0.5, 0.8]], [[0, 1]], [0.3, 0.3], (), (), ())
    file = rig(line, mesh, up="y")
    parts = file.meshes[0].primitives
    assert [part.material for part in parts] == ([0, 1] if kind == "legacy" else [0])
    assert file.materials[0].pbrMetallicRoughness.metallicFactor == (0 if kind == "legacy" else 0.25)
    legacy = mesh if kind == "legacy" else mesh.to_legacy()
    corners = np.concatenate([accessor(file, part.indices).ravel() for part in parts[::-1]])
    place = accessor(file, parts[0].attributes.POSITION)[corners]
    np.testing.assert_array_equal(place, np.asarray(legacy.vertices)[np.asarray(legacy.triangles).ravel()])
    uv = accessor(file, parts[0].attributes.TEXCOORD_0)[corners]
    np.testing.assert_allclose(uv, np.asarray(legacy.triangle_uvs) * [1, -1] + [0, 1], atol=1e-7)
    (shown,) = (
        part.visual
        for part in trimesh.load(tmp_path / "r.glb").geometry.values()
        if part.visual.material.baseColorTexture is not None
    )
    np.testing.assert_array_equal(np.asarray(shown.material.baseColorTexture.convert("RGB")), image)


def test_places_in_a_texture_without_one_are_kept(rig):
    import open3d as o3d

    box = o3d.geometry.TriangleMesh.create_box(create_uv_map=True)
    file = rig(Skeleton([[0.5, 0.5, 0.2], [0.5, 0.5, 0.8]], [[0, 1]], [0.3, 0.3], (), (), ()), box)
    assert file.meshes[0].primitives[0].attributes.TEXCOORD_0 is not None
    assert file.images == []


def test_an_animal_has_limbs_with_names_and_its_handle_is_cut_where_it_is_thin(rig):
    file = rig(skeletonize(sauropod(3000).points), joints=25)
    matrices = world(file)
    place = {node.name: matrices[i][:3, 3] for i, node in enumerate(file.nodes)}
    assert len(file.skins[0].joints) == len(rig.armature.edges) == 25
    for part, axis, sign in (("head.000", 0, 1), ("front_leg.001_left", 2, -1), ("hind_leg.001_right", 2, 1)):
        assert sign * place[part][axis] > 0.05  # in the file z of the cloud is y, and its y is -z
    assert place["head.000"][0] > place["neck.001"][0] > place["front_leg.001_right"][0] > place["hind_leg.001_left"][0]
    assert place["hind_leg.001_left"][0] > place["tail.002"][0]
    assert any(name.startswith("spine") for name in place)


def test_a_body_that_lies_down_is_doubted(rig):
    lying = skeletonize(np.roll(sauropod(3000).points, -1, axis=1))  # its z is y
    with pytest.warns(SkeletonWarning, match="limbs have no names with z up, but with y up: does z point up"):
        rig(lying)
    assert "head.000" in {node.name for node in rig(lying, up="y").nodes}


def test_without_radii_the_points_are_the_surface(rig):
    line = Skeleton([[0, 0, 0], [1, 0, 0]], [[0, 1]], [np.nan] * 2, [0, 1], [[0, 1, 0], [1, 1, 0]], np.ones((2, 3)))
    file = rig(line, up="y")
    np.testing.assert_allclose(skinned(file), line.points)


def test_what_cannot_be_rigged(tree, make, tmp_path):
    path, n = tmp_path / "r.glb", 65538
    chain = np.column_stack([np.arange(n), np.zeros((n, 2))]), np.column_stack([np.arange(n - 1), np.arange(1, n)])
    bare = Skeleton([[0, 0, 0], [1, 0, 0]], [[0, 1]], [np.nan] * 2, (), (), ())
    for error, noun, *arguments in (
        (FileFormatError, "no edges", make([[0, 0, 0]], []), path),
        (FileFormatError, "65535 bones", Skeleton(*chain, np.ones(n), (), (), ()), path, chain[0][[0, -1]]),
        (FileFormatError, "radii or points", bare, path),
        (FileFormatError, r"\.glb", tree, tmp_path / "r.fbx"),
        (InvalidCloudError, "not finite", tree, path, [[np.nan, 0, 0]]),
        (InvalidCloudError, "not where the skeleton is", tree, path, tree.vertices + 100),
        (InvalidCloudError, r"569\.3 large, and the skeleton .* 16\.57", tree, path, tree.vertices * 38),
        (InvalidCloudError, "same units", tree, path, tree.vertices / 2.54),
    ):
        with pytest.raises(error, match=noun):
            save_rig(*arguments)
    for noun, options in (
        ("up = 'x'", {"up": "x"}),
        (r"root = .*outside of the cloud, from \(", {"root": (0, 0, -9)}),
        ("outside", {"root": "0,99,0"}),
        ("joints = 0", {"joints": 0}),
        ("joints = 2: .* 3 bones", {"joints": 2}),
    ):
        with pytest.raises(InvalidParameterError, match=noun):
            save_rig(tree, path, **options)
    assert not list(tmp_path.iterdir())
