"""The calibration: its labels on shapes where they are plain, its arithmetic, and its commands on tiny clouds."""

import json
import sys

import numpy as np
import pytest
from scipy.special import expit

from glsk_o3d.analysis import Truth
from glsk_o3d.decisions import QUESTIONS
from glsk_o3d.pipelines import default
from glsk_o3d.samples import y_junction


@pytest.fixture(scope="module")
def tool(benchmark):
    with benchmark("calibrate") as module:
        yield module


@pytest.fixture(scope="module")
def asking(tool):
    return sys.modules["_questions"]


@pytest.fixture(scope="module")
def judging(tool):
    return sys.modules["_calibration"]


def ring(n, turn=0.0):
    angle = 2 * np.pi * (np.arange(n) + turn) / n
    return np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])


def tubes(*lines):
    """Straight axes of radius 0.1, each from end to end."""
    nodes = np.array(lines, float).reshape(-1, 3)
    return Truth(nodes, np.arange(len(nodes)).reshape(-1, 2), np.full(len(nodes), 0.1))


class TestLabels:
    def test_the_loop_of_a_ring_is_a_handle_and_one_that_only_goes_to_and_fro_is_none(self, asking):
        axis = Truth(ring(40), np.column_stack([np.arange(40), np.roll(np.arange(40), -1)]), np.full(40, 0.1))
        placed = asking.Placed(axis, ring(17, 0.3))
        assert placed.is_handle(np.arange(17))
        assert placed.is_handle(np.arange(17)[::-1])
        assert not placed.is_handle(np.array([*range(10), *range(8, 0, -1)]))

    def test_of_a_loop_over_parts_that_are_not_joined_nothing_is_said(self, asking):
        axis = tubes([[0, 0, 0], [1, 0, 0]], [[0, 0.3, 0], [1, 0.3, 0]])
        placed = asking.Placed(axis, np.array([[0, 0, 0], [1, 0, 0], [1, 0.3, 0], [0, 0.3, 0]], float))
        assert placed.is_handle(np.arange(4)) is None

    def test_a_false_edge_between_parallel_tubes_crosses_air(self, asking):
        axis = tubes([[0, 0, 0], [2, 0, 0]], [[0, 0.3, 0], [2, 0.3, 0]])
        x = np.linspace(0, 1, 21)
        path = np.concatenate([np.column_stack([x, 0 * x, 0 * x]), np.column_stack([1 + x, 0 * x + 0.3, 0 * x])])
        placed = asking.Placed(axis, path)
        near = [placed.crosses_air(np.arange(42), k) for k in range(41)]
        assert np.flatnonzero(near).tolist() == list(range(20 - asking.NEAR, 21 + asking.NEAR))
        assert not placed.joined(20, 21)

    def test_a_long_way_round_is_air_and_a_corner_is_not(self, asking):
        nodes = np.array([[0, 0, 0], [2, 0, 0], [2, 0.4, 0], [0, 0.4, 0]], float)
        axis = Truth(nodes, [[0, 1], [1, 2], [2, 3]], np.full(4, 0.1))
        placed = asking.Placed(axis, np.array([[0, 0, 0], [0, 0.4, 0], [1.8, 0, 0], [2, 0.2, 0]]))
        assert placed.apart(np.array([0, 2]), np.array([1, 3])).tolist() == [True, False]
        assert placed.joined(np.array([0, 2]), np.array([1, 3])).tolist() == [False, True]

    def test_a_gap_in_one_tube_is_bridged(self, asking):
        placed = asking.Placed(tubes([[0, 0, 0], [2, 0, 0]]), np.array([[0.5, 0.02, 0], [1.1, 0, 0.02]]))
        assert placed.joined(0, 1)

    def test_the_place_of_a_thin_part_is_on_it(self, asking):
        nodes = np.array([[0, 0, 0], [2, 0, 0], [1, 0, 0], [1, 1, 0]], float)
        axis = Truth(nodes, [[0, 2], [2, 1], [2, 3]], np.array([0.3, 0.3, 0.3, 0.02]))
        placed = asking.Placed(axis, np.array([[1, 0.8, 0], [0.9, 0.1, 0]]))
        np.testing.assert_allclose(placed._points[placed.place][:, 1], [0.8, 0], atol=0.05)

    def test_asks_what_the_refiner_asks(self, asking, judging):
        """Of the same skeletons: what a clean cloud is asked has the probabilities that the report has."""
        cloud, pipeline = y_junction(1200), default()
        found = [*asking.asked(cloud.points, Truth(cloud.nodes, cloud.edges, cloud.radii), pipeline)]
        told = [(about, bool(is_so)) for about, _, is_so in found]
        assert told.count(("limb", True)) == 3
        assert not {("limb", False), ("air", True)} & {*told}
        asked = [(about, QUESTIONS[about].probability(facts)) for about, facts, _ in found]
        less, more, _ = sorted(row for row in asked if row[0] == "limb")  # the report's is that both prongs are limbs
        asked[asked.index(less)] = "limb", less[1] * more[1]
        assert sorted(asked) == sorted((it.about, it.probability) for it in pipeline(cloud.points).report.decisions)


def answered(judging, n=6000):
    """Questions whose answers are drawn with the probabilities of a logistic model."""
    rng = np.random.default_rng(0)
    facts = rng.normal(size=(n, 2))
    is_so = rng.random(n) < expit(facts @ [2, -1] - 0.5)
    shapes, families = ((np.arange(n) % several).astype(str) for several in (50, 3))
    return judging.Answered(["one", "other"], facts, is_so, shapes, families)


