"""From file to file without the cloud in memory: the same sample, skeleton and labels."""

import tracemalloc

import numpy as np
import pytest

from glsk_o3d import (
    annotate_file,
    pipelines,
    read_cloud,
    read_sample,
    read_skeleton,
    read_tensor_cloud,
    save_tensor_cloud,
    skeletonize,
)
from glsk_o3d.errors import FileFormatError, InvalidCloudError, InvalidParameterError
from glsk_o3d.io import streaming
from glsk_o3d.io.clouds import blocks
from glsk_o3d.io.formats import ply_tables
from glsk_o3d.samples import torus, y_junction

N = 130000
LABELS = ("skeleton_vertex", "branch", "order", "radius", "confidence", "colors")


@pytest.fixture(autouse=True)
def small_blocks(monkeypatch):
    monkeypatch.setitem(blocks.read_blocks.__kwdefaults__, "rows", 9973)


@pytest.fixture(scope="module")
def points():
    return y_junction(N, noise=0.003).points


@pytest.fixture(scope="module")
def scans(points, tmp_path_factory):
    """The same points as PLY, PCD, LAS and LAZ, with a label, and in the first two with colours."""
    import open3d as o3d

    laspy, folder = pytest.importorskip("laspy"), tmp_path_factory.mktemp("scans")
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales = [1e-5] * 3
    data = laspy.LasData(header)
    data.x, data.y, data.z = points.T
    data.classification = np.where(points[:, 2] > 0, 5, 2)
    for ending in ("las", "laz"):
        data.write(folder / f"scan.{ending}")
    cloud = o3d.t.geometry.PointCloud(o3d.core.Tensor(np.column_stack([data.x, data.y, data.z])))
    cloud.point.colors = o3d.core.Tensor(np.random.default_rng(1).integers(0, 256, (N, 3)).astype(np.uint8))
    cloud.point.classification = o3d.core.Tensor(np.asarray(data.classification, np.int32)[:, None])
    for ending in ("ply", "pcd"):
        save_tensor_cloud(cloud, folder / f"scan.{ending}")
    return folder


@pytest.fixture(scope="module")
def whole(scans):
    return skeletonize(read_cloud(scans / "scan.las"))


