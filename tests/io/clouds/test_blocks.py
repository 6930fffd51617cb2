"""Blocks of a file, joined, are the file; of one that is damaged none is believed."""

import numpy as np
import pytest

from glsk_o3d.errors import FileFormatError, InvalidCloudError, InvalidParameterError
from glsk_o3d.io.scans import read_blocks
from glsk_o3d.io.scans import read_cloud, read_scan

N = 53
RANDOM = np.random.default_rng(5)
XYZ = RANDOM.normal(size=(N, 3)) + [400000, 0, 0]
LABEL = np.where(np.arange(N) < 30, 0, np.arange(N)).astype(np.int32)  # unset in the first blocks
PLY_KINDS = {"<f8": "double", "<f4": "float", "<i4": "int", "<u2": "ushort", "|u1": "uchar", ">f8": "double"}


def write_ply(path, columns, before="", after="", order="little"):
    row = np.dtype([(name, values.dtype.newbyteorder("<" if order == "little" else ">")) for name, values in columns])
    table = np.empty(N, row)
    for name, values in columns:
        table[name] = values
    kinds = [PLY_KINDS[values.dtype.newbyteorder("<").str] for _, values in columns]
    properties = "".join(f"property {kind} {name}\n" for kind, (name, _) in zip(kinds, columns, strict=True))
    head = f"ply\nformat binary_{order}_endian 1.0\n{before}element vertex {N}\n{properties}{after}end_header\n"
    path.write_bytes(head.encode() + (b"\0" * 8 if before else b"") + table.tobytes())
    return path


def plain(colors=np.uint8, top=255):
    shades = (RANDOM.random((N, 3)) * top).astype(colors)
    shades[-1] = top
    return [
        *zip("xyz", XYZ.T, strict=True),
        *zip(("red", "green", "blue"), shades.T, strict=True),
        *zip(("nx", "ny", "nz"), XYZ.T.astype(np.float32), strict=True),
        ("label", LABEL),
    ]


def las(path, point_format, version="1.4", top=65535):
    laspy = pytest.importorskip("laspy")
    header = laspy.LasHeader(point_format=point_format, version=version)
    header.offsets, header.scales = np.floor(XYZ.min(axis=0)), [1e-4] * 3
    header.add_extra_dim(laspy.ExtraBytesParams("label", type="int32"))
    data = laspy.LasData(header)
    data.x, data.y, data.z = XYZ.T
    data.label = LABEL
    if "red" in data.point_format.dimension_names:
        data.red = np.where(np.arange(N) == N - 1, top, 0)  # seen in the last block alone
    data.write(path)
    return path


def open3d(path, **options):
    import open3d as o3d

    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(XYZ))
    cloud.normals = o3d.utility.Vector3dVector(XYZ / np.linalg.norm(XYZ, axis=1, keepdims=True))
    cloud.colors = o3d.utility.Vector3dVector(RANDOM.random((N, 3)))
    o3d.io.write_point_cloud(str(path), cloud, **options)
    return path


def text(path):
    np.savetxt(path, XYZ)
    return path


CAMERA = "element camera 1\nproperty double focus\n"
FILES = {
    "PLY": lambda folder: write_ply(folder / "c.ply", plain()),
    "PLY big-endian": lambda folder: write_ply(folder / "c.ply", plain(), order="big"),
    "PLY, colours of 16 bits": lambda folder: write_ply(folder / "c.ply", plain(np.uint16, 40000)),
    "PLY, colours of 8 bits in 16": lambda folder: write_ply(folder / "c.ply", plain(np.uint16, 255)),
    "PLY, float colours": lambda folder: write_ply(folder / "c.ply", plain(np.float32, 1)),
    "PLY, something before": lambda folder: write_ply(folder / "c.ply", plain(), before=CAMERA),
    "PLY, no faces": lambda folder: write_ply(
        folder / "c.ply", plain(), after="element face 0\nproperty list uchar int vertex_indices\n"
    ),
    "PCD": lambda folder: open3d(folder / "c.pcd"),
    "PCD text": lambda folder: open3d(folder / "c.pcd", write_ascii=True),
    "LAS 1.2": lambda folder: las(folder / "c.las", 3, "1.2"),
    "LAS": lambda folder: las(folder / "c.las", 7),
    "LAS, colours of 8 bits": lambda folder: las(folder / "c.las", 7, top=255),
    "LAS, colours unset": lambda folder: las(folder / "c.las", 7, top=0),
    "LAZ": lambda folder: las(folder / "c.laz", 6),
    "LAZ, colours of 8 bits": lambda folder: las(folder / "c.LAZ", 7, top=200),
    "LAZ 1.2": lambda folder: las(folder / "c.laz", 3, "1.2"),
}
WHOLE = {
    "PLY text": lambda folder: open3d(folder / "c.ply", write_ascii=True),
    "PCD compressed": lambda folder: open3d(folder / "c.pcd", compressed=True),
    "text": lambda folder: text(folder / "c.xyz"),
}


