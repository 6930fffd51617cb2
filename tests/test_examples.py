"""The examples, run as they are."""

import csv
import runpy
import sys

import numpy as np
import open3d as o3d
import pytest

from glsk_o3d import read_skeleton, samples
from glsk_o3d.analysis import segment

RNG = np.random.default_rng(0)
SCENE = np.concatenate(
    [
        samples.y_junction(3000).points + [0, 0, 0.7],
        samples.torus(3000).points + [1.4, 0, 0.6],
        np.column_stack([RNG.uniform(-1, 2.5, (2000, 2)), np.full(2000, -0.01)]),
        RNG.uniform([-1, -1, 0.05], [2.5, 1, 1.5], (30, 3)),
    ]
)


def write_scene(path, dtype):
    """Two objects above the ground, and outliers."""
    scene = o3d.t.geometry.PointCloud(o3d.core.Tensor(SCENE.astype(dtype)))
    scene.point.intensity = o3d.core.Tensor(SCENE[:, 2:].astype(np.float32))
    assert o3d.t.io.write_point_cloud(str(path), scene)


@pytest.mark.parametrize(("api", "dtype"), [("legacy", "f8"), ("tensor", "f4")])
def test_open3d_pipeline(root, tmp_path, monkeypatch, capsys, api, dtype):
    write_scene(tmp_path / "scene.ply", dtype)
    example = root / "examples" / "open3d_pipeline.py"
    folder = tmp_path / "out"
    monkeypatch.setattr(sys, "argv", [str(example), str(tmp_path / "scene.ply"), str(folder), api])
    runpy.run_path(str(example), run_name="__main__")
    names = ("cloud.ply", "longest.ply", "skeleton.json", "lines.ply", "tubes.ply", "branches.csv")
    assert {path.name for path in folder.iterdir()} == {f"{i}_{name}" for i in range(2) for name in names}
    assert capsys.readouterr().out.count("\nobject ") == 2
    shapes = set()
    for i in range(2):
        skeleton = read_skeleton(folder / f"{i}_skeleton.json")
        shapes.add((skeleton.n_loops, len(skeleton.leaves)))
        cloud = o3d.t.io.read_point_cloud(str(folder / f"{i}_cloud.ply"))
        positions = cloud.point.positions.numpy()
        assert positions.dtype == cloud.point.radius.numpy().dtype == (dtype if api == "tensor" else "f8")
        assert positions[:, 2].min() > 0  # the ground is gone
        np.testing.assert_array_equal(positions, skeleton.points)
        np.testing.assert_array_equal(cloud.point.branch.numpy()[:, 0], segment(skeleton))
        with (folder / f"{i}_branches.csv").open(newline="") as stream:
            rows = list(csv.DictReader(stream))
        longest = max(range(len(rows)), key=lambda row: float(rows[row]["length"]))
        part = o3d.t.io.read_point_cloud(str(folder / f"{i}_longest.ply"))
        assert (part.point.branch.numpy() == longest).all()
        assert len(o3d.io.read_line_set(str(folder / f"{i}_lines.ply")).colors) == len(skeleton.edges)
        assert o3d.io.read_triangle_mesh(str(folder / f"{i}_tubes.ply")).has_vertex_colors()
    assert shapes == {(1, 0), (0, 3)}
