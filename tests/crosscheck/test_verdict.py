"""What the numbers of a cross-check say about a cloud."""

import re
from dataclasses import replace
from pathlib import Path

import pytest

from glsk_o3d.crosscheck import agreement
from glsk_o3d.crosscheck.agreement import RowAgreement, SkeletonAgreement
from glsk_o3d.report import REFUSED, Report

SETTLED = Report(stop_reason="settled")
FAILED = Report(stop_reason=f"solve 3 {REFUSED}: it broke", warnings=("spiky", "flat"))


def rows(**changed):
    return replace(RowAgreement(90, 90, 1.0, {"median": 1.0, "p75": 2.0}), **changed)


def apart(**changed):
    return replace(SkeletonAgreement(0.05, 0.1, (1, 1), (2, 2)), **changed)


@pytest.mark.parametrize(
    ("verdict", "of_rows", "of_skeletons", "reason"),
    [
        ("agrees", {}, {}, None),
        ("agrees in part", {"angle": {"median": 1.0, "p75": 31.0}}, {}, "turned by more than 31 degrees"),
        ("agrees in part", {"covered": 0.69}, {}, "closes around 69%"),
        ("cannot tell", {"compared": 0, "covered": 0.0, "angle": {}}, {}, "closes around 0%"),
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
    found, reasons = agreement.judge(rows(**of_rows), apart(**of_skeletons), (), SETTLED)
    assert found == verdict
    assert [reason in text for text in reasons] == ([] if reason is None else [True])


def test_a_mesh_that_fails_is_named_and_says_nothing_against_the_cloud():
    message = f"the mesh's own contraction failed: solve 3 {REFUSED}: it broke"
    warned = ("the mesh's run warns: spiky", "the mesh's run warns: flat")
    assert agreement.judge(rows(), apart(), (), FAILED) == ("agrees in part", (message, *warned))
    verdict, reasons = agreement.judge(rows(), apart(components=(1, 9)), ("flat",), FAILED)
    assert (verdict, reasons[0], len(reasons)) == ("cannot tell", message, 4)
    verdict, (first, second) = agreement.judge(rows(covered=0.6), apart(loops=(2, 1)), (), SETTLED)
    assert (verdict, first) == ("cannot tell", "the mesh closes around 60% of the points whose rings close")
    assert second.startswith("loops: 2")


def test_what_to_expect_is_said_of_every_verdict_with_the_numbers_of_the_page():
    assert set(agreement.MEANINGS) == set(agreement.VERDICTS)
    page = (Path(__file__).parents[2] / "docs" / "crosscheck.md").read_text("utf-8")
    counts = re.findall(r"(\d+) / (\d+)", re.search(r"^\| all \|.*$", page, re.MULTILINE)[0])
    for verdict, (good, all_) in zip(agreement.VERDICTS, counts, strict=True):
        if verdict in (agreement.IN_PART, agreement.DISTRUST):
            assert f"of {all_} test clouds {good} had a good skeleton" in agreement.MEANINGS[verdict]
