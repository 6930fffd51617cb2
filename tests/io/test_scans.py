"""Scans from files: whole or in blocks they are the same, and of one that is damaged nothing is believed."""

import os

import numpy as np
import open3d as o3d
import pytest
import trimesh

from glsk_o3d import save_skeleton
from glsk_o3d.errors import FileFormatError, InvalidCloudError, InvalidParameterError, SkeletonWarning
from glsk_o3d.io.formats import ply as tables
from glsk_o3d.io.formats.text_tables import holds_points
from glsk_o3d.io.paths import CLOUD_ENDINGS, MESH_ENDINGS
from glsk_o3d.io.scans import promised_points, read_blocks, read_cloud, read_mesh, read_scan, read_tensor_cloud
from glsk_o3d.io.skeletons import READABLE, read_skeleton, read_truth


@pytest.mark.parametrize("name", ["c.ply", "c.pcd", "c.xyz", "c é.Pcd"])
@pytest.mark.parametrize("options", [{}, {"write_ascii": True}, {"compressed": True}], ids=str)
def test_clouds_that_open3d_writes(cloud, xyz, tmp_path, name, options):
    kind = name.lower().split(".")[1]
    assert o3d.io.write_point_cloud(str(tmp_path / f"plain.{kind}"), cloud, **options)
    (tmp_path / f"plain.{kind}").rename(tmp_path / name)
    back = read_cloud(tmp_path / name)
    np.testing.assert_allclose(np.asarray(back.points), xyz, rtol=1e-5)  # six digits in text
    assert back.has_normals() == (kind != "xyz")
    assert back.has_colors() == (kind != "xyz")


@pytest.mark.parametrize("ending", ["obj", "stl", "ply", "off"])
@pytest.mark.parametrize(("resolution", "coarse"), [(5, True), (40, False)])
def test_meshes_give_their_vertices_or_a_sample(tmp_path, ending, resolution, coarse):
    mesh, path = o3d.geometry.TriangleMesh.create_sphere(2.0, resolution), tmp_path / f"m.{ending}"
    mesh.compute_vertex_normals()
    o3d.io.write_triangle_mesh(str(path), mesh)
    centres = (np.asarray(m.vertices)[np.asarray(m.triangles)].mean(axis=1) for m in (read_mesh(path), mesh))
    np.testing.assert_allclose(*(np.sort(rows, axis=0) for rows in centres), atol=1e-3)
    assert len(read_scan(path)) >= len(mesh.vertices)
    assert (len(read_cloud(path).points) == 25000) == coarse


def test_a_sample_has_what_a_corner_has(tmp_path):
    mesh = o3d.geometry.TriangleMesh.create_box(1, 2, 3)
    path = tmp_path / "m.ply"
    corners = np.asarray(mesh.vertices)
    tables.save(path, {"positions": corners, "label": (corners[:, 0] == 0).astype(np.int32)}, mesh.triangles)
    cloud = read_tensor_cloud(path)
    places, normals = cloud.point.positions.numpy(), cloud.point.normals.numpy()
    side = np.argmax(np.abs(normals), axis=1)
    np.testing.assert_allclose(np.abs(normals).sum(axis=1), 1)
    outer = np.where(normals.sum(axis=1) > 0, np.array([1, 2, 3])[side], 0)
    np.testing.assert_allclose(places[np.arange(len(places)), side], outer, atol=1e-12)  # they point outward
    label = cloud.point.label.numpy()[:, 0]
    assert (label[normals[:, 0] == -1] == 1).all()
    assert (label[normals[:, 0] == 1] == 0).all()
    half = read_scan(path, "x > 0.5")
    assert (len(half), len(half.triangles)) == (4, 2)
    np.testing.assert_allclose(half.positions[half.triangles][..., 0], 1)


def test_a_scene_of_several_nodes(tmp_path):
    scene = trimesh.Scene()
    for place, size in (((0, 0, 0), 1), ((5, 0, 0), 2), ((0, -7, 0), 0.5)):
        box = trimesh.creation.box(bounds=[[0, 0, 0], [1, 1, 1]])
        scene.add_geometry(box, transform=trimesh.transformations.translation_matrix(place) @ np.diag([*[size] * 3, 1]))
    scene.export(tmp_path / "s.glb")
    scan = read_scan(tmp_path / "s.glb")
    assert (len(scan), len(scan.triangles)) == (24, 36)
    np.testing.assert_allclose(scan.positions.min(axis=0), [0, -7, 0])
    np.testing.assert_allclose(scan.positions.max(axis=0), [7, 2, 2])


