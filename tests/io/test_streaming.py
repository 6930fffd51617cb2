"""From file to file without the cloud in memory: the same sample, skeleton and labels."""

import tracemalloc

import numpy as np
import open3d as o3d
import pytest

from glsk_o3d import annotate, annotate_file, pipelines, read_cloud, read_sample, read_tensor_cloud, skeletonize
from glsk_o3d.errors import FileFormatError, InvalidCloudError, InvalidParameterError
from glsk_o3d.io import streaming
from glsk_o3d.io.formats import ply
from glsk_o3d.io.scans import read_blocks
from glsk_o3d.samples import torus, y_junction

N = 110000
LABELS = ("skeleton_vertex", "branch", "order", "radius", "confidence", "colors")


@pytest.fixture(autouse=True)
def small_blocks(monkeypatch):
    monkeypatch.setitem(read_blocks.__kwdefaults__, "rows", 9973)


@pytest.fixture(scope="module")
def points():
    return y_junction(N, noise=0.003).points


@pytest.fixture(scope="module")
def ring():
    return skeletonize(torus(1000).points)


def save(points, path, **attributes):
    cloud = o3d.t.geometry.PointCloud(o3d.core.Tensor(points))
    for name, values in attributes.items():
        cloud.point[name] = o3d.core.Tensor(values)
    assert o3d.t.io.write_point_cloud(str(path), cloud)


@pytest.fixture(scope="module")
def scans(points, tmp_path_factory):
    """The same points as PLY, PCD, LAS and LAZ, with a label, and in the first two with colours."""
    laspy, folder = pytest.importorskip("laspy"), tmp_path_factory.mktemp("scans")
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales = [1e-5] * 3
    data = laspy.LasData(header)
    data.x, data.y, data.z = points.T
    data.classification = np.where(points[:, 2] > 0, 5, 2)
    for ending in ("las", "laz"):
        data.write(folder / f"scan.{ending}")
    colors = np.random.default_rng(1).integers(0, 256, (N, 3)).astype(np.uint8)
    label = np.asarray(data.classification, np.int32)[:, None]
    for ending in ("ply", "pcd"):
        places = np.column_stack([data.x, data.y, data.z])
        save(places, folder / f"scan.{ending}", colors=colors, classification=label)
    return folder


@pytest.fixture(scope="module")
def skeleton(scans):
    """That of a sample."""
    return skeletonize(read_sample(scans / "scan.las"))


# -------------------------------------------------------------------------------------------------------------- sample


def test_the_skeleton_of_a_file_is_that_of_its_cloud(scans, skeleton):
    whole = skeletonize(read_cloud(scans / "scan.las"))
    assert 30000 < len(skeleton.points) < 60000
    np.testing.assert_allclose(skeleton.vertices, whole.vertices, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(skeleton.edges, whole.edges)
    assert skeleton.report.n_input == whole.report.n_input == N
    assert skeleton.report.n_sampled == whole.report.n_sampled == len(skeleton.points)
    for ending in ("ply", "pcd", "laz"):
        sample = read_sample(scans / f"scan.{ending}").point
        np.testing.assert_array_equal(sample.positions.numpy(), skeleton.points)
        assert int(sample.sample_count.numpy().sum()) == N


def test_a_sample_of_another_size_and_with_a_condition(scans, points):
    sample = read_sample(scans / "scan.ply", n=3000, where="classification == 5")
    assert 2000 < len(sample.point.positions) < 4500
    assert int(sample.point.sample_count.numpy().sum()) == (points[:, 2] > 0).sum()
    whole = read_sample(scans / "scan.ply", n=N)
    np.testing.assert_array_equal(whole.point.positions.numpy(), np.asarray(read_cloud(scans / "scan.ply").points))
    for n in (0, 2.5, True):
        with pytest.raises(InvalidParameterError, match=f"n = {n}"):
            read_sample(scans / "scan.ply", n=n)


def test_points_that_are_not_finite(tmp_path, points, monkeypatch):
    spoilt, path = points.copy(), tmp_path / "c.ply"
    spoilt[20000:20010] = np.nan
    save(spoilt, path)
    with pytest.raises(InvalidCloudError, match=f"10 of {N} points .*index 20000"):
        read_sample(path)
    pipeline = pipelines.default().with_options(drop_invalid=True)
    whole = pipeline(read_cloud(path))
    monkeypatch.setattr(streaming, "LARGE_CLOUD", N - 1)
    sampled = pipeline(streaming.points_for(pipeline, path))
    for report in (whole.report, sampled.report):
        assert (report.n_input, report.n_dropped, report.n_sampled) == (N, 10, len(sampled.points) - 1)
    np.testing.assert_allclose(sampled.vertices, whole.vertices, rtol=0, atol=1e-9)
    assert annotate_file(sampled, path, tmp_path / "out.ply") == N
    marked = read_tensor_cloud(tmp_path / "out.ply").point
    np.testing.assert_array_equal(np.flatnonzero(marked.branch.numpy() == -1), np.arange(20000, 20010))
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(marked.radius.numpy())), np.arange(20000, 20010))
    spoilt[:] = np.nan
    save(spoilt, path)
    with pytest.raises(InvalidCloudError, match="no point with finite coordinates"):
        read_sample(path, drop_invalid=True)
    with pytest.raises(InvalidCloudError, match=f"none of its {N} points has finite coordinates"):
        read_sample(path)