def columns(blocks):
    """All that blocks hold, one after the other, by name; and what is unset in all of them."""
    blocks = list(blocks)
    held = [{"positions": b.positions, "colors": b.colors, "normals": b.normals, **b.attributes} for b in blocks]
    names = [name for name, values in held[0].items() if values is not None]
    joined = {name: np.concatenate([each[name] for each in held]) for name in names}
    return joined, frozenset.intersection(*(block.unset for block in blocks))


def assert_same(blocks, scan):
    (found, unset), (expected, nobody_gave) = columns(blocks), columns([scan])
    assert found.keys() == expected.keys()
    for name, values in expected.items():
        assert found[name].dtype == values.dtype, name
        np.testing.assert_array_equal(found[name], values, name)
    assert unset == nobody_gave


@pytest.mark.parametrize("make", FILES.values(), ids=FILES)
@pytest.mark.parametrize("rows", [1, 10, N, 1000])
def test_blocks_joined_are_the_file(tmp_path, make, rows):
    path = make(tmp_path)
    blocks = list(read_blocks(path, rows=rows))
    assert [len(block) for block in blocks] == [min(rows, N - begin) for begin in range(0, N, rows)]
    assert_same(blocks, read_scan(path))


@pytest.mark.parametrize("make", FILES.values(), ids=FILES)
def test_bare_blocks_are_the_positions(tmp_path, make):
    path = make(tmp_path)
    bare, _ = columns(read_blocks(path, rows=10, bare=True))
    assert [*bare] == ["positions"]
    np.testing.assert_array_equal(bare["positions"], read_scan(path).positions)
    chosen, _ = columns(read_blocks(path, rows=10, bare=True, where="y > 0"))
    np.testing.assert_array_equal(chosen["positions"], read_scan(path, "y > 0").positions)


@pytest.mark.parametrize("make", WHOLE.values(), ids=WHOLE)
def test_other_files_are_one_block(tmp_path, make):
    path = make(tmp_path)
    (block,) = read_blocks(path, rows=10)
    assert_same([block], read_scan(path))


def test_a_mesh_is_one_block_with_its_triangles(tmp_path):
    import open3d as o3d

    path = tmp_path / "m.ply"
    o3d.io.write_triangle_mesh(str(path), o3d.geometry.TriangleMesh.create_sphere(1.0, 6))
    (block,) = read_blocks(path, rows=10)
    assert len(block.triangles) > 100
    np.testing.assert_array_equal(block.triangles, read_scan(path).triangles)
    assert_same([block], read_scan(path))


@pytest.mark.parametrize("name", ["PLY", "PCD", "LAS", "LAZ"])
def test_conditions_choose_in_blocks_as_in_the_whole(tmp_path, name):
    path = FILES[name](tmp_path)
    where = "x > 400000.2 and y > 0"
    blocks = list(read_blocks(path, rows=7, where=where))
    assert all(0 < len(block) <= 7 for block in blocks)
    assert_same(blocks, read_scan(path, where))
    with pytest.raises(InvalidCloudError, match="no point with x > 500000"):
        list(read_blocks(path, rows=7, where="x > 500000"))
    with pytest.raises(InvalidParameterError, match="colour"):
        list(read_blocks(path, rows=7, where="colour == 1"))
    with pytest.raises(InvalidParameterError, match=r"x = 1.*write such as"):
        read_blocks(path, where="x = 1")


@pytest.mark.parametrize("name", FILES)
def test_files_that_break_off_are_refused_as_when_read_whole(tmp_path, name):
    path = FILES[name](tmp_path)
    whole = path.read_bytes()
    cut = whole.rstrip(b"\n").rfind(b"\n") if name == "PCD text" else len(whole) - (40 if "L" in name[0] else 1)
    for left in (cut, cut // 2, 200, 4):
        path.write_bytes(whole[:left])
        with pytest.raises(FileFormatError, match=path.name) as expected:
            read_cloud(path)
        with pytest.raises(FileFormatError, match=path.name) as found:
            list(read_blocks(path, rows=10))
        if path.suffix.lower() != ".laz" and name != "PCD text":  # these say where in the block it was
            assert str(found.value) == str(expected.value)


@pytest.mark.parametrize("name", ["PLY", "PCD", "LAS"])
def test_binary_files_that_break_off_give_no_block_at_all(tmp_path, name):
    path = FILES[name](tmp_path)
    path.write_bytes(path.read_bytes()[:-60])
    with pytest.raises(FileFormatError, match=r"promises 53 points and holds 5[012]: it breaks off"):
        next(read_blocks(path, rows=10))


@pytest.mark.parametrize("rows", [0, -3, 2.5, True])
def test_rows_are_whole_numbers(tmp_path, rows):
    with pytest.raises(InvalidParameterError, match="rows ="):
        read_blocks(FILES["PLY"](tmp_path), rows=rows)


def test_files_that_are_not_there_or_no_scans_are_refused_at_once(tmp_path):
    with pytest.raises(FileNotFoundError):
        read_blocks(tmp_path / "none.las")
    with pytest.raises(FileFormatError, match="folder"):
        read_blocks(tmp_path)
    (tmp_path / "a.doc").write_text("1 2 3")
    with pytest.raises(FileFormatError, match="unknown ending"):
        read_blocks(tmp_path / "a.doc")
