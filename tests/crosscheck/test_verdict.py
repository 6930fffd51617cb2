"""What the numbers of a cross-check say about a cloud."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from glsk_o3d import RingBuilder
from glsk_o3d.crosscheck import agreement
from glsk_o3d.crosscheck.agreement import MeshFit, RowAgreement, SkeletonAgreement, mesh_fit
from glsk_o3d.crosscheck.mesh import spacing
from glsk_o3d.report import REFUSED, Report

FIT = MeshFit(far=0.0, open=0.0, pieces=1, parts=1, torn=0.0, genus=None)
SETTLED = Report(stop_reason="settled")
FAILED = Report(stop_reason=f"solve 3 {REFUSED}: it broke", warnings=("spiky", "flat"))


def judged(rows, skeletons, warned=(), mesh_report=SETTLED, fit=FIT):
    return agreement.judge(rows, skeletons, fit, warned, mesh_report)


def rows(**changed):
    return replace(RowAgreement(90, 90, 1.0, True, 0.9, {"median": 1.0, "p75": 2.0}), **changed)


def apart(**changed):
    return replace(SkeletonAgreement(0.05, 0.1, (1, 1), (2, 2)), **changed)


@pytest.mark.parametrize(
    ("verdict", "of_rows", "of_skeletons", "reason"),
    [
        ("agrees", {}, {}, None),
        ("agrees in part", {"angle": {"median": 1.0, "p75": 31.0}}, {}, "turned by more than 31 degrees"),
        ("agrees in part", {"covered": 0.69}, {}, "closes around 69%"),
        ("cannot tell", {"compared": 0, "covered": 0.0, "angle": {}}, {}, "no Laplacian coordinates"),
        ("agrees", {"angle": {"median": 1.0, "p75": 29.0}, "covered": 0.71}, {}, None),
        ("agrees", {}, {"distance_in_radii": 0.19, "hausdorff95_in_radii": 0.95}, None),
        ("agrees in part", {}, {"distance_in_radii": 0.21}, "0.21 local radii apart"),
        ("agrees in part", {}, {"distance_in_radii": 0.49}, "0.49 local radii apart"),
        ("agrees in part", {}, {"hausdorff95_in_radii": 1.2}, "1.2 local radii"),
        ("do not trust", {}, {"distance_in_radii": 0.51}, "0.51 local radii apart"),
        ("do not trust", {}, {"loops": (2, 1)}, "loops: 2 in the skeleton of the cloud, 1 in that of the mesh"),
        ("do not trust", {}, {"components": (1, 2)}, "components: 1"),
    ],
)
def test_thresholds(verdict, of_rows, of_skeletons, reason):
    found, reasons = judged(rows(**of_rows), apart(**of_skeletons))
    assert found == verdict
    assert [reason in text for text in reasons] == ([] if reason is None else [True])


def test_a_mesh_that_fails_is_named():
    message = f"the mesh's own contraction failed: solve 3 {REFUSED}: it broke"
    warned = ("the mesh's run warns: spiky", "the mesh's run warns: flat")
    assert judged(rows(), apart(), (), FAILED) == ("agrees in part", (message, *warned))
    verdict, reasons = judged(rows(), apart(components=(1, 9)), ("flat",), FAILED)
    assert (verdict, reasons[0], len(reasons)) == ("cannot tell", message, 4)


@pytest.mark.parametrize(
    ("changed", "reason"),
    [
        ({"far": 0.06}, "6% of the points lie more than a point spacing off it"),
        ({"open": 0.07}, "7% of it are at holes that the cloud has not"),
        ({"torn": 0.06, "pieces": 2}, "6% of it are torn off where the cloud holds together"),
    ],
)
def test_a_mesh_that_does_not_describe_the_cloud_says_nothing_against_it(changed, reason):
    fit, differ = replace(FIT, **changed), apart(loops=(2, 1))
    assert judged(rows(), differ, fit=FIT)[0] == "do not trust"
    verdict, (first, second) = judged(rows(), differ, fit=fit)
    assert (verdict, first) == ("cannot tell", f"the mesh does not describe the cloud: {reason}")
    assert second.startswith("loops: 2")
    assert judged(rows(), apart(), fit=fit) == ("agrees", ())
    assert judged(rows(covered=0.6), differ)[0] == "cannot tell"


def test_genus_of_meshes(grid):
    ring, tube, sheet = grid(8, 9, 1, 1), grid(8, 9, 1, 0), grid(8, 9, 0, 0)
    assert [agreement._genus(faces) for faces in (ring, tube, sheet)] == [1, 0, 0]
    turned = ring.copy()
    turned[::3] = turned[::3, ::-1]
    assert agreement._genus(turned) == 1  # ball pivoting turns faces as it likes
    assert agreement._genus(np.concatenate([ring, ring + 72])) == 2
    assert agreement._genus(ring[np.arange(len(ring)) != 40]) == 1  # a border of three edges
    pinched = np.concatenate([ring, grid(8, 9, 1, 1, shift=72)])
    pinched[pinched == 72] = 0  # two rings touch in a vertex
    assert agreement._genus(pinched) == 2
    assert agreement._genus(np.concatenate([ring, [[0, 9, 999]]])) is None  # three faces share an edge


def test_holes_of_the_mesh_are_loops_of_the_skeleton():
    one = apart(loops=(1, 1))
    assert judged(rows(), one, fit=replace(FIT, genus=1)) == ("agrees", ())
    verdict, reasons = judged(rows(), one, fit=replace(FIT, genus=2))
    assert verdict == "agrees in part"
    assert reasons == ("holes: 2 pass through the mesh, and the skeleton of the cloud has 1 loops",)


def test_a_crumb_is_no_excuse(ring, check):
    state = RingBuilder()(ring.points)
    vertices = state.frame.into(check.vertices)
    crumb = vertices[check.faces[0]] + [0, 0, 2 * spacing(vertices)]
    faces = np.concatenate([check.faces, [len(vertices) + np.arange(3)]])
    fit = mesh_fit(state, np.concatenate([vertices, crumb]), faces)
    assert (fit.pieces, fit.parts) == (2, 1)
    assert fit.torn == pytest.approx(3 / (len(np.unique(check.faces)) + 3))
    assert judged(rows(), apart(loops=(2, 1)), fit=fit)[0] == "do not trust"
    assert judged(rows(), apart(components=(1, 2), distance_in_radii=0.6), fit=fit)[0] == "do not trust"
    for components, verdict in (((1, 2), "cannot tell"), ((1, 3), "do not trust"), ((2, 1), "do not trust")):
        assert judged(rows(), apart(components=components), fit=fit)[0] == verdict  # a crumb has a skeleton of its own
    shattered = np.arange(3 * len(check.faces)).reshape(-1, 3)
    assert mesh_fit(state, vertices[check.faces.ravel()], shattered).torn > 0.99


def test_what_to_expect_is_said_of_every_verdict_with_the_numbers_of_the_page():
    assert set(agreement.MEANINGS) == set(agreement.VERDICTS)
    page = (Path(__file__).parents[2] / "docs" / "crosscheck.md").read_text("utf-8")
    counts = re.findall(r"(\d+) / (\d+)", re.search(r"^\| all \|.*$", page, re.MULTILINE)[0])
    for verdict, (good, all_) in zip(agreement.VERDICTS, counts, strict=True):
        if verdict in (agreement.IN_PART, agreement.DISTRUST):
            assert f"of {all_} test clouds {good} had a good skeleton" in agreement.MEANINGS[verdict]
