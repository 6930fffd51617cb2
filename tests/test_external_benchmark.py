"""The adapters for other people's data: tiny files of each kind, made up here, and what is bad in them."""

import sys
from types import SimpleNamespace

import numpy as np
import open3d as o3d
import pytest
from glsk_bench import read_folder, run, score_answers
from glsk_bench.clouds import coverage

from glsk_o3d import Skeleton, samples

FORK = samples.y_junction(2000)


@pytest.fixture(scope="module")
def tool(benchmark):
    with benchmark("external") as module:
        yield module


@pytest.fixture(scope="module")
def parts(tool):
    found = ((name.split("."), module) for name, module in sys.modules.items())
    return SimpleNamespace(**{name[1]: module for name, module in found if name[0] == "_external" and name[1:]})


def write_ply(path, points):
    path.parent.mkdir(parents=True, exist_ok=True)
    assert o3d.io.write_point_cloud(str(path), o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points)))


def shape_of(made, name):
    """Components, loops, leaves and junctions of an axis."""
    truth = made.truth(name)
    found = Skeleton(truth.nodes, truth.edges, truth.radii, (), (), ())
    return found.n_components, found.n_loops, len(found.leaves), len(found.junctions)


def folder_of(path):
    return {cloud.name: cloud for cloud in read_folder(path).clouds}


class TestTrees:
    OBJ = "v 0 0 0\nv 0 4 0\nv 0 8 0\nv 0 4 0\nv 3 7 0\nv 0 4 0\nv 0 7 3\nl 1 2 3\nl 4 5\nl 6 7\n"

    @pytest.fixture
    def data(self, tmp_path):
        """A tree of three branches, its cloud in two resolutions."""
        nodes = np.array([[0, 0, 0], [0, 4, 0], [0, 8, 0], [3, 7, 0], [0, 7, 3]], float)
        cones = nodes, np.array([[0, 1], [1, 2], [1, 3], [1, 4]]), np.full(5, 0.3)
        points = samples.capsules.union_sample("tree", *cones, 3000, 0.0, 0).points
        for res, n in ((50, 1000), (100, 2000), (150, 3000)):
            write_ply(tmp_path / f"data/scan_ply/tree_small_7_res_{res}.ply", points[:n])
        (tmp_path / "data/scan_skel").mkdir()
        (tmp_path / "data/scan_skel/tree_small_7.obj").write_text(self.OBJ)
        return tmp_path / "data"

    def test_branches_are_welded_where_they_begin(self, call, data, tmp_path):
        assert "1 shapes, 3 clouds" in call("trees", data, "-o", tmp_path / "bench")
        made = read_folder(tmp_path / "bench")
        assert [(cloud.name, cloud.family) for cloud in made.clouds] == [
            (f"tree_small_7_res{res}", "small") for res in (50, 100, 150)
        ]
        assert shape_of(made, "tree_small_7") == (1, 0, 4, 1)
        truth = made.truth("tree_small_7")
        assert (len(truth.nodes), len(truth.edges)) == (5, 4)
        np.testing.assert_allclose(truth.radii, 0.3, rtol=0.05)

    def test_run_and_scored(self, call, data, tmp_path):
        call("trees", data, "-o", tmp_path / "bench")
        source = "import shutil, sys; shutil.copy(sys.argv[3], sys.argv[2])"
        axis = data / "scan_skel/tree_small_7.obj"
        words = [sys.executable, "-S", "-c", source, "{cloud}", "{skeleton}", str(axis)]
        assert run(tmp_path / "bench", tmp_path / "mine", command=words, ending=".obj").failures == {}
        rows = score_answers(tmp_path / "bench", tmp_path / "mine").rows
        assert [row["components"] for row in rows] == [2, 2, 2]  # as the file has it, not welded
        assert all(row["error"] < 1e-6 for row in rows)

    def test_what_cannot_be_used_is_named_and_the_rest_goes_on(self, call, data, tmp_path):
        axes = data / "scan_skel"
        (axes / "tree_small_8.obj").write_text(self.OBJ)
        (axes / "tree_small_9.obj").write_text("v 0 0 0\nv 1 0 0\n")
        (axes / "tree_small_10.obj").write_text("v 0 0 zero\nv 1 0 0\nl 1 2\n")
        (axes / "tree_small_11.obj").write_text("v 0 0 0\nv 0 99 0\nl 1 2\n")
        (axes / "tree_small_13.obj").write_text(self.OBJ)
        for name in (9, 10, 11, 12):
            write_ply(data / f"scan_ply/tree_small_{name}_res_50.ply", FORK.points)
        (data / "scan_ply/tree_small_13_res_50.ply").write_bytes(b"ply\nrubbish")
        out = call("trees", data, "-o", tmp_path / "bench")
        assert "1 shapes, 3 clouds" in out
        assert "left out, 6:" in out
        lines = {name: line for line in out.splitlines() for name in range(8, 14) if f"tree_small_{name}" in line}
        assert "tree_small_8_res_*.ply: no such cloud" in lines[8]
        assert "tree_small_9.obj: has no lines" in lines[9]
        assert "tree_small_10.obj: not a valid .obj" in lines[10]
        assert "are they of one version" in lines[11]
        assert "tree_small_12.obj: no such file" in lines[12]
        assert "tree_small_13_res_50.ply" in lines[13]
        assert list(read_folder(tmp_path / "bench").shapes) == ["tree_small_7"]

    def test_some_of_them(self, call, data, tmp_path):
        assert "1 shapes" in call("trees", data, "-o", tmp_path / "bench", "--only", "tree_small_*")
        assert "none of 1 shapes is called tree_large_*" in call(
            *("trees", data, "-o", tmp_path / "bench", "--only", "tree_large_*"), code=2
        )

    def test_again_it_is_the_same(self, call, data, tmp_path):
        call("trees", data, "-o", tmp_path / "bench")
        before = read_folder(tmp_path / "bench")
        call("trees", data, "-o", tmp_path / "bench")
        assert read_folder(tmp_path / "bench") == before


