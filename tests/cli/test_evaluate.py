"""`glsk evaluate`: how good a skeleton is."""

import json
from dataclasses import asdict

import numpy as np
import pytest

from glsk_o3d.analysis import assess, compare
from glsk_o3d.data.skeleton import Skeleton
from glsk_o3d.io.skeletons import save_skeleton
from glsk_o3d.samples import torus


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


def test_without_a_truth(invoke, scans, ring, moved):
    run = invoke("evaluate", "s.json", scans / "ring.ply")
    assert (run.exit_code, run.stderr) == (0, "")
    report = json.loads(invoke("evaluate", "s.json", scans / "ring.ply", "--json").stdout)
    assert report["assessment"] == asdict(assess(moved, ring.points))
    assert report["truth"] is report["comparison"] is None
    words = " ".join(run.stdout.split())
    assert words.startswith(f"assessment centredness {report['assessment']['centredness']:.6g} boundedness ")
    assert words.endswith(" loops 1 wide loops 1")
    assert invoke("evaluate", "s.json", scans / "ring.ply", "--quiet").output == ""


def test_with_a_truth(invoke, scans, ring, moved):
    words = ("evaluate", "s.json", scans / "ring.ply", "--truth", "truth.npz")
    reported = json.loads(invoke(*words, "--json").stdout)
    assert reported["comparison"] == asdict(compare(moved, ring))
    assert reported["comparison"]["error"] == pytest.approx(0.5)
    rows = dict(line.split(maxsplit=1) for line in invoke(*words).stdout.splitlines() if " " in line)
    assert (float(rows["error"]), rows["perfect"]) == (pytest.approx(0.5), "yes")
    assert "ends" not in rows  # a ring has none


@pytest.mark.usefixtures("moved")
def test_a_vertex_is_compared_alone_and_a_cloud_elsewhere_is_doubted(invoke, scans, tmp_path, write_scan, ring):
    words = ("evaluate", "dot.ply", scans / "ring.ply", "--truth", "ball.npz")
    facts = json.loads(invoke(*words, "--json").stdout)
    assert (facts["assessment"], facts["comparison"]["components"]) == (None, 0)
    assert "centredness" not in invoke(*words).stdout
    for points in (ring.points + [9, 0, 0], 1000 * ring.points, ring.points / 1000):
        result = invoke("evaluate", "s.json", write_scan(tmp_path / "c.ply", points))
        assert result.exit_code == 0
        assert "c.ply: the skeleton does not lie in it: is this the cloud it was made from" in result.stderr