def test_large_files_are_sampled_and_others_are_read(scans, monkeypatch):
    path, points_for = scans / "scan.ply", streaming.points_for
    n = (read_tensor_cloud(path).point.classification.numpy() == 5).sum()
    whole = np.asarray(read_cloud(path).points)
    np.testing.assert_array_equal(points_for(pipelines.default(), path), whole)
    monkeypatch.setattr(streaming, "LARGE_CLOUD", N - 1)
    sample = points_for(pipelines.default(), path, "classification == 5")
    assert sample.counts.sum() == n < N
    assert pipelines.default()(sample).report.n_input == n
    np.testing.assert_array_equal(points_for(pipelines.wen2024(), path), whole)


# -------------------------------------------------------------------------------------------------------------- labels


@pytest.mark.parametrize(("ending", "where"), [("ply", None), ("pcd", "classification == 5"), ("laz", None)])
def test_labels_are_those_of_annotate(scans, skeleton, tmp_path, ending, where):
    path = scans / f"scan.{ending}"
    n = annotate_file(skeleton, path, tmp_path / "marked.ply", where=where)
    cloud = read_tensor_cloud(path, where=where)
    marked, expected = read_tensor_cloud(tmp_path / "marked.ply").point, annotate(skeleton, cloud, color="branch").point
    assert n == len(cloud.point.positions)
    for name in ("positions", "classification", *LABELS):
        assert marked[name].dtype == expected[name].dtype, name
        np.testing.assert_array_equal(marked[name].numpy(), expected[name].numpy(), name)
    colors = ["scan_red", "scan_green", "scan_blue"] if "colors" in cloud.point else []
    assert set(marked) == {*expected, *colors}
    for i, name in enumerate(colors):
        np.testing.assert_array_equal(marked[name].numpy()[:, 0], cloud.point.colors.numpy()[:, i])


def test_columns_of_a_ply_file_keep_their_types_where_open3d_reads_these(ring, tmp_path):
    kinds = dict.fromkeys(["x", "y", "z", "nx", "ny", "nz"], "f4") | dict.fromkeys(["red", "green", "blue"], "u1")
    kinds |= {"intensity": "u2", "id": "u4", "class": "u1", "level": "i1", "time": "f8", "row": "i4"}
    rng, n = np.random.default_rng(3), 12000
    columns = {
        name: rng.uniform(size=n).astype(kind) if kind[0] == "f" else rng.integers(0, 100, n).astype(kind)
        for name, kind in kinds.items()
    }
    columns["id"] += 4 * 10**9
    words = {"f4": "float", "f8": "double", "u1": "uchar", "i1": "char", "u2": "ushort", "i4": "int", "u4": "uint"}
    head = "".join(f"property {words[kind]} {name}\n" for name, kind in kinds.items())
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {n}\n{head}end_header\n"
    (tmp_path / "scan.ply").write_bytes(head.encode() + ply.rows_of(columns).tobytes())
    annotate_file(ring, tmp_path / "scan.ply", tmp_path / "out.ply")
    with (tmp_path / "out.ply").open("rb") as stream:
        written = ply.read_tables(stream)["vertex"]
    renamed = {"red": "scan_red", "green": "scan_green", "blue": "scan_blue", "class": "class_"}
    for name, kind in kinds.items():
        values = written[renamed.get(name, name)]
        assert values.dtype == {"u2": "<i4", "i1": "<i4", "u4": "<f8"}.get(kind, f"<{kind}"), name
        np.testing.assert_array_equal(values, columns[name], name)
    assert {written[name].dtype for name in ("radius", "confidence")} == {np.dtype("<f4")}


# ------------------------------------------------------------------------------------------------------ what goes wrong


@pytest.mark.parametrize("ending", ["ply", "pcd", "las", "laz"])
def test_a_scan_that_breaks_off_leaves_nothing_behind(scans, ring, tmp_path, ending):
    path, whole = tmp_path / f"cut.{ending}", (scans / f"scan.{ending}").read_bytes()
    path.write_bytes(whole[: len(whole) * 9 // 10])
    with pytest.raises(FileFormatError, match=path.name):
        read_sample(path)
    with pytest.raises(FileFormatError, match=path.name):
        annotate_file(ring, path, tmp_path / "out.ply")
    assert [*tmp_path.iterdir()] == [path]


def test_what_is_refused_before_reading(scans, ring, tmp_path):
    with pytest.raises(FileFormatError, match=r"its name ends in \.ply"):
        annotate_file(ring, scans / "scan.las", tmp_path / "out.npz")
    with pytest.raises(FileFormatError, match="is the scan itself"):
        annotate_file(ring, scans / "scan.ply", scans / "scan.ply")


def test_memory_does_not_grow_with_the_file(ring, tmp_path, monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "1")  # each thread holds blocks, and how many at once is chance

    def peak(rows):
        path = tmp_path / "scan.ply"
        places = torus(20000).points.astype(np.float32)
        with path.open("wb") as stream:
            stream.write(ply.header_of(np.dtype([(axis, "<f4") for axis in "xyz"]), rows))
            for _ in range(rows // 20000):
                stream.write(places.tobytes())
        tracemalloc.start()
        read_sample(path, n=3000)
        annotate_file(ring, path, tmp_path / "out.ply")
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return most

    few, many = peak(100000), peak(400000)
    assert many < 1.2 * few