class TestPlants:
    @pytest.fixture
    def data(self, tmp_path):
        """Two plants, one with labels; files of another kind beside them."""
        for kind, name in (("maize", "03-13"), ("tomato", "03-13")):
            (tmp_path / "data" / kind).mkdir(parents=True)
            label = " 2.0" if kind == "maize" else ""
            lines = [f"v {x} {y} {z}{label}" for x, y, z in 50 * FORK.nodes] + [f"e {a} {b}" for a, b in FORK.edges]
            (tmp_path / "data" / kind / f"{name}.graph.txt").write_text("\n".join(["# D:3", *lines]) + "\n")
        write_ply(tmp_path / "data/maize/03-13.ply", 50 * FORK.points)
        np.savetxt(tmp_path / "data/tomato/03-13.xyz", 50 * FORK.points)
        (tmp_path / "data/tomato/03-13-03-14.corres.txt").write_text("0 1\n")
        (tmp_path / "data/.hidden").mkdir()
        (tmp_path / "data/.hidden/03-13.graph.txt").write_text("v 0 0 0\n")
        return tmp_path / "data"

    def test_graphs_of_both_kinds_and_clouds_of_both(self, call, data, tmp_path):
        out = call("plants", data, "-o", tmp_path / "bench")
        assert "2 shapes, 2 clouds" in out
        assert "left out" not in out
        made = read_folder(tmp_path / "bench")
        assert [(cloud.name, cloud.family) for cloud in made.clouds] == [
            ("maize-03-13_scan", "maize"),
            ("tomato-03-13_scan", "tomato"),
        ]
        for name in made.shapes:
            assert shape_of(made, name) == (1, 0, 3, 1)
            np.testing.assert_allclose(np.median(made.truth(name).radii), 50 * np.median(FORK.radii), rtol=0.1)

    @pytest.mark.parametrize(
        "text", ["", "v 0 0\ne 0 0\n", "v 0 0 0\nv 1 1 1\n", "v 0 0 0\nv 1 1 1\ne 0 2\n", "v 0 0 a\ne 0 0\n", "\xff"]
    )
    def test_a_bad_graph_is_named(self, call, data, tmp_path, text):
        (data / "maize/03-13.graph.txt").write_text(text)
        out = call("plants", data, "-o", tmp_path / "bench")
        assert "1 shapes, 1 clouds" in out
        assert "maize/03-13.graph.txt: not a valid graph" in out

    def test_without_a_cloud(self, call, data, tmp_path):
        (data / "maize/03-13.ply").unlink()
        out = call("plants", data, "-o", tmp_path / "bench")
        assert "maize/03-13.ply or .xyz: no such cloud" in out


