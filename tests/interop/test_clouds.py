import subprocess
import sys

import numpy as np
import pytest

from glsk_o3d import RingBuilder
from glsk_o3d.errors import InvalidCloudError
from glsk_o3d.interop.clouds import cloud_counts, cloud_points
from glsk_o3d.interop.packages import import_open3d

XYZ = np.random.default_rng(3).normal(size=(9, 3))


@pytest.fixture(scope="module")
def o3d():
    return import_open3d()


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


def test_open3d_clouds_give_a_copy_of_their_points_as_float64(o3d):
    for name, cloud, dtype in (*clouds(o3d), ("array", XYZ, np.float64)):
        for _ in range(2):
            points = cloud_points(cloud)
            assert points.dtype == np.float64, name
            assert points.flags.c_contiguous, name
            np.testing.assert_array_equal(points, XYZ.astype(dtype), err_msg=name)
            points += 1


def test_arrays_and_array_likes_of_real_numbers(o3d):
    class Scan(o3d.geometry.PointCloud):
        pass

    for dtype in ("f2", "f4", "g", "i1", "i8", "u4", ">f8"):
        array = (10 * np.abs(XYZ)).astype(dtype)
        np.testing.assert_array_equal(cloud_points(array), array.astype(float))
    for cloud in (XYZ.tolist(), np.asfortranarray(XYZ), Scan(o3d.utility.Vector3dVector(XYZ))):
        np.testing.assert_array_equal(cloud_points(cloud), XYZ)
    np.testing.assert_array_equal(cloud_points(XYZ[::-2]), XYZ[::-2])
    assert np.isnan(cloud_points([[np.nan, 0, 0]])[0, 0])


@pytest.mark.parametrize(
    "cloud",
    [
        *(None, 7, "scan", object(), {"points": XYZ}, [[1, 2, 3], [4, 5]], (row for row in XYZ)),
        *(XYZ[0], XYZ[:, :2], XYZ[None], np.hstack([XYZ, XYZ])),
        *(XYZ > 0, XYZ * 1j, XYZ.astype(object), XYZ.astype(str), np.zeros(3, "f8,f8,f8"), np.zeros((2, 3), "M8[s]")),
        np.ma.masked_greater(XYZ, 0),
    ],
    ids=lambda cloud: type(cloud).__name__,
)
def test_what_is_no_cloud_is_refused(cloud):
    with pytest.raises(InvalidCloudError, match=r"read_cloud" if isinstance(cloud, str) else "cloud"):
        cloud_points(cloud)


def test_other_and_empty_geometries_are_refused(o3d):
    for geometry in (o3d.geometry, o3d.t.geometry):
        with pytest.raises(InvalidCloudError, match="Open3D LineSet"):
            cloud_points(geometry.LineSet())
        for cloud in (geometry.PointCloud(), geometry.TriangleMesh(), [], np.empty((0, 3)), np.empty((0, 3), int)):
            with pytest.raises(InvalidCloudError, match="empty"):
                cloud_points(cloud)


@pytest.mark.parametrize(
    "counts",
    [[[np.inf]], [[np.nan]], [[1e-4]], [[0]], [[-3]], [[2.0**63]], [[2.0**60]], [[1, 1]]],  # 2^60 nine times
    ids=str,
)
def test_counts_that_are_none_are_refused(o3d, counts):
    cloud = o3d.t.geometry.PointCloud(o3d.core.Tensor(XYZ))
    cloud.point.sample_count = o3d.core.Tensor(np.repeat(np.array(counts, float), len(XYZ), axis=0))
    with pytest.raises(InvalidCloudError, match="attribute sample_count"):
        RingBuilder()(cloud)


def test_counts_are_of_any_real_type(o3d):
    cloud = o3d.t.geometry.PointCloud(o3d.core.Tensor(XYZ))
    finite = np.arange(9) < 6
    assert cloud_counts(cloud, finite) == (None, 6, 3)
    for dtype in ("i4", "u1", "i8", "f4"):
        cloud.point.sample_count = o3d.core.Tensor(np.arange(1, 10).astype(dtype)[:, None])
        counts, n, others = cloud_counts(cloud, finite)
        np.testing.assert_array_equal(counts, np.arange(1, 7))
        assert (n, others) == (21, 24)
    cloud.point.sample_count = o3d.core.Tensor(np.full((9, 1), 2.0**59))
    assert RingBuilder()(cloud).report.n_input == 9 * 2**59


def test_an_array_does_not_import_open3d():
    code = (
        "import sys, numpy, glsk_o3d.io.scans, glsk_o3d.io.annotation, glsk_o3d.apps.meshlab.verbs\n"
        "from glsk_o3d.interop.clouds import cloud_points\n"
        "cloud_points(numpy.ones((4, 3)))\n"
        "assert not {'open3d', 'pymeshlab', 'matplotlib', 'networkx'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
