"""What a worker does with one cloud."""

import numpy as np
import pytest

from glsk_o3d import pipelines, read_skeleton, save_tensor_cloud, skeletonize, to_recipe
from glsk_o3d.batch.tasks import Task, work
from glsk_o3d.io import streaming
from glsk_o3d.io.clouds import blocks
from glsk_o3d.samples import torus


@pytest.mark.parametrize("where", ["", "x > -100"])
def test_a_large_cloud_is_read_in_blocks(tmp_path, monkeypatch, where):
    import open3d as o3d

    points = torus(120000).points
    save_tensor_cloud(o3d.t.geometry.PointCloud(o3d.core.Tensor(points)), tmp_path / "scan.ply")
    monkeypatch.setattr(streaming, "LARGE_CLOUD", 100000)
    monkeypatch.setitem(blocks.read_blocks.__kwdefaults__, "rows", 30000)
    recipe = to_recipe(pipelines.default())
    path = str(tmp_path / "scan.ply")
    row = work(Task("scan", path, path, ("s.json",), out_dir=str(tmp_path), recipe=recipe, where=where))
    assert (row["error"], row["points"], row["loops"]) == ("", 120000, 1)
    found = read_skeleton(tmp_path / "s.json")
    assert len(found.points) == row["sampled"] < 60000
    np.testing.assert_allclose(found.vertices, skeletonize(points).vertices, rtol=0, atol=1e-9)