class TestVessels:
    SWC = "# made up\n1 0 0 0 0 6 -1\n2 0 20 0 0 5 1\n3 0 40 0 0 4 2\n4 0 30 20 0 3 2\n5 0 40 40 5 2 4\n"

    @pytest.fixture
    def data(self, tmp_path):
        (tmp_path / "data/some one").mkdir(parents=True)
        (tmp_path / "data/some one/a.CNG.swc").write_text(self.SWC)
        return tmp_path / "data"

    def test_clouds_are_drawn_of_the_round_cones(self, call, data, tmp_path):
        out = call("vessels", data, "-o", tmp_path / "bench", "--variants", "clean,noise1", "--points", 1000)
        assert "1 shapes, 2 clouds" in out
        made = read_folder(tmp_path / "bench")
        (name,) = made.shapes
        assert name == "some-one-a.CNG"
        assert shape_of(made, name) == (1, 0, 3, 1)
        truth = made.truth(name)
        low, high = truth.nodes - truth.radii[:, None], truth.nodes + truth.radii[:, None]
        assert np.linalg.norm(high.max(axis=0) - low.min(axis=0)) == pytest.approx(1)
        points = np.asarray(o3d.io.read_point_cloud(str(made.clouds[0].path)).points)
        assert len(points) == 1000
        off = samples.signed_distance(points, truth.nodes, truth.edges, truth.radii)
        assert np.abs(off).max() < 1e-4

    def test_again_they_are_the_same(self, call, data, tmp_path):
        few = ("--variants", "clean", "--points", 500)
        call("vessels", data, "-o", tmp_path / "bench", *few)
        assert "left out" not in call("vessels", data, "-o", tmp_path / "bench", *few)

    def test_what_a_cloud_does_not_show_is_left_out(self, call, data, tmp_path, parts, monkeypatch):
        assert parts.vessels.coverage is coverage
        monkeypatch.setattr(parts.vessels, "coverage", lambda shape, points: 0.9)
        out = call("vessels", data, "-o", tmp_path / "bench", "--points", 500)
        assert "a.CNG.swc: scan2 shows 0.90 of its axis, less than 0.97" in out
        assert [*folder_of(tmp_path / "bench")] == ["some-one-a.CNG_clean"]

    @pytest.mark.parametrize(
        ("text", "said"),
        [
            ("1 0 0 0 0 1 -1\n2 0 9 0 0 0 1\n", "1 of 2 nodes have no radius above 0"),
            ("1 0 0 0 0 1 -1\n2 0 9 0 0 nan 1\n", "1 of 2 nodes have no radius above 0"),
            ("1 0 0 0 0 1 -1\n2 0 9e6 0 0 1 1\n", "more than 300000"),
            ("1 0 0 0 0 1 -1\n", "no edges"),
            ("1 0 0 0 0 1 -1\n2 0 0 0 0 1 1\n", "no edges"),
            ("rubbish\n", "not a valid .swc"),
            ("", "the file is empty"),
        ],
    )
    def test_a_bad_file_is_named(self, call, data, tmp_path, text, said):
        (data / "bad.swc").write_text(text)
        out = call("vessels", data, "-o", tmp_path / "bench", "--variants", "clean", "--points", 300)
        assert "1 shapes, 1 clouds" in out
        (line,) = [line for line in out.splitlines() if "bad.swc" in line]
        assert said in line

    def test_only_bad_files(self, call, data, tmp_path):
        (data / "some one/a.CNG.swc").write_text("rubbish")
        assert "0 shapes" in call("vessels", data, "-o", tmp_path / "bench", code=1)

    def test_the_rim_of_a_body_is_no_branch(self, parts, tmp_path):
        """Three places of a neuron's body, as they are often told, and what leaves it."""
        body = "1 1 0 0 0 5 -1\n2 1 0 5 0 5 1\n3 1 0 -5 0 5 1\n"
        (tmp_path / "n.swc").write_text(body + "4 3 20 0 0 1 1\n5 3 30 0 0 1 4\n6 3 0 0 20 1 1\n7 3 0 0 5.5 1 1\n")
        nodes, edges, radii = parts.vessels.read_axis(tmp_path / "n.swc")
        assert sorted(map(tuple, nodes)) == [(0, 0, 0), (0, 0, 5.5), (0, 0, 20), (20, 0, 0), (30, 0, 0)]
        assert len(edges) == 4
        assert sorted(radii) == [1, 1, 1, 1, 5]