@pytest.mark.parametrize("ending", ["ply", "pcd", "las", "laz"])
def test_the_skeleton_of_a_file_is_that_of_its_cloud(scans, whole, ending):
    sample = read_sample(scans / f"scan.{ending}")
    skeleton = skeletonize(sample)
    assert 40000 < len(skeleton.points) < 70000
    np.testing.assert_allclose(skeleton.vertices, whole.vertices, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(skeleton.edges, whole.edges)
    assert skeleton.report.n_input == whole.report.n_input == N
    assert skeleton.report.n_sampled == whole.report.n_sampled == len(sample.point.positions)
    assert int(sample.point.sample_count.numpy().sum()) == N


def test_a_sample_of_another_size_and_of_some_points(scans, points):
    sample = read_sample(scans / "scan.ply", n=3000, where="classification == 5")
    assert 2000 < len(sample.point.positions) < 4500
    assert int(sample.point.sample_count.numpy().sum()) == (points[:, 2] > 0).sum()
    few = read_sample(scans / "scan.ply", n=N)
    np.testing.assert_array_equal(few.point.positions.numpy(), np.asarray(read_cloud(scans / "scan.ply").points))


def test_points_that_are_not_finite(tmp_path, points):
    import open3d as o3d

    spoilt = points.copy()
    spoilt[20000:20010] = np.nan
    save_tensor_cloud(o3d.t.geometry.PointCloud(o3d.core.Tensor(spoilt)), tmp_path / "c.ply")
    with pytest.raises(InvalidCloudError, match=f"10 of {N} points .*, the first at index 20000: drop them"):
        read_sample(tmp_path / "c.ply")
    sample = read_sample(tmp_path / "c.ply", drop_invalid=True)
    assert int(sample.point.sample_count.numpy().sum()) == N - 10
    assert annotate_file(skeletonize(sample), tmp_path / "c.ply", tmp_path / "out.ply") == N
    marked = read_tensor_cloud(tmp_path / "out.ply").point
    assert (marked.branch.numpy()[20000:20010] == -1).all()
    assert np.isnan(marked.radius.numpy()[20000:20010]).all()
    assert (np.delete(marked.branch.numpy(), np.s_[20000:20010]) >= 0).all()
    spoilt[:] = np.nan
    save_tensor_cloud(o3d.t.geometry.PointCloud(o3d.core.Tensor(spoilt)), tmp_path / "none.ply")
    with pytest.raises(InvalidCloudError, match="no point with finite coordinates"):
        read_sample(tmp_path / "none.ply", drop_invalid=True)
    with pytest.raises(InvalidCloudError, match=f"none of its {N} points has finite coordinates"):
        read_sample(tmp_path / "none.ply")


def test_a_report_counts_what_was_dropped(tmp_path, points):
    import open3d as o3d

    spoilt = points.copy()
    spoilt[::260] = np.nan
    save_tensor_cloud(o3d.t.geometry.PointCloud(o3d.core.Tensor(spoilt)), tmp_path / "c.ply")
    pipeline = pipelines.default().with_options(drop_invalid=True)
    whole = pipeline(read_cloud(tmp_path / "c.ply"))
    skeleton = pipeline(streaming.sample_for(pipeline, tmp_path / "c.ply", stream=True))
    for report in (whole.report, skeleton.report):
        assert (report.n_input, report.n_dropped) == (N, 500)
    assert skeleton.report.n_sampled == whole.report.n_sampled == len(skeleton.points) - 1
    assert skeleton.vertex_of_point[-1] == -1
    np.testing.assert_allclose(skeleton.vertices, whole.vertices, rtol=0, atol=1e-9)
    assert annotate_file(skeleton, tmp_path / "c.ply", tmp_path / "out.ply") == N


@pytest.mark.parametrize("ending", ["ply", "pcd", "laz"])
@pytest.mark.parametrize("where", [None, "classification == 5"])
def test_labels_are_those_of_annotate(scans, tmp_path, ending, where):
    path = scans / f"scan.{ending}"
    skeleton = skeletonize(read_sample(path))
    n = annotate_file(skeleton, path, tmp_path / "marked.ply", where=where)
    cloud = read_tensor_cloud(path, where=where)
    found, expected = read_tensor_cloud(tmp_path / "marked.ply").point, skeleton.annotate(cloud, color="branch").point
    assert n == len(cloud.point.positions)
    for name in ("positions", "classification", *LABELS):
        assert found[name].dtype == expected[name].dtype, name
        np.testing.assert_array_equal(found[name].numpy(), expected[name].numpy(), name)
    others = {"scan_red", "scan_green", "scan_blue"} if "colors" in cloud.point else set()
    assert set(found) == {*expected, *others}
    if others:
        np.testing.assert_array_equal(found.scan_green.numpy()[:, 0], cloud.point.colors.numpy()[:, 1])


def test_thickness_is_told_by_the_points_of_the_skeleton_and_not_at_all_without(tmp_path):
    skeleton = skeletonize(torus(1000).points)
    save_tensor_cloud(skeleton.annotate(), tmp_path / "scan.ply")
    annotate_file(skeleton, tmp_path / "scan.ply", tmp_path / "marked.ply")
    found = read_tensor_cloud(tmp_path / "marked.ply").point.thickness.numpy()
    np.testing.assert_array_equal(found, skeleton.annotate().point.thickness.numpy())
    skeleton.save(tmp_path / "ring.ply")
    bare = read_skeleton(tmp_path / "ring.ply")
    annotate_file(bare, tmp_path / "scan.ply", tmp_path / "marked.ply")
    marked = read_tensor_cloud(tmp_path / "marked.ply").point
    np.testing.assert_array_equal(
        marked.skeleton_vertex.numpy(), bare.annotate(torus(1000).points).point.skeleton_vertex.numpy()
    )
    assert np.isnan(marked.thickness.numpy()).all()


def test_an_attribute_that_needs_more_than_int32_in_a_late_block(tmp_path):
    laspy = pytest.importorskip("laspy")
    points = torus(30000).points
    header = laspy.LasHeader(point_format=0, version="1.2")
    header.scales = [1e-5] * 3
    header.add_extra_dims([laspy.ExtraBytesParams("id", "uint32"), laspy.ExtraBytesParams("late", "uint8")])
    data = laspy.LasData(header)
    data.x, data.y, data.z = points.T
    data.id = np.arange(30000) + np.where(np.arange(30000) > 25000, 4 * 10**9, 0)
    data.late = np.arange(30000) > 25000
    data.write(tmp_path / "c.las")
    annotate_file(skeletonize(torus(1000).points), tmp_path / "c.las", tmp_path / "out.ply")
    found, cloud = read_tensor_cloud(tmp_path / "out.ply").point, read_tensor_cloud(tmp_path / "c.las").point
    for name in ("id", "late"):
        assert found[name].dtype == cloud[name].dtype
        np.testing.assert_array_equal(found[name].numpy(), cloud[name].numpy())
    assert "intensity" not in found


WORDS = {"f4": "float", "f8": "double", "u1": "uchar", "i1": "char", "u2": "ushort", "i4": "int", "u4": "uint"}


@pytest.mark.parametrize(("order", "endian"), [("<", "little"), (">", "big")])
def test_columns_of_a_ply_file_keep_their_types_where_open3d_reads_these(tmp_path, order, endian):
    kinds = dict.fromkeys(["x", "y", "z", "nx", "ny", "nz"], "f4") | dict.fromkeys(["red", "green", "blue"], "u1")
    kinds |= {"intensity": "u2", "id": "u4", "class": "u1", "level": "i1", "time": "f8", "row": "i4"}
    points, rng = torus(30000).points, np.random.default_rng(3)
    rows = np.zeros(len(points), [(name, order + kind) for name, kind in kinds.items()])
    for name, kind in kinds.items():
        rows[name] = rng.uniform(size=len(points)) if kind[0] == "f" else rng.integers(0, 100, len(points))
    for axis, values in zip("xyz", points.T, strict=True):
        rows[axis] = values
    rows["id"] += 4 * 10**9
    head = "".join(f"property {WORDS[kind]} {name}\n" for name, kind in kinds.items())
    head = f"ply\nformat binary_{endian}_endian 1.0\nelement vertex {len(rows)}\n{head}end_header\n"
    (tmp_path / "scan.ply").write_bytes(head.encode() + rows.tobytes())
    annotate_file(skeletonize(torus(1000).points), tmp_path / "scan.ply", tmp_path / "out.ply")
    with (tmp_path / "out.ply").open("rb") as stream:
        row, n = ply_tables.find_rows(stream, "vertex")
        found = np.frombuffer(stream.read(n * row.itemsize), row)
    renamed = {"red": "scan_red", "green": "scan_green", "blue": "scan_blue", "class": "class_"}
    for name, kind in kinds.items():
        values = found[renamed.get(name, name)]
        assert values.dtype == {"u2": "<i4", "i1": "<i4", "u4": "<f8"}.get(kind, f"<{kind}"), name
        np.testing.assert_array_equal(values, rows[name], name)
    assert {found[name].dtype for name in ("radius", "confidence", "thickness")} == {np.dtype("<f4")}


def test_a_scan_that_breaks_off_leaves_nothing_behind(scans, tmp_path):
    skeleton = skeletonize(torus(1000).points)
    for ending in ("ply", "pcd", "las", "laz"):
        whole = (scans / f"scan.{ending}").read_bytes()
        path = tmp_path / f"cut.{ending}"
        path.write_bytes(whole[: len(whole) * 9 // 10])
        with pytest.raises(FileFormatError, match=path.name):
            read_sample(path)
        with pytest.raises(FileFormatError, match=path.name):
            annotate_file(skeleton, path, tmp_path / "out.ply")
    assert sorted(each.suffix for each in tmp_path.iterdir()) == [".las", ".laz", ".pcd", ".ply"]


@pytest.mark.parametrize("change", ["more points", "fewer points", "no classification"])
def test_a_scan_that_changes_meanwhile_leaves_nothing_behind(scans, tmp_path, monkeypatch, change):
    cloud, skeleton = read_tensor_cloud(scans / "scan.ply"), skeletonize(torus(1000).points)
    path, survey = tmp_path / "scan.ply", streaming._survey
    save_tensor_cloud(cloud, path)

    def changes_then(*given):
        told = survey(*given)
        if change == "no classification":
            del cloud.point["classification"]
        save_tensor_cloud(cloud.append(cloud) if change == "more points" else cloud.select_by_index([*range(99)]), path)
        return told

    monkeypatch.setattr(streaming, "_survey", changes_then)
    with pytest.raises(FileFormatError, match=r"scan\.ply: has changed while it was read"):
        annotate_file(skeleton, path, tmp_path / "out.ply")
    assert [each.name for each in tmp_path.iterdir()] == ["scan.ply"]


def test_an_error_while_writing_keeps_the_old_file(scans, tmp_path, monkeypatch):
    skeleton = skeletonize(torus(1000).points)
    (tmp_path / "out.ply").write_text("old")
    calls = iter(range(5))

    def fails(*args):
        if next(calls) == 3:
            raise OSError(28, "No space left on device")
        return real(*args)

    real = streaming.ply_rows.table
    monkeypatch.setattr(streaming.ply_rows, "table", fails)
    with pytest.raises(OSError, match="No space left"):
        annotate_file(skeleton, scans / "scan.ply", tmp_path / "out.ply")
    assert [each.read_text() for each in tmp_path.iterdir()] == ["old"]


def test_what_is_refused_before_a_file_is_read(scans, tmp_path):
    skeleton = skeletonize(torus(1000).points)
    with pytest.raises(FileFormatError, match=r"its name ends in \.ply"):
        annotate_file(skeleton, scans / "scan.las", tmp_path / "out.npz")
    with pytest.raises(FileFormatError, match="is the scan itself"):
        annotate_file(skeleton, scans / "scan.ply", scans / "scan.ply")
    for n in (0, 2.5, True):
        with pytest.raises(InvalidParameterError, match=f"n = {n}"):
            read_sample(scans / "scan.ply", n=n)


def test_memory_does_not_grow_with_the_file(tmp_path):
    def peak(rows):
        path = tmp_path / "scan.ply"
        head = f"ply\nformat binary_little_endian 1.0\nelement vertex {rows}\n"
        head += "".join(f"property float {axis}\n" for axis in "xyz") + "end_header\n"
        with path.open("wb") as stream:
            stream.write(head.encode())
            for seed in range(rows // 20000):
                stream.write(torus(20000, seed=seed).points.astype("<f4").tobytes())
        tracemalloc.start()
        read_sample(path, n=3000)
        annotate_file(skeleton, path, tmp_path / "out.ply")
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return most

    skeleton = skeletonize(torus(1000).points)
    few, many = peak(100000), peak(500000)
    assert many < 1.2 * few


def test_large_files_are_sampled_and_others_are_read(scans, monkeypatch):
    path = scans / "scan.ply"
    n = (read_tensor_cloud(path).point.classification.numpy() == 5).sum()
    assert streaming.sample_for(pipelines.default(), path) is None
    assert streaming.sample_for(pipelines.default(), path, stream=True) is not None
    monkeypatch.setattr(streaming, "LARGE_CLOUD", N - 1)
    sample = streaming.sample_for(pipelines.default(), path, "classification == 5")
    assert int(sample.point.sample_count.numpy().sum()) == n < N
    assert streaming.sample_for(pipelines.default(), path, stream=False) is None
    assert streaming.sample_for(pipelines.wen2024(), path) is None
    with pytest.raises(InvalidParameterError, match="takes all points"):
        streaming.sample_for(pipelines.wen2024(), path, stream=True)
