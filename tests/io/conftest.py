"""Fixtures for files: a cloud of Open3D, and what it means that a skeleton comes back."""

import numpy as np
import pytest

from glsk_o3d.io.formats.fields import ARRAYS, dumps


@pytest.fixture(scope="session")
def xyz():
    return np.random.default_rng(1).normal(size=(50, 3))


@pytest.fixture
def cloud(xyz):
    import open3d as o3d

    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(xyz))
    cloud.normals = o3d.utility.Vector3dVector(xyz / np.linalg.norm(xyz, axis=1, keepdims=True))
    cloud.colors = o3d.utility.Vector3dVector(np.abs(xyz) / 10)
    return cloud


@pytest.fixture(scope="session")
def assert_identical():
    """A check that two skeletons are the same in all fields, to the last bit."""

    def check(back, skeleton):
        for name in ARRAYS:
            a, b = getattr(back, name), getattr(skeleton, name)
            assert a.dtype == b.dtype, name
            assert a.shape == b.shape, name
            # To the last bit, signed zeros included; a NaN need only stay one.
            np.testing.assert_array_equal(np.where(a != a, 0, a).view("i8"), np.where(b != b, 0, b).view("i8"), name)
            np.testing.assert_array_equal(a != a, b != b, name)
        assert dumps(back.report.to_dict()) == dumps(skeleton.report.to_dict())

    return check