class TestArteries:
    """Files of VTK's own writer."""

    @pytest.fixture
    def data(self, tmp_path):
        pytest.importorskip("vtkmodules.vtkIOXML", reason="vtk is not installed")
        case = tmp_path / "data/C0001"
        lines, radii = self.lines()
        write_vtp(case / "morphology/centerlines.vtp", lines=lines, MaximumInscribedSphereRadius=radii)
        mesh = o3d.geometry.TriangleMesh.create_cylinder(1.0, 20.0, 30, 20)
        write_vtp(case / "surface/model.vtp", np.asarray(mesh.vertices), np.asarray(mesh.triangles))
        return tmp_path / "data"

    @staticmethod
    def lines(noise=0.02):
        """Three lines from one inlet that part at z = 0 and z = 4; the last comes near to the first again later."""
        t = np.linspace(-10, 10, 201)
        rng = np.random.default_rng(0)
        aside = np.maximum(t, 0)
        later = np.maximum(t - 4, 0)
        back = np.where(t < 5, aside, np.maximum(5 - (t - 5), 0.1))
        paths = [(0 * t, 0 * t), (0 * t, -later), (back, 0 * t)]
        lines = [np.column_stack([x, y, t]) + rng.normal(0, noise, (201, 3)) for x, y in paths]
        return lines, np.full(603, 1.0)

    def test_an_artery(self, call, data, tmp_path):
        out = call("vessels", data, "-o", tmp_path / "bench", "--points", 700)
        assert "1 shapes, 1 clouds" in out
        made = read_folder(tmp_path / "bench")
        (cloud,) = made.clouds
        assert (cloud.name, cloud.family) == ("C0001_surface", "arteries")
        points = np.asarray(o3d.io.read_point_cloud(str(cloud.path)).points)
        assert len(points) == 700
        assert np.hypot(*points[:, :2].T).max() <= 1 + 1e-6
        assert shape_of(made, "C0001") == (1, 0, 4, 2)

    def test_lines_are_joined_where_they_part_and_not_where_they_touch(self, parts):
        (nodes, radii), forks = self.lines()[:2], []
        nodes = np.vstack(nodes)
        split = np.split(np.arange(603), 3)
        for order in ((0, 1, 2), (2, 0, 1), (1, 2, 0)):
            edges = parts.aneurisk.joined(nodes, radii, [split[i] for i in order])
            degree = np.bincount(edges.ravel(), minlength=603)
            assert ((degree == 1).sum(), (degree == 3).sum(), (degree > 3).sum()) == (4, 2, 0)
            assert len(edges) == (degree > 0).sum() - 1  # one tree
            forks.append(np.sort(nodes[degree == 3, 2]))
        np.testing.assert_allclose(forks, [[0.5, 4.5]] * 3, atol=0.3)

    def test_a_line_the_other_way_round_and_one_that_is_all_there(self, parts):
        lines, _ = self.lines()
        lines = [lines[0], lines[1][::-1], lines[0][50:150] + 0.1, lines[0] + 50]
        nodes = np.vstack(lines)
        ends = np.cumsum([len(line) for line in lines])[:-1]
        edges = parts.aneurisk.joined(nodes, np.ones(len(nodes)), np.split(np.arange(len(nodes)), ends))
        degree = np.bincount(edges.ravel(), minlength=len(nodes))
        assert ((degree == 1).sum(), (degree == 3).sum()) == (3 + 2, 1)  # the last is a part of its own
        assert not degree[ends[1] : ends[2]].any()

    def test_bad_cases_are_named(self, call, data, tmp_path):
        lines, radii = self.lines()
        for name, facts in (("C2", dict(Radius=radii)), ("C3", dict(MaximumInscribedSphereRadius=0 * radii))):
            write_vtp(data / name / "morphology/centerlines.vtp", lines=lines, **facts)
        write_vtp(data / "C4/morphology/centerlines.vtp", lines=lines, MaximumInscribedSphereRadius=radii)
        (data / "C5/morphology").mkdir(parents=True)
        (data / "C5/morphology/centerlines.vtp").write_text("rubbish")
        write_vtp(data / "C6/morphology/centerlines.vtp", lines=lines, MaximumInscribedSphereRadius=radii)
        write_vtp(data / "C6/surface/model.vtp", lines=lines)
        out = call("vessels", data, "-o", tmp_path / "bench", "--points", 300)
        assert "1 shapes, 1 clouds" in out
        for said in (
            "C2/morphology/centerlines.vtp: has no lines with the point array MaximumInscribedSphereRadius",
            "C3/morphology/centerlines.vtp: a radius on a line is not above 0",
            "C4/surface/model.vtp: no such file",
            "C5/morphology/centerlines.vtp: not a valid .vtp",
            "C6/surface/model.vtp: has no surface",
        ):
            assert said in out

    def test_without_vtk(self, call, data, tmp_path, monkeypatch):
        monkeypatch.setitem(sys.modules, "vtkmodules.vtkIOXML", None)
        assert "pip install vtk" in " ".join(call("vessels", data, "-o", tmp_path / "bench", code=2).split())


