"""`glsk evaluate`: how good a skeleton is."""

import json

import numpy as np
import pytest

from glsk_o3d.analysis import assess, compare
from glsk_o3d.io.skeletons import save_skeleton
from glsk_o3d.samples import torus
from glsk_o3d.skeleton import Skeleton

matplotlib = pytest.importorskip("matplotlib")
from matplotlib.image import imread  # noqa: E402


@pytest.fixture(scope="module")
def ring():
    return torus(1000)


@pytest.fixture(scope="module")
def moved(ring):
    """The axis of the ring, half a radius too high."""
    return Skeleton(ring.nodes + [0, 0, 0.05], np.sort(ring.edges), 1.1 * ring.radii, (), (), ())


@pytest.fixture(scope="module")
def folder(tmp_path_factory, ring, moved):
    """Skeletons, and a truth."""
    place = tmp_path_factory.mktemp("ring")
    save_skeleton(moved, place / "s.json")
    save_skeleton(Skeleton([[0, 0, 0]], [], [1], (), (), ()), place / "dot.ply")
    np.savez(place / "truth.npz", nodes=ring.nodes, edges=ring.edges, radii=ring.radii)
    np.savez(place / "none.npz", nodes=np.empty((0, 3)), edges=np.empty((0, 2), int), radii=[])
    return place


def test_without_a_truth(glsk, scans, folder, tmp_path, ring, moved):
    run = glsk("evaluate", folder / "s.json", scans / "ring.ply", "-o", "r.json", "--preview", "p.png")
    assert (run.returncode, run.stderr) == (0, "")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["p.png", "r.json"]
    report = json.loads((tmp_path / "r.json").read_text())
    assert report.keys() == {"skeleton", "cloud", "truth", "assessment", "comparison"}
    assert report["assessment"] == assess(moved, ring.points).as_dict()
    assert report["truth"] is report["comparison"] is None
    assert f"centredness {report['assessment']['centredness']:.4f} " in " ".join(run.stdout.split())
    assert f"opening {report['assessment']['loops'][0]['opening']:.4g}" in run.stdout
    assert "completeness" not in run.stdout
    assert run.stdout.endswith("wrote r.json\nwrote p.png\n")
    assert imread(tmp_path / "p.png").shape[:2] == (760, 1800)


def test_with_a_truth(invoke, scans, folder, tmp_path, ring, moved):
    words = ("evaluate", folder / "s.json", scans / "ring.ply", "--truth", folder / "truth.npz")
    result = invoke(*words, "--json", "--preview", "p.png")
    assert (result.exit_code, result.stderr) == (0, "")
    told = json.loads(result.stdout)
    assert told["comparison"] == compare(moved, ring).as_dict()
    assert told["comparison"]["error"] == pytest.approx(0.5)
    assert told["comparison"]["radius_error"] == pytest.approx(0.1)
    assert told["files"] == ["p.png"]
    table = invoke(*words).stdout
    rows = [" ".join(line.split()) for line in table.splitlines()]
    told = ("length 1.0000 1", "error 0.5000 0", "radius error 0.1000 0", "tips f1 1.0000 1", "junctions f1 1.0000 1")
    for start in (*told, "true topology yes yes", "perfect yes yes"):
        assert any(row.startswith(start) for row in rows)
    assert "ends" not in [line.split()[0] for line in table.splitlines() if line.strip()]  # a ring has none


def test_a_vertex_against_a_vertex(invoke, scans, folder, tmp_path):
    np.savez(tmp_path / "ball.npz", nodes=np.ones((1, 3)), edges=np.empty((0, 2), int), radii=[2.0])
    words = ("evaluate", folder / "dot.ply", scans / "ring.ply", "--truth", tmp_path / "ball.npz")
    result = invoke(*words, "--json")
    assert result.exit_code == 0
    told = json.loads(result.stdout)
    assert told["assessment"] is None
    assert told["comparison"]["components"] == 0
    assert "centredness" not in invoke(*words).stdout


def test_quiet(invoke, scans, folder, tmp_path):
    result = invoke("evaluate", folder / "s.json", scans / "ring.ply", "-o", "r.json", "--quiet")
    assert (result.exit_code, result.output) == (0, "")
    assert (tmp_path / "r.json").is_file()


@pytest.mark.parametrize(
    ("code", "words", "message"),
    [
        (1, ["no.ply", "ring.ply"], "no.ply: no such file"),
        (1, ["s.json", "no.ply"], "no.ply: no such file"),
        (1, ["s.json", "empty.ply"], "the file is empty"),
        (1, ["s.json", "ring.ply", "--truth", "no.npz"], "no.npz: no such file"),
        (1, ["s.json", "ring.ply", "--truth", "none.npz"], "none.npz: the truth has no nodes"),
        (1, ["dot.ply", "ring.ply"], "dot.ply: the skeleton has no edge with a length"),
        (2, ["s.json", "ring.ply", "-o", "r.txt"], "r.txt: the report is JSON and its name ends in .json"),
        (2, ["s.json", "ring.ply", "--preview", "p.jpg"], "p.jpg: the picture is a PNG and its name ends in .png"),
        (2, ["s.json", "ring.ply", "-o", "s.json"], "s.json: is an input: choose another name"),
        (1, ["s.json", "ring.ply", "-o", "no/r.json"], "no: no such folder"),
    ],
)
def test_refusals(refused, scans, folder, code, words, message):
    places = {name: place / name for place in (scans, folder) for name in words if (place / name).exists()}
    before = (folder / "s.json").read_bytes()
    assert message in refused(code, "evaluate", *(places.get(word, word) for word in words))
    assert (folder / "s.json").read_bytes() == before


def test_a_cloud_of_something_else(refused, folder, tmp_path_factory, write_scan):
    cloud = write_scan(tmp_path_factory.mktemp("few") / "few.ply", np.eye(3))
    assert "few.ply: no part of the skeleton has 6 points around it" in refused(1, "evaluate", folder / "s.json", cloud)


def test_a_cloud_elsewhere_or_in_other_units(invoke, folder, tmp_path, write_scan, ring):
    for points in (ring.points + [9, 0, 0], 1000 * ring.points, ring.points / 1000):
        result = invoke("evaluate", folder / "s.json", write_scan(tmp_path / "c.ply", points))
        assert result.exit_code == 0
        assert "c.ply: the skeleton does not lie in it: is this the cloud it was made from" in result.stderr
