"""The readers of other people's data: tiny files of each kind, made up here, and what is bad in them."""

import numpy as np
import open3d as o3d
import pytest
from glsk_bench import read_folder
from glsk_studies import external

from glsk_o3d import Skeleton, samples

STUDY = external

FORK = samples.y_junction(2000)
BRANCHES = "v 0 0 0\nv 0 4 0\nv 0 8 0\nv 0 4 0\nv 3 7 0\nv 0 4 0\nv 0 7 3\nl 1 2 3\nl 4 5\nl 6 7\n"
SWC = "# made up\n1 0 0 0 0 6 -1\n2 0 20 0 0 5 1\n3 0 40 0 0 4 2\n4 0 30 20 0 3 2\n5 0 40 40 5 2 4\n"


def write_ply(path, points):
    path.parent.mkdir(parents=True, exist_ok=True)
    assert o3d.io.write_point_cloud(str(path), o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points)))


def shape_of(made, name):
    """Components, loops, leaves and junctions of an axis."""
    truth = made.truth(name)
    skeleton = Skeleton(truth.nodes, truth.edges, truth.radii, (), (), ())
    return skeleton.n_components, skeleton.n_loops, len(skeleton.leaves), len(skeleton.junctions)


@pytest.fixture
def trees(tmp_path):
    """A tree of three branches, its cloud in two resolutions."""
    nodes = np.array([[0, 0, 0], [0, 4, 0], [0, 8, 0], [3, 7, 0], [0, 7, 3]], float)
    cones = nodes, np.array([[0, 1], [1, 2], [1, 3], [1, 4]]), np.full(5, 0.3)
    points = samples.capsules.union_sample("tree", *cones, 3000, 0.0, 0).points
    for res, n in ((50, 1000), (150, 3000)):
        write_ply(tmp_path / f"data/scan_ply/tree_small_7_res_{res}.ply", points[:n])
    (tmp_path / "data/scan_skel").mkdir()
    (tmp_path / "data/scan_skel/tree_small_7.obj").write_text(BRANCHES)
    return tmp_path / "data"


def test_branches_of_trees_are_welded_where_they_begin(call, trees, tmp_path):
    assert "1 shapes, 2 clouds" in call("trees", trees, "-o", tmp_path / "bench")
    benchmark = read_folder(tmp_path / "bench")
    assert [(cloud.name, cloud.family) for cloud in benchmark.clouds] == [
        (f"tree_small_7_res{res}", "small") for res in (50, 150)
    ]
    assert shape_of(benchmark, "tree_small_7") == (1, 0, 4, 1)
    truth = benchmark.truth("tree_small_7")
    assert (len(truth.nodes), len(truth.edges)) == (5, 4)
    np.testing.assert_allclose(truth.radii, 0.3, rtol=0.05)
    call("trees", trees, "-o", tmp_path / "bench", "--only", "tree_small_*")
    assert read_folder(tmp_path / "bench") == benchmark
    call("trees", trees, "-o", tmp_path / "bench", "--only", "tree_large_*", code=2)


@pytest.fixture
def plants(tmp_path):
    """Two plants, one with labels."""
    for kind, name in (("maize", "03-13"), ("tomato", "03-13")):
        (tmp_path / "data" / kind).mkdir(parents=True)
        label = " 2.0" if kind == "maize" else ""
        lines = [f"v {x} {y} {z}{label}" for x, y, z in 50 * FORK.nodes] + [f"e {a} {b}" for a, b in FORK.edges]
        (tmp_path / "data" / kind / f"{name}.graph.txt").write_text("\n".join(["# D:3", *lines]) + "\n")
    write_ply(tmp_path / "data/maize/03-13.ply", 50 * FORK.points)
    np.savetxt(tmp_path / "data/tomato/03-13.xyz", 50 * FORK.points)
    return tmp_path / "data"


def test_graphs_of_plants_are_read_with_clouds_of_both_kinds(call, plants, tmp_path):
    out = call("plants", plants, "-o", tmp_path / "bench")
    assert "2 shapes, 2 clouds" in out
    assert "left out" not in out
    benchmark = read_folder(tmp_path / "bench")
    assert [(cloud.name, cloud.family) for cloud in benchmark.clouds] == [
        ("maize-03-13_scan", "maize"),
        ("tomato-03-13_scan", "tomato"),
    ]
    for name in benchmark.shapes:
        assert shape_of(benchmark, name) == (1, 0, 3, 1)
        np.testing.assert_allclose(np.median(benchmark.truth(name).radii), 50 * np.median(FORK.radii), rtol=0.1)


def test_a_bad_graph_is_named(call, plants, tmp_path):
    (plants / "maize/03-13.graph.txt").write_text("v 0 0 0\nv 1 1 1\ne 0 2\n")
    (plants / "tomato/03-13.xyz").unlink()
    out = call("plants", plants, "-o", tmp_path / "bench", code=1)
    for said in ("0 shapes, 0 clouds", "03-13.graph.txt: not a valid graph", "03-13.ply or .xyz: no such cloud"):
        assert said in out


@pytest.fixture
def vessels(tmp_path):
    (tmp_path / "data/some one").mkdir(parents=True)
    (tmp_path / "data/some one/a.CNG.swc").write_text(SWC)
    return tmp_path / "data"


def test_clouds_of_vessels_are_drawn_of_the_round_cones(call, vessels, tmp_path):
    words = ("vessels", vessels, "-o", tmp_path / "bench", "--variants", "clean,noise1", "--points", 1000)
    assert "1 shapes, 2 clouds" in call(*words)
    assert "left out" not in call(*words)  # the same again
    benchmark = read_folder(tmp_path / "bench")
    (name,) = benchmark.shapes
    assert name == "some-one-a.CNG"
    assert shape_of(benchmark, name) == (1, 0, 3, 1)
    truth = benchmark.truth(name)
    low, high = truth.nodes - truth.radii[:, None], truth.nodes + truth.radii[:, None]
    assert np.linalg.norm(high.max(axis=0) - low.min(axis=0)) == pytest.approx(1)
    points = np.asarray(o3d.io.read_point_cloud(str(benchmark.clouds[0].path)).points)
    assert len(points) == 1000
    assert np.abs(samples.signed_distance(points, truth.nodes, truth.edges, truth.radii)).max() < 1e-4


def centrelines():
    """Three lines from one inlet that part at z = 0 and z = 4; the last comes near to the first again later."""
    t = np.linspace(-10, 10, 201)
    rng = np.random.default_rng(0)
    aside, later = np.maximum(t, 0), np.maximum(t - 4, 0)
    back = np.where(t < 5, aside, np.maximum(5 - (t - 5), 0.1))
    paths = [(0 * t, 0 * t), (0 * t, -later), (back, 0 * t)]
    return [np.column_stack([x, y, t]) + rng.normal(0, 0.02, (201, 3)) for x, y in paths]


def test_lines_are_joined_where_they_part_and_not_where_they_touch():
    nodes, forks = np.vstack(centrelines()), []
    split = np.split(np.arange(603), 3)
    for order in ((0, 1, 2), (2, 0, 1), (1, 2, 0)):
        edges = external.joined(nodes, np.ones(603), [split[i] for i in order])
        degree = np.bincount(edges.ravel(), minlength=603)
        assert ((degree == 1).sum(), (degree == 3).sum(), (degree > 3).sum()) == (4, 2, 0)
        assert len(edges) == (degree > 0).sum() - 1  # one tree
        forks.append(np.sort(nodes[degree == 3, 2]))
    np.testing.assert_allclose(forks, [[0.5, 4.5]] * 3, atol=0.3)
