"""LAS and LAZ as laspy writes them, E57 as pye57 does."""

import numpy as np
import pytest

from glsk_o3d import read_cloud
from glsk_o3d.errors import FileFormatError
from glsk_o3d.io.scans import read_scan

laspy = pytest.importorskip("laspy")
pytest.importorskip("lazrs")
PLACES = np.array([[471234.5678, 5612345.6789, 123.4567], [471235.5, 5612346.25, 130.0], [471236.0, 5612347.0, 131.5]])


def write(path, places, version="1.4", point_format=7, step=1e-4, extra=(), **dimensions):
    header = laspy.LasHeader(point_format=point_format, version=version)
    header.offsets, header.scales = np.floor(places.min(axis=0)), [step] * 3
    header.add_extra_dims([laspy.ExtraBytesParams(*dimension) for dimension in extra])
    data = laspy.LasData(header)
    data.x, data.y, data.z = places.T
    for key, values in dimensions.items():
        data[key] = values
    data.write(path)
    return path


@pytest.fixture
def las(tmp_path):
    return lambda name="c.las", **options: write(tmp_path / name, PLACES, extra=[("treeID", "uint32")], **options)


@pytest.fixture
def e57(tmp_path):
    pye57 = pytest.importorskip("pye57")

    def write(*scans, turn=(1, 0, 0, 0), place=(0, 0, 0)):
        file = pye57.E57(str(tmp_path / "c.e57"), mode="w")
        for points, fields in scans:
            columns = dict(zip(("cartesianX", "cartesianY", "cartesianZ"), points.T.copy(), strict=True))
            file.write_scan_raw(columns | fields, rotation=np.array(turn, float), translation=np.array(place, float))
        file.close()
        return tmp_path / "c.e57"

    return write


@pytest.mark.parametrize("name", ["c.las", "C.LAZ"])
@pytest.mark.parametrize(("version", "point_format"), [("1.2", 3), ("1.3", 1), ("1.4", 6), ("1.4", 7)])
def test_coordinates_keep_their_digits_and_attributes_survive(las, name, version, point_format):
    attributes = {"intensity": [7, 65535, 0], "classification": [2, 5, 5], "treeID": [0, 4, 9]}
    path = las(name, version=version, point_format=point_format, **attributes)
    scan = read_scan(path)
    np.testing.assert_allclose(scan.positions, PLACES, rtol=0, atol=1e-9)
    assert {key: values.tolist() for key, values in scan.attributes.items() if values.any()} == attributes
    assert scan.colors is None
    np.testing.assert_allclose(
        np.asarray(read_cloud(path, where="treeID > 0 and withheld == 0 and z < 131").points), PLACES[1:2]
    )


@pytest.mark.parametrize(("top", "scale"), [(65535, 65535), (255, 255), (1, 255)])
def test_colours_of_sixteen_bits_and_of_eight(las, top, scale):
    cloud = read_cloud(las(red=[0, top, 0], green=[top] * 3, blue=[0, 0, 0]))
    np.testing.assert_allclose(np.asarray(cloud.colors), np.array([[0, 1, 0], [1, 1, 0], [0, 1, 0]]) * top / scale)


def test_e57_scans_stand_where_their_poses_put_them(e57):
    near = np.array([[1.0, 0, 0], [0, 2.5, 0], [0, 0, 3]])
    half = np.sqrt(0.5)  # a quarter turn about z
    scan = read_scan(e57((near, {}), (near + 1, {}), turn=(half, 0, 0, half), place=PLACES[0]))
    turned = np.array([[0, 1, 0], [-2.5, 0, 0], [0, 0, 3]])
    expected = np.concatenate([turned, turned + [-1, 1, 1]]) + PLACES[0]
    np.testing.assert_allclose(scan.positions, expected, rtol=0, atol=1e-8)
    assert scan.attributes["scan"].tolist() == [0, 0, 0, 1, 1, 1]


def test_e57_has_the_attributes_of_all_its_scans(e57):
    grey, intensity = np.array([0, 51, 255]), np.array([0.0, 0.25, 1.0])
    colors = dict.fromkeys(("colorRed", "colorGreen", "colorBlue"), grey)
    scan = read_scan(e57((np.eye(3), colors | {"intensity": intensity})))
    np.testing.assert_allclose(scan.colors, np.tile(grey[:, None] / 255, 3))
    np.testing.assert_allclose(scan.attributes["intensity"], intensity)
    scan = read_scan(e57((np.eye(3), {}), (np.eye(3), {"intensity": intensity})))
    assert list(scan.attributes) == ["scan"]


@pytest.mark.parametrize("name", ["c.las", "c.laz", "c.e57"])
def test_damaged_and_empty_files(las, e57, name):
    path = e57((PLACES, {})) if name == "c.e57" else las(name)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with pytest.raises(FileFormatError, match=rf"{name}: (not a valid|no points could be read)"):
        read_cloud(path)
    if name == "c.e57":
        e57()
    else:
        laspy.LasData(laspy.LasHeader(point_format=3, version="1.2")).write(path)
    with pytest.raises(FileFormatError, match=rf"{name}: no points could be read"):
        read_cloud(path)


def with_number(data, at, number, length=4):
    return data[:at] + number.to_bytes(length, "little") + data[at + length :]


@pytest.mark.parametrize(
    ("place", "number", "length"),
    [("records", 2**31, 4), ("chunks", 0, 4), ("chunks", 2**31, 4), ("table", 2**40, 8), ("layer", 2**31, 4)],
)
def test_what_no_packed_file_holds_is_refused(las, place, number, length):
    """For some of it lazrs would end the process, for some laspy would not come back."""
    path = las("c.laz")
    data = path.read_bytes()
    start = int.from_bytes(data[96:100], "little")
    table = int.from_bytes(data[start : start + 8], "little")
    places = {"records": 100, "chunks": table + 4, "table": len(data), "layer": start + 52}
    data = with_number(data + table.to_bytes(8, "little"), start, 2**64 - 1, 8)  # the table was written last
    path.write_bytes(data)
    assert len(read_scan(path)) == 3
    path.write_bytes(with_number(data, places[place], number, length))
    with pytest.raises(FileFormatError, match="promise"):
        read_scan(path)


@pytest.mark.parametrize("point_format", [0, 6])
def test_a_flat_grid_is_packed_well_and_read(tmp_path, point_format):
    grid = np.indices((600, 600, 1)).reshape(3, -1).T * 1.0
    path = write(tmp_path / "s.laz", grid, point_format=point_format, step=0.01)
    assert path.stat().st_size < 600 * 600 / 32
    assert len(read_scan(path).positions) == 600 * 600


@pytest.mark.parametrize(
    ("point_format", "n"), [*((i, 1) for i in (0, 1, 3, 6, 7, 8, 9, 10)), (3, 110_000), (7, 110_000)]
)
def test_sound_packed_files_are_read_whatever_their_points_hold(tmp_path, point_format, n):
    places, extra = np.random.default_rng(0).normal(size=(n, 3)), [("treeID", "uint32"), ("three", "3u1")]
    path = write(tmp_path / "s.laz", places, point_format=point_format, step=1e-6, extra=extra, treeID=np.arange(n))
    scan = read_scan(path)
    np.testing.assert_allclose(scan.positions, places, rtol=0, atol=1e-6)
    np.testing.assert_array_equal(scan.attributes["treeID"], np.arange(n))