@pytest.mark.parametrize("head", ["OFF\n", "OFF\n# of quads\n\n"])
def test_off_with_polygons(tmp_path, head):
    faces = ["4 0 1 3 2", "4 4 6 7 5", "4 0 4 5 1", "4 2 3 7 6", "3 0 2 6", "3 0 6 4", "4 1 5 7 3 255 0 0"]
    corners = [f"{x} {y} {z}" for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    (tmp_path / "m.off").write_text(head + "8 7 0\n" + "\n".join([*corners, *faces]) + "\n")
    scan = read_scan(tmp_path / "m.off")
    a, b, c = (scan.positions[corner] for corner in scan.triangles.T)
    assert len(scan) == 8
    np.testing.assert_allclose(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2, 6)


# -------------------------------------------------------------------------------------------------------- what is none


def test_what_is_no_mesh(cloud, tmp_path):
    o3d.io.write_point_cloud(str(tmp_path / "c.ply"), cloud)
    with pytest.raises(FileFormatError, match=r"c\.ply.* cloud"):
        read_mesh(tmp_path / "c.ply")
    with pytest.raises(FileFormatError, match=r"m\.xyz.*\.ply.*\.stl"):
        read_mesh(tmp_path / "m.xyz")


@pytest.mark.parametrize("name", [f"s{ending}" for ending in READABLE] + ["c.md", "c.bin"])
def test_what_is_no_scan(skeleton, tmp_path, name):
    error = r"is a skeleton" if name in ("s.ply", "s.obj") else r"unknown ending; .*\.ply.*\.pcd"
    save_skeleton(skeleton, tmp_path / (name if name[0] == "s" else "c.ply"), cut_loops=True)
    if name[0] == "c":
        (tmp_path / "c.ply").rename(tmp_path / name)
    with pytest.raises(FileFormatError, match=rf"{name}: {error}"):
        read_cloud(tmp_path / name)


@pytest.mark.parametrize("ending", CLOUD_ENDINGS + MESH_ENDINGS)
@pytest.mark.parametrize(
    "data", [b"", b"1 2\n4 5\n", b"hello world\nthis is text\n", bytes(range(256)) * 4, b"\0" * 500]
)
def test_files_without_a_cloud(tmp_path, capfd, ending, data):
    (tmp_path / f"c{ending}").write_bytes(data)
    with pytest.raises(FileFormatError, match=rf"c\{ending}"):
        read_cloud(tmp_path / f"c{ending}")
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("read", [read_skeleton, read_cloud, read_truth, read_blocks])
def test_what_is_no_file_or_may_never_end(tmp_path, read):
    with pytest.raises(FileNotFoundError, match=r"none\.ply"):
        read(tmp_path / "none.ply")
    (tmp_path / "folder.ply").mkdir()
    with pytest.raises(FileFormatError, match=r"folder\.ply.* is a folder"):
        read(str(tmp_path / "folder.ply"))
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "pipe.ply")
        (tmp_path / "zero.ply").symlink_to("/dev/zero")
        for name in ("pipe.ply", "zero.ply"):
            assert not holds_points(tmp_path / name)
            with pytest.raises(FileFormatError, match=f"{name}: is a pipe or a device"):
                read(tmp_path / name)


# -------------------------------------------------------------------------------------------------------------- blocks

N = 53
RANDOM = np.random.default_rng(5)
XYZ = RANDOM.normal(size=(N, 3)) + [400000, 0, 0]
LABEL = np.where(np.arange(N) < 30, 0, np.arange(N)).astype(np.int32)  # 0 in the first blocks
KINDS = {"f8": "double", "f4": "float", "i4": "int", "u2": "ushort", "u1": "uchar"}


def ply(colors="u1", top=255, order="little", before="", after=""):
    def write(folder):
        shades = (RANDOM.random((N, 3)) * top).astype(colors)
        shades[-1] = top
        columns = dict(zip("xyz", XYZ.T, strict=True)) | dict(zip(("red", "green", "blue"), shades.T, strict=True))
        columns |= dict(zip(("nx", "ny", "nz"), XYZ.T.astype(np.float32), strict=True)) | {"label": LABEL}
        table = np.empty(N, [(name, values.dtype.newbyteorder(order)) for name, values in columns.items()])
        head = f"ply\nformat binary_{order}_endian 1.0\n{before}element vertex {N}\n"
        for name, values in columns.items():
            table[name] = values
            head += f"property {KINDS[values.dtype.str[1:]]} {name}\n"
        (folder / "c.ply").write_bytes(
            f"{head}{after}end_header\n".encode() + b"\0" * 8 * bool(before) + table.tobytes()
        )
        return folder / "c.ply"

    return write


def las(name, point_format, top=65535):
    def write(folder):
        laspy = pytest.importorskip("laspy")
        header = laspy.LasHeader(point_format=point_format, version="1.4")
        header.offsets, header.scales = np.floor(XYZ.min(axis=0)), [1e-4] * 3
        header.add_extra_dim(laspy.ExtraBytesParams("label", type="int32"))
        data = laspy.LasData(header)
        data.x, data.y, data.z = XYZ.T
        data.label = LABEL
        if "red" in data.point_format.dimension_names:
            data.red = np.where(np.arange(N) == N - 1, top, 0)  # seen in the last block alone
        data.write(folder / name)
        return folder / name

    return write


