import subprocess
import sys
from importlib.metadata import PackageNotFoundError
from pathlib import Path

import numpy as np
import pytest

from glsk_o3d import samples, skeletonize
from glsk_o3d.errors import InvalidCloudError, MissingPackageError
from glsk_o3d.interop import clouds as door
from glsk_o3d.recipes.catalogue import catalogue

XYZ = np.random.default_rng(3).normal(size=(9, 3))


@pytest.fixture(scope="module")
def o3d():
    return door.import_open3d()


def clouds(o3d):
    """Every kind of cloud, made of `XYZ`, with the type that its numbers go through."""
    vector, tensor = o3d.utility.Vector3dVector, o3d.core.Tensor
    yield "legacy cloud", o3d.geometry.PointCloud(vector(XYZ)), np.float64
    yield "legacy mesh", o3d.geometry.TriangleMesh(vector(XYZ), o3d.utility.Vector3iVector()), np.float64
    yield "vector", vector(XYZ), np.float64
    for dtype in (np.float32, np.float64):
        yield "tensor", tensor(XYZ.astype(dtype)), dtype
        yield "tensor cloud", o3d.t.geometry.PointCloud(tensor(XYZ.astype(dtype))), dtype
        mesh = o3d.t.geometry.TriangleMesh()
        mesh.vertex.positions = tensor(XYZ.astype(dtype))
        yield "tensor mesh", mesh, dtype


def test_open3d_clouds_give_their_points_as_float64(o3d):
    for name, cloud, dtype in clouds(o3d):
        points = door.cloud_points(cloud)
        assert points.dtype == np.float64, name
        assert points.flags.c_contiguous, name
        np.testing.assert_array_equal(points, XYZ.astype(dtype), err_msg=name)


@pytest.mark.parametrize("dtype", ["f2", "f4", "f8", "g", "i1", "i8", "u4", ">f8"])
def test_arrays_of_real_numbers(dtype):
    given = (10 * np.abs(XYZ)).astype(dtype)
    np.testing.assert_array_equal(door.cloud_points(given), given.astype(float))


def test_array_likes():
    np.testing.assert_array_equal(door.cloud_points([(0, 1, 2)]), [[0.0, 1.0, 2.0]])
    np.testing.assert_array_equal(door.cloud_points(np.asfortranarray(XYZ)), XYZ)
    np.testing.assert_array_equal(door.cloud_points(XYZ[::-2]), XYZ[::-2])
    assert np.isnan(door.cloud_points([[np.nan, 0, 0]])[0, 0])


def test_result_is_a_copy(o3d):
    given = XYZ.copy()
    given.setflags(write=False)
    points = door.cloud_points(given)
    assert points.flags.writeable
    assert not np.shares_memory(points, given)
    for name, cloud, _ in clouds(o3d):
        first = door.cloud_points(cloud)
        first += 1
        np.testing.assert_allclose(door.cloud_points(cloud), XYZ, atol=1e-6, err_msg=name)


def test_subclass_of_a_cloud(o3d):
    class Scan(o3d.geometry.PointCloud):
        pass

    np.testing.assert_array_equal(door.cloud_points(Scan(o3d.utility.Vector3dVector(XYZ))), XYZ)


@pytest.mark.parametrize(
    "cloud",
    [
        None,
        7,
        "scan",
        object(),
        {"points": XYZ},
        XYZ[0],
        XYZ[:, :2],
        XYZ[None],
        np.hstack([XYZ, XYZ]),
        XYZ > 0,
        XYZ * 1j,
        XYZ.astype(object),
        XYZ.astype(str),
        [[1, 2, 3], [4, 5]],
        (row for row in XYZ),
        np.zeros(3, "f8,f8,f8"),
        np.zeros((2, 3), "M8[s]"),
        np.ma.masked_greater(XYZ, 0),
    ],
    ids=lambda cloud: type(cloud).__name__,
)
def test_what_is_no_cloud_is_refused(cloud):
    with pytest.raises(InvalidCloudError):
        door.cloud_points(cloud)


def test_refusals_say_what_was_given_and_what_is_accepted(tmp_path, o3d):
    with pytest.raises(InvalidCloudError, match=r"ndarray of shape \(9, 2\) and dtype float64.*\(N, 3\) array"):
        door.cloud_points(XYZ[:, :2])
    with pytest.raises(InvalidCloudError, match=r"glsk_o3d\.read_cloud"):
        door.cloud_points(tmp_path / "scan.ply")
    with pytest.raises(InvalidCloudError, match="Open3D LineSet"):
        door.cloud_points(o3d.geometry.LineSet())
    with pytest.raises(InvalidCloudError, match="Open3D LineSet"):
        door.cloud_points(o3d.t.geometry.LineSet())


def test_empty_clouds_are_refused(o3d):
    geometries = [g.PointCloud() for g in (o3d.geometry, o3d.t.geometry)]
    geometries += [g.TriangleMesh() for g in (o3d.geometry, o3d.t.geometry)]
    for cloud in (*geometries, [], np.empty((0, 3)), np.empty((0, 3), int)):
        with pytest.raises(InvalidCloudError, match="is empty"):
            door.cloud_points(cloud)