class TestArithmetic:
    def test_the_weights_that_made_the_answers_are_found(self, judging):
        weights = judging.fitted(answered(judging))
        np.testing.assert_allclose([*weights.values()], [-0.5, 2, -1], atol=0.15)
        assert [*weights] == ["constant", "one", "other"]
        plain = answered(judging, 200)  # an answer that one fact gives away has finite weights
        assert 2 < judging.fitted(plain._replace(is_so=plain.facts[:, 0] > 0))["one"] < 20

    def test_calibrated_is_what_is_so_as_often_as_said(self, judging):
        those = answered(judging)
        chance = judging.said(dict(constant=-0.5, one=2, other=-1), those)
        counts, means, often = zip(*judging.parts(chance, those), strict=True)
        assert sum(counts) == len(chance)
        np.testing.assert_allclose([it[0] for it in often], means, atol=0.05)
        np.testing.assert_allclose(judging.without_family(those, those), chance, atol=0.05)

    def test_loss_and_area_in_closed_form(self, judging):
        is_so = np.array([True, True, False, False])
        assert judging.log_loss(np.full(4, 0.5), is_so) == pytest.approx(np.log(2))
        assert np.isfinite(judging.log_loss(1.0 - is_so, is_so))
        for chance, area in (([0.9, 0.8, 0.1, 0.2], 1), ([0.1] * 4, 0.5), ([0.9, 0.3, 0.5, 0.1], 0.75)):
            assert judging.area_under_curve(np.array(chance), is_so) == area
        assert np.isnan(judging.area_under_curve(np.ones(2), is_so[:2]))

    def test_weights_are_used_and_put_back(self, judging):
        case = sys.modules["_clouds"].Case("torus", "clean_512")
        before = dict(QUESTIONS)
        whole = judging.measure(case, {"loop": before["loop"].weights})
        never = judging.measure(case, {"loop": {**before["loop"].weights, "constant": -99.0}})
        assert (whole["loops"], never["loops"]) == (0, -1)
        assert before == QUESTIONS

    def test_the_table_of_transfer(self, judging):
        rows = [
            dict(family=family, shape=f"{family}_{seed}", variant="clean", weights=weights, topology=right, perfect=0.0)
            for family in ("rings", "knots")
            for seed in range(4)
            for weights, right in ((judging.SEEN, 1.0), (judging.UNSEEN, float(family == "rings")))
        ]
        rows[-1] = {name: value for name, value in rows[-1].items() if name != "topology"} | {"failure": "no"}
        _, header, lines = judging.table(rows)
        assert [line[:2] for line in lines] == [["rings", "4"], ["knots", "4"], ["all", "8"]]
        assert lines[0][2:5] == ["1.00", "1.00", "+0.00 [+0.00, +0.00]"]
        assert lines[1][2:5] == ["1.00", "0.00", "-1.00 [-1.00, -1.00]"]
        assert lines[2][4].startswith("-0.50 [")
        assert len(header) == len(lines[0])


class TestCommands:
    def test_on_tiny_clouds(self, call, small, tmp_path):
        saved, page = tmp_path / "questions.json", tmp_path / "page.md"
        few = ("--builtin", "--shapes", "torus,y_junction", "--variant", "clean_512,noise2_512", "--jobs", 0)
        printed = call("fit", *few, "-o", saved)
        weights = {}
        exec(printed, weights)
        assert [*weights["limb"]] == [*QUESTIONS["limb"].weights]
        rows = json.loads(saved.read_text())["rows"]
        assert len(rows) == 4
        assert any(it["about"] == "loop" and it["is_so"] for row in rows for it in row["questions"])
        assert call("fit", saved) == printed

        page.write_text("<!-- check -->\n<!-- end -->\n<!-- transfer -->\n<!-- end -->\n")
        (tmp_path / "images").mkdir()
        told = call("check", saved, "--markdown", "--page", page)
        assert told.count("| a branch is a limb |") == 3
        assert page.read_text().count("| a branch is a limb |") == 2
        assert (tmp_path / "images" / "probabilities.png").read_bytes().startswith(b"\x89PNG")
        call("transfer", saved, small.path, "--jobs", 0, "--page", page)
        assert "| trees | 3 | 1.00 | 1.00 |" in page.read_text()
        assert "| all | 7 |" in page.read_text()

    def test_families_are_left_out(self, call, tmp_path):
        saved, rows = tmp_path / "questions.json", []
        for family, slope in (("even", 1), ("odd", -1)):  # what one teaches is wrong of the other
            those = [dict(about="limb", facts=dict(reach=slope * x), is_so=x > 0) for x in (-2, -1, -0.5, 0.5, 1, 2)]
            rows.append(dict(shape=f"{family}_1", family=family, questions=those))
        saved.write_text(json.dumps(dict(rows=rows)))
        lines = call("check", saved, "--leave-family-out", "--markdown").splitlines()
        assert [line.split("|")[-2].strip() for line in lines if "even" in line or "odd" in line] == ["0.000"] * 2

    @pytest.mark.parametrize("wrong", [("nowhere",), ("--page", "nowhere.md"), ("--from", "nowhere.json")])
    def test_what_is_not_there_is_said(self, call, wrong):
        call("check", *wrong, code=2)
