"""What the numbers of a cross-check say about a cloud."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from glsk_o3d.analysis.agreement import OperatorAgreement, SkeletonAgreement
from glsk_o3d.apps.crosscheck.agreement import VERDICTS, MeshFacts, judge, of_mesh
from glsk_o3d.apps.crosscheck.solid import Solid
from glsk_o3d.cli.crosscheck import MEANINGS
from glsk_o3d.data.report import REFUSED

SAME = OperatorAgreement(900, 900, 9, {"median": 3.0}, {"median": 1.0}, 0.1, np.ones((50, 2)), 1.0, 0)
ALIKE = SkeletonAgreement(0.05, 0.1, (1, 1), (2, 2), (3, 3), (), (), 0.01, (1.0, 2.0, 3.0))
AWAY = ((1.0, 2.0, 3.0),)


class Body(Solid):
    """A solid with given counts of parts."""

    def __init__(self, solids=1, genus=2, watertight=True, made_by="poisson"):
        super().__init__(np.zeros((0, 3)), np.zeros((0, 3), int), made_by)
        self.__dict__.update(counts=(solids, genus, watertight))

    n_solids = property(lambda self: self.counts[0])
    genus = property(lambda self: self.counts[1])
    is_watertight = property(lambda self: self.counts[2])


def judged(rows=(), skeletons=(), solid=(), mesh=(0.0, 0.0), stop="settled"):
    skeletons, solid = replace(ALIKE, **dict(skeletons)), Body(**dict(solid))
    facts = MeshFacts(*mesh, of_mesh(solid, skeletons.components[0], *mesh, stop))
    return judge(replace(SAME, **dict(rows)), skeletons, solid, facts)


CASES = [
    ("agrees", {}, None),
    (
        "do not trust",
        {"rows": {"angle": {"median": 41.0}}},
        "half of the mean curvature vectors are turned by more than 41",
    ),
    (
        "do not trust",
        {"rows": {"angle": {"p90": 141.0}}},
        "a tenth of the mean curvature vectors are turned by more than",
    ),
    ("agrees", {"rows": {"angle": {"median": 39.0, "p90": 139.0}}}, None),
    ("do not trust", {"rows": {"ratio": {"median": 1.6}}}, "1.6 times as long as the mesh's"),
    ("do not trust", {"rows": {"functions": 0.81}}, "mapped differently, by 81%"),
    ("agrees", {"rows": {"angle": {}}}, None),  # all is flat
    ("do not trust", {"rows": {"eigenvalue_ratio": 0.66}}, "0.66 times those of the mesh"),
    ("agrees", {"rows": {"eigenvalue_ratio": 1.49}}, None),
    ("do not trust", {"rows": {"eigenvalue_ratio": np.nan}}, "nan times"),
    ("do not trust", {"rows": {"folded": 3}}, "do not go once around their point: 3"),
    ("do not trust", {"solid": {"genus": 3}}, "loops: 2 in the skeleton, 3 in the mesh"),
    ("do not trust", {"solid": {"solids": 2}}, "components: 1 in the skeleton, 2 in the mesh"),
    ("agrees in part", {"skeletons": {"missing": AWAY}}, "the mesh's skeleton ends at (1, 2, 3), the cloud's does not"),
    ("agrees in part", {"skeletons": {"extra": AWAY}}, "the skeleton ends at (1, 2, 3), the mesh's does not"),
    ("do not trust", {"skeletons": {"missing": 9 * AWAY, "extra": 9 * AWAY}}, "does not"),
    ("agrees in part", {"skeletons": {"doubt": 0.8}}, "the branch at (1, 2, 3) is a limb is a close call"),
    ("do not trust", {"skeletons": {"doubt": 1.3}}, "the branch at (1, 2, 3) is a limb is a close call"),
]


@pytest.mark.parametrize(("verdict", "changes", "reason"), CASES)
def test_verdicts_of_differences(verdict, changes, reason):
    actual, probability, reasons = judged(**changes)
    assert actual == verdict
    assert bool(reasons) == (reason is not None)
    assert all(reason in text for text in reasons)
    assert actual != "agrees" or probability >= 0.9


@pytest.mark.parametrize(
    ("fault", "reason"),
    [
        ({"mesh": (0.011, 0.0)}, "not where 1% of the points are"),
        ({"mesh": (0.0, 0.13)}, "tilted at 13% of the points"),
        ({"stop": f"solve 3 {REFUSED}: it broke"}, "contraction failed: solve 3"),
        ({"solid": {"solids": 3, "watertight": False}}, "the mesh is in 3 parts"),
        ({"solid": {"solids": 3, "made_by": "given"}}, "the mesh is in 3 parts"),
    ],
)
def test_a_mesh_at_fault_is_named_and_says_nothing_against_the_cloud(fault, reason):
    verdict, probability, reasons = judged(**fault, skeletons={"missing": AWAY})
    assert verdict == "cannot tell"
    assert reason in reasons[0]
    assert probability == judged()[1]


def test_a_mesh_at_fault_may_agree_all_the_same_but_not_one_of_something_else():
    verdict, _, reasons = judged(mesh=(0.05, 0.2))
    assert (verdict, len(reasons)) == ("agrees", 2)
    assert judged(mesh=(0.21, 0.0))[0] == "cannot tell"


def test_the_more_doubt_the_less_probable():
    actual = [judged(skeletons={"doubt": doubt})[1] for doubt in (0, 0.1, 0.5, 1, 2)]
    assert actual == sorted(actual, reverse=True)
    assert actual[0] > 0.98


def test_every_verdict_has_the_numbers_of_the_page():
    assert set(MEANINGS) == set(VERDICTS)
    page = (Path(__file__).parents[3] / "docs" / "crosscheck.md").read_text("utf-8")
    row = re.search(r"^\| all \|.*$", page, re.MULTILINE)[0]
    for verdict, (good, total) in zip(VERDICTS[:3], re.findall(r"(\d+) / (\d+)", row), strict=False):
        assert f"of {total} such clouds {good} had the right graph" in MEANINGS[verdict]