def test_an_array_does_not_import_open3d():
    code = (
        "import sys, numpy; from glsk_o3d.interop import open3d, files, meshlab, preview\n"
        "open3d.cloud_points(numpy.ones((4, 3)))\n"
        "assert not {'open3d', 'pymeshlab', 'matplotlib', 'networkx'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_point_cloud(o3d):
    cloud = door.to_point_cloud(XYZ[:, ::-1])
    assert isinstance(cloud, o3d.geometry.PointCloud)
    np.testing.assert_array_equal(np.asarray(cloud.points), XYZ[:, ::-1])


def test_line_set(skeleton, o3d):
    lines = skeleton.to_line_set()
    assert isinstance(lines, o3d.geometry.LineSet)
    np.testing.assert_array_equal(np.asarray(lines.points), skeleton.vertices)
    np.testing.assert_array_equal(np.asarray(lines.lines).reshape(-1, 2), skeleton.edges)
    np.testing.assert_array_equal(
        np.asarray(door.to_line_set(skeleton, (0, 0.5, 1)).colors).reshape(-1, 3),
        np.tile([0, 0.5, 1], (len(skeleton.edges), 1)),
    )


def test_tensor_line_set(skeleton, o3d):
    lines = skeleton.to_tensor_line_set()
    assert isinstance(lines, o3d.t.geometry.LineSet)
    assert lines.point.positions.dtype == o3d.core.float64
    np.testing.assert_array_equal(lines.point.positions.numpy(), skeleton.vertices)
    np.testing.assert_array_equal(lines.point.radius.numpy(), skeleton.radii[:, None])
    assert set(lines.point) == {"positions", "radius", "confidence"}
    assert lines.point.confidence.dtype == o3d.core.float64
    np.testing.assert_array_equal(lines.point.confidence.numpy(), skeleton.confidence[:, None])
    np.testing.assert_array_equal(lines.line.indices.numpy(), skeleton.edges)
    legacy = lines.to_legacy()
    np.testing.assert_array_equal(np.asarray(legacy.lines).reshape(-1, 2), skeleton.edges)


def test_line_sets_do_not_alias_the_skeleton(tree):
    before = tree.vertices.copy()
    tensor, legacy = tree.to_tensor_line_set(), tree.to_line_set()
    tensor.point.positions += 1
    legacy.translate((1, 1, 1))
    np.testing.assert_array_equal(tree.vertices, before)


@pytest.mark.parametrize(
    ("error", "says"),
    [
        (ModuleNotFoundError("No module named 'open3d'", name="open3d"), 'pip install "open3d>=0.18"$'),
        (ModuleNotFoundError("No module named 'dash'", name="dash"), "damaged.*dash.*--force-reinstall .open3d>=0.18"),
        (ImportError("libusb-1.0.so.0: cannot open shared object file: No such file"), "apt-get install libusb-1.0-0"),
        (OSError("libGL.so.1: cannot open shared object file: No such file"), "libGL.so.1.*apt-get install libgl1"),
        (ImportError("libX11.so.6: cannot open shared object file"), "apt-get install libx11-6"),
        (ImportError("libgomp.so.1: cannot open shared object file"), "apt-get install libgomp1"),
        (ImportError("libodd-2.so.7: cannot open shared object file"), "install the system library libodd-2"),
    ],
)
def test_missing_open3d_says_what_to_install(monkeypatch, error, says):
    def fail(name):
        raise error

    monkeypatch.setattr("importlib.import_module", fail)
    with pytest.raises(MissingPackageError, match=says) as caught:
        door.import_open3d()
    assert "open3d" in str(caught.value)
    assert caught.value.__cause__ is error


def test_every_package_that_may_lack_is_asked_for_as_in_our_metadata(monkeypatch):
    def fail(name):
        raise ModuleNotFoundError(name, name=name)

    def none(name):
        raise PackageNotFoundError

    wanted = (Path(__file__).parents[2] / "pyproject.toml").read_text()
    monkeypatch.setattr("importlib.import_module", fail)
    for words in (["pymeshlab"], ["distributed"], ["matplotlib"], ["networkx"], ["igl", "libigl"]):
        with pytest.raises(MissingPackageError) as caught:
            door.require(*words)
        assert f'"{str(caught.value).split(chr(34))[1]}"' in wanted
        assert f'pip install "{words[-1]}>=' in str(caught.value)
    monkeypatch.setattr(door, "requires", none)
    with pytest.raises(MissingPackageError, match=r'pip install "libigl"$'):
        door.require("igl", "libigl")


def test_filters_take_every_kind_of_cloud_and_leave_it_alone(o3d):
    points = samples.torus(200).points
    for name, make, dtype in (
        ("legacy", lambda: o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points)), np.float64),
        ("float32", lambda: o3d.t.geometry.PointCloud(o3d.core.Tensor(points.astype(np.float32))), np.float32),
        ("float64", lambda: o3d.t.geometry.PointCloud(o3d.core.Tensor(points)), np.float64),
        ("mesh", lambda: o3d.geometry.TriangleMesh(o3d.utility.Vector3dVector(points), o3d.utility.Vector3iVector()),
         np.float64),
    ):  # fmt: skip
        cloud, expected = make(), points.astype(dtype).astype(float)
        for consumer in (cls() for cls in catalogue().values() if getattr(cls, "consumes", None) == "cloud"):
            found, plain = consumer(cloud), consumer(expected)
            np.testing.assert_array_equal(found.positions, plain.positions, err_msg=name)
            np.testing.assert_array_equal(found.rings.indices, plain.rings.indices, err_msg=name)
        np.testing.assert_array_equal(skeletonize(cloud).vertices, skeletonize(expected).vertices, err_msg=name)
        np.testing.assert_array_equal(door.cloud_points(cloud), expected)
