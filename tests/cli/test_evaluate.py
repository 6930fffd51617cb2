"""`glsk evaluate`: how good a skeleton is."""

import json
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.image import imread

from glsk_o3d.analysis import assess, compare
from glsk_o3d.io.skeletons import save_skeleton
from glsk_o3d.samples import torus
from glsk_o3d.skeleton import Skeleton


@pytest.fixture(scope="module")
def ring():
    return torus(1000)


@pytest.fixture
def moved(tmp_path, ring):
    """The axis of the ring, half a radius too high; also in a file, beside truths."""
    skeleton = Skeleton(ring.nodes + [0, 0, 0.05], np.sort(ring.edges), 1.1 * ring.radii, (), (), ())
    save_skeleton(skeleton, tmp_path / "s.json")
    save_skeleton(Skeleton([[0, 0, 0]], [], [1], (), (), ()), tmp_path / "dot.ply")
    np.savez(tmp_path / "truth.npz", nodes=ring.nodes, edges=ring.edges, radii=ring.radii)
    np.savez(tmp_path / "ball.npz", nodes=np.ones((1, 3)), edges=np.empty((0, 2), int), radii=[2.0])
    return skeleton


def test_without_a_truth(invoke, scans, tmp_path, ring, moved):
    run = invoke("evaluate", "s.json", scans / "ring.ply", "-o", "r.json", "--preview", "p.png")
    assert (run.exit_code, run.stderr) == (0, "")
    report = json.loads((tmp_path / "r.json").read_text())
    assert report.keys() == {"skeleton", "cloud", "truth", "assessment", "comparison"}
    assert report["assessment"] == assess(moved, ring.points).as_dict()
    assert report["truth"] is report["comparison"] is None
    assert f"centredness {report['assessment']['centredness']:.4f} " in " ".join(run.stdout.split())
    assert "loops 1 1 open wider than their tube" in " ".join(run.stdout.split())
    assert "completeness" not in run.stdout
    assert run.stdout.endswith("wrote r.json\nwrote p.png\n")
    assert imread(tmp_path / "p.png").shape[:2] == (760, 1800)
    assert invoke("evaluate", "s.json", scans / "ring.ply", "--quiet").output == ""


def test_with_the_cloud_of_its_file(invoke, tmp_path, ring, moved):
    held = replace(moved, points=ring.points, vertex_of_point=None, normals=None)
    save_skeleton(held, tmp_path / "held.npz")
    told = json.loads(invoke("evaluate", "held.npz", "--json").stdout)
    assert told["cloud"] is None
    assert told["assessment"] == assess(moved, ring.points).as_dict()
    refused = invoke("evaluate", "s.json")
    assert refused.exit_code == 2
    assert "s.json: holds no cloud" in refused.stderr


def test_with_a_truth(invoke, scans, ring, moved):
    words = ("evaluate", "s.json", scans / "ring.ply", "--truth", "truth.npz")
    result = invoke(*words, "--json", "--preview", "p.png")
    assert (result.exit_code, result.stderr) == (0, "")
    told = json.loads(result.stdout)
    assert told["comparison"] == compare(moved, ring).as_dict()
    assert told["comparison"]["error"] == pytest.approx(0.5)
    assert told["comparison"]["radius_error"] == pytest.approx(0.1)
    assert told["files"] == ["p.png"]
    rows = [" ".join(line.split()) for line in invoke(*words).stdout.splitlines()]
    told = ("length 1.0000 1", "error 0.5000 0", "radius error 0.1000 0", "tips f1 1.0000 1", "junctions f1 1.0000 1")
    for start in (*told, "true topology yes yes", "perfect yes yes"):
        assert any(row.startswith(start) for row in rows)
    assert not any(row.startswith("ends ") for row in rows)  # a ring has none


@pytest.mark.usefixtures("moved")
def test_a_vertex_against_a_vertex(invoke, scans):
    words = ("evaluate", "dot.ply", scans / "ring.ply", "--truth", "ball.npz")
    told = json.loads(invoke(*words, "--json").stdout)
    assert told["assessment"] is None
    assert told["comparison"]["components"] == 0
    assert "centredness" not in invoke(*words).stdout


@pytest.mark.usefixtures("moved")
def test_a_cloud_elsewhere_or_in_other_units(invoke, tmp_path, write_scan, ring):
    for points in (ring.points + [9, 0, 0], 1000 * ring.points, ring.points / 1000):
        result = invoke("evaluate", "s.json", write_scan(tmp_path / "c.ply", points))
        assert result.exit_code == 0
        assert "c.ply: the skeleton does not lie in it: is this the cloud it was made from" in result.stderr