def open3d(name, **options):
    def write(folder):
        cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(XYZ))
        cloud.normals = o3d.utility.Vector3dVector(XYZ / np.linalg.norm(XYZ, axis=1, keepdims=True))
        cloud.colors = o3d.utility.Vector3dVector(RANDOM.random((N, 3)))
        o3d.io.write_point_cloud(str(folder / name), cloud, **options)
        return folder / name

    return write


FILES = {
    "PLY": ply(),
    "PLY big-endian": ply("u2", 40000, order="big"),
    "PLY, float colours": ply("f4", 1),
    "PLY, something before": ply(before="element camera 1\nproperty double focus\n"),
    "PLY, no faces": ply(after="element face 0\nproperty list uchar int vertex_indices\n"),
    "PCD": open3d("c.pcd"),
    "PCD text": open3d("c.pcd", write_ascii=True),
    "LAS": las("c.las", 7),
    "LAS, colours unset": las("c.las", 7, top=0),
    "LAZ": las("c.laz", 6),
    "LAZ, colours of 8 bits": las("c.LAZ", 7, top=200),
}


def assert_same(blocks, scan):
    def columns(blocks):
        arrays = [{"positions": b.positions, "colors": b.colors, "normals": b.normals, **b.attributes} for b in blocks]
        names = [name for name, values in arrays[0].items() if values is not None]
        return {name: np.concatenate([block[name] for block in arrays]) for name in names}

    joined, expected = columns(blocks), columns([scan])
    assert joined.keys() == expected.keys()
    for name, values in expected.items():
        assert joined[name].dtype == values.dtype, name
        np.testing.assert_array_equal(joined[name], values, name)


@pytest.mark.parametrize("make", FILES.values(), ids=FILES)
def test_blocks_joined_are_the_file(tmp_path, make):
    path = make(tmp_path)
    scan, where = read_scan(path), "x > 400000.2 and y > 0"
    assert promised_points(path) == len(scan) == N
    for rows in (1, 10, N, 1000):
        blocks = list(read_blocks(path, rows=rows))
        assert [len(block) for block in blocks] == [min(rows, N - begin) for begin in range(0, N, rows)]
        assert_same(blocks, scan)
    for condition, expected in ((None, scan), (where, scan[scan.chosen(where)])):
        bare = list(read_blocks(path, rows=10, where=condition, bare=True))
        assert condition or all(block.colors is None and not block.attributes for block in bare)
        np.testing.assert_array_equal(np.concatenate([block.positions for block in bare]), expected.positions)
    chosen = list(read_blocks(path, rows=7, where=where))
    assert all(0 < len(block) <= 7 for block in chosen)
    assert_same(chosen, read_scan(path, where))


@pytest.mark.parametrize("name", ["c.ply", "c.pcd", "c.xyz"])
def test_other_files_are_one_block(tmp_path, name):
    path = open3d(name, write_ascii=name == "c.ply", compressed=name == "c.pcd")(tmp_path)
    assert promised_points(path) is None
    assert_same(list(read_blocks(path, rows=10)), read_scan(path))


def test_conditions_that_make_no_sense(tmp_path):
    path = FILES["PLY"](tmp_path)
    with pytest.raises(InvalidCloudError, match="no point with x > 500000"):
        list(read_blocks(path, rows=7, where="x > 500000"))
    with pytest.raises(InvalidParameterError, match=r"x = 1.*compare attributes"):
        read_blocks(path, where="x = 1")


def stl(folder):
    mesh = o3d.geometry.TriangleMesh.create_sphere(1.0, 6).compute_triangle_normals()
    o3d.io.write_triangle_mesh(str(folder / "m.stl"), mesh)
    return folder / "m.stl"


OTHERS = {"STL": stl, "PLY text": open3d("c.ply", write_ascii=True), "PCD compressed": open3d("c.pcd", compressed=True)}


@pytest.mark.parametrize("name", [*FILES, *OTHERS])
def test_files_that_break_off_anywhere_are_refused(tmp_path, capfd, name):
    path = (FILES | OTHERS)[name](tmp_path)
    whole = path.read_bytes()
    last = whole.rstrip(b"\n").rfind(b"\n") if "text" in name else len(whole) - (40 if name[0] == "L" else 1)
    for cut in {*range(0, last, max(1, len(whole) // 60)), last}:
        path.write_bytes(whole[:cut])
        for read in (read_scan, lambda path: list(read_blocks(path, rows=10))):
            with pytest.raises(FileFormatError, match=path.name):
                read(path)
    assert capfd.readouterr() == ("", "")
    if name in ("PLY", "PCD", "LAS"):  # there is no block at all
        path.write_bytes(whole[:-60])
        with pytest.raises(FileFormatError, match=r"promises 53 points and holds 5[012]: it is truncated"):
            read_blocks(path, rows=10)


def test_a_cloud_is_not_sampled_by_area(tmp_path):
    np.savetxt(tmp_path / "cloud.xyz", np.random.default_rng(0).random((50, 3)))
    with pytest.warns(SkeletonWarning, match="sample = 20: the file has no triangles"):
        assert len(read_cloud(tmp_path / "cloud.xyz", sample=20).points) == 50