def write_vtp(path, nodes=None, triangles=None, lines=(), **arrays):
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
    from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter

    data, points, cells = vtkPolyData(), vtkPoints(), vtkCellArray()
    nodes = np.vstack(lines) if nodes is None else nodes
    points.SetData(numpy_to_vtk(np.ascontiguousarray(nodes), deep=True))
    data.SetPoints(points)
    ends = np.cumsum([len(line) for line in lines])[:-1]
    for cell in np.split(np.arange(len(nodes)), ends) if triangles is None else triangles:
        cells.InsertNextCell(len(cell), [*map(int, cell)])
    (data.SetLines if triangles is None else data.SetPolys)(cells)
    for name, values in arrays.items():
        array = numpy_to_vtk(values, deep=True)
        array.SetName(name)
        data.GetPointData().AddArray(array)
    path.parent.mkdir(parents=True, exist_ok=True)
    writer = vtkXMLPolyDataWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(data)
    assert writer.Write()


class TestUsage:
    @pytest.mark.parametrize(
        ("command", "said"),
        [("trees", "no scan_skel/tree_*.obj"), ("plants", "no NAME.graph.txt"), ("vessels", "no NAME.swc")],
    )
    def test_nothing_there(self, call, tmp_path, command, said):
        assert said in " ".join(call(command, tmp_path, "-o", tmp_path / "bench", code=2).split())
        assert not (tmp_path / "bench").exists()

    def test_wrong_words(self, call, tmp_path):
        assert "no variant claen" in call("vessels", tmp_path, "-o", tmp_path / "b", "--variants", "claen", code=2)
        call("trees", tmp_path / "none", "-o", tmp_path / "bench", code=2)

    def test_a_folder_of_a_version(self, call, small, tmp_path):
        (tmp_path / "data").mkdir()
        (tmp_path / "data/a.swc").write_text(TestVessels.SWC)
        out = call("vessels", tmp_path / "data", "-o", small.path, code=2)
        assert "has version v1, not own" in " ".join(out.split())

    def test_places_that_are_one(self, parts):
        """With the largest radius; what no edge joins to another place goes."""
        places = np.array([[0, 0, 0], [1, 0, 0], [1, 0, 0], [2, 0, 0], [9, 9, 9]], float)
        nodes, edges, radii = parts.entries.welded(
            places, np.array([[1, 0], [1, 2], [2, 3]]), np.array([1, 2, 5, 3, 4])
        )
        assert nodes.tolist() == [[0, 0, 0], [1, 0, 0], [2, 0, 0]]
        assert (edges.tolist(), radii.tolist()) == ([[0, 1], [1, 2]], [1, 5, 3])

    def test_names(self, parts):
        from pathlib import Path

        assert parts.entries.plain(Path("a b/..c é.x")) == "a-b-..c-é.x"
        assert parts.entries.plain(Path("../.-")) == "unnamed"
