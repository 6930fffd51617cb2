"""The calibration: its labels on shapes where they are plain, its arithmetic, and its commands on tiny clouds."""

import json
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.special import expit

from glsk_o3d.analysis import Truth
from glsk_o3d.pipelines import default
from glsk_o3d.refinement import scores
from glsk_o3d.samples import y_junction

TINY = ("--builtin", "--shapes", "torus,y_junction", "--variant", "clean_512,noise2_512", "--jobs", 0)


@pytest.fixture(scope="module")
def tool(benchmark):
    with benchmark("calibrate") as module:
        yield module


@pytest.fixture(scope="module")
def parts(tool):
    """The modules that it is made of, by their names."""
    found = ((name.split("."), module) for name, module in sys.modules.items())
    return SimpleNamespace(**{name[1]: module for name, module in found if name[0] == "_calibration" and name[1:]})


def ring(n, turn=0.0):
    angle = 2 * np.pi * (np.arange(n) + turn) / n
    return np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])


def tubes(*lines, radius=0.1):
    """Straight axes, each from end to end."""
    nodes = np.array(lines, float).reshape(-1, 3)
    return Truth(nodes, np.arange(len(nodes)).reshape(-1, 2), np.full(len(nodes), radius))


class TestLabels:
    def test_places_divide_every_edge(self, parts):
        axis = Truth([[0, 0, 0], [1, 0, 0], [1, 0.01, 0], [3, 0.01, 0]], [[1, 0], [1, 2], [2, 3]], [0.1, 0.1, 0.1, 0.3])
        points, radii, links = parts.labels._places(axis)
        assert len(links) == 34 + 1 + 67
        assert len(points) == len(links) + 1
        lengths = np.linalg.norm(points[links[:, 0]] - points[links[:, 1]], axis=1)
        assert lengths.max() <= parts.labels.STEP * 0.1
        assert lengths.sum() == pytest.approx(3.01)
        there = points[:, 0] > 1
        np.testing.assert_allclose(radii[there], 0.1 + 0.1 * (points[there, 0] - 1))

    def test_the_loop_of_a_ring_is_a_handle_and_one_that_only_goes_to_and_fro_is_none(self, parts):
        axis = Truth(ring(40), np.column_stack([np.arange(40), np.roll(np.arange(40), -1)]), np.full(40, 0.1))
        placed = parts.labels.Placed(axis, ring(17, 0.3))
        assert placed.is_handle(np.arange(17))
        assert placed.is_handle(np.arange(17)[::-1])
        assert not placed.is_handle(np.array([0, 1, 2, 3, 2, 1]))
        assert not placed.is_handle(np.array([*range(10), *range(8, 0, -1)]))

    def test_of_a_loop_over_parts_that_are_not_joined_nothing_is_said(self, parts):
        axis = tubes([[0, 0, 0], [1, 0, 0]], [[0, 0.3, 0], [1, 0.3, 0]])
        placed = parts.labels.Placed(axis, np.array([[0, 0, 0], [1, 0, 0], [1, 0.3, 0], [0, 0.3, 0]], float))
        assert placed.is_handle(np.arange(4)) is None

    def test_a_false_edge_between_parallel_tubes_crosses_air(self, parts):
        axis = tubes([[0, 0, 0], [2, 0, 0]], [[0, 0.3, 0], [2, 0.3, 0]])
        x = np.linspace(0, 1, 21)
        path = np.concatenate([np.column_stack([x, 0 * x, 0 * x]), np.column_stack([1 + x, 0 * x + 0.3, 0 * x])])
        placed, branch = parts.labels.Placed(axis, path), np.arange(42)
        near = [placed.crosses_air(branch, k) for k in range(41)]
        assert np.flatnonzero(near).tolist() == list(range(20 - parts.labels.NEAR, 21 + parts.labels.NEAR))
        assert not placed.joined(20, 21)

    def test_a_long_way_round_is_air_and_a_corner_is_not(self, parts):
        nodes = np.array([[0, 0, 0], [2, 0, 0], [2, 0.4, 0], [0, 0.4, 0]], float)
        axis = Truth(nodes, [[0, 1], [1, 2], [2, 3]], np.full(4, 0.1))
        placed = parts.labels.Placed(axis, np.array([[0, 0, 0], [0, 0.4, 0], [1.8, 0, 0], [2, 0.2, 0]]))
        assert placed.apart(np.array([0, 2]), np.array([1, 3])).tolist() == [True, False]
        assert placed.joined(np.array([0, 2]), np.array([1, 3])).tolist() == [False, True]

    def test_a_gap_in_one_tube_is_bridged(self, parts):
        placed = parts.labels.Placed(tubes([[0, 0, 0], [2, 0, 0]]), np.array([[0.5, 0.02, 0], [1.1, 0, 0.02]]))
        assert placed.joined(0, 1)

    def test_the_place_of_a_thin_part_is_on_it(self, parts):
        nodes = np.array([[0, 0, 0], [2, 0, 0], [1, 0, 0], [1, 1, 0]], float)
        axis = Truth(nodes, [[0, 2], [2, 1], [2, 3]], np.array([0.3, 0.3, 0.3, 0.02]))
        placed = parts.labels.Placed(axis, np.array([[1, 0.8, 0], [0.9, 0.1, 0]]))
        np.testing.assert_allclose(placed._points[placed.place][:, 1], [0.8, 0], atol=0.05)


def test_a_clean_shape_has_no_air_and_all_its_limbs(parts):
    drawn = y_junction(2000)
    found = [*parts.questions.asked(drawn.points, Truth(drawn.nodes, drawn.edges, drawn.radii), default())]
    told = [(about, bool(is_so)) for about, _, is_so in found]
    assert told.count(("limb", True)) == 3
    assert ("limb", False) not in told
    assert ("air", True) not in told
    for about, facts, _ in found:
        assert {*facts} == {*parts.fitting.packaged(about)} - {"constant"}


def answered(parts, n=6000, families=3, seed=0):
    """Questions whose answers are drawn with the probabilities of a logistic model."""
    rng = np.random.default_rng(seed)
    facts = rng.normal(size=(n, 2))
    is_so = rng.random(n) < expit(facts @ [2, -1] - 0.5)
    family = (np.arange(n) % families).astype(str)
    return parts.fitting.Answered(["one", "other"], facts, is_so, (np.arange(n) % 50).astype(str), family)


class TestArithmetic:
    def test_the_weights_that_made_the_answers_are_found(self, parts):
        weights = parts.fitting.fitted(answered(parts))
        np.testing.assert_allclose([*weights.values()], [-0.5, 2, -1], atol=0.15)
        assert [*weights] == ["constant", "one", "other"]

    def test_an_answer_that_one_fact_gives_away_has_finite_weights(self, parts):
        plain = answered(parts, 200)
        weights = parts.fitting.fitted(plain._replace(is_so=plain.facts[:, 0] > 0))
        assert 2 < weights["one"] < 20

    def test_calibrated_is_what_is_so_as_often_as_said(self, parts):
        those = answered(parts)
        chance = parts.fitting.said(dict(constant=-0.5, one=2, other=-1), those)
        counts, means, often = zip(*parts.reliability.parts(chance, those), strict=True)
        assert sum(counts) == len(chance)
        np.testing.assert_allclose([it[0] for it in often], means, atol=0.05)
        left_out = parts.reliability.without_family(those, those)
        np.testing.assert_allclose(left_out, chance, atol=0.05)

    def test_loss_and_area_in_closed_form(self, parts):
        is_so = np.array([True, True, False, False])
        assert parts.reliability.log_loss(np.full(4, 0.5), is_so) == pytest.approx(np.log(2))
        assert np.isfinite(parts.reliability.log_loss(1.0 - is_so, is_so))
        for chance, area in (([0.9, 0.8, 0.1, 0.2], 1), ([0.1] * 4, 0.5), ([0.9, 0.3, 0.5, 0.1], 0.75)):
            assert parts.reliability.area_under_curve(np.array(chance), is_so) == area
        assert np.isnan(parts.reliability.area_under_curve(np.ones(2), is_so[:2]))


class TestCommands:
    def test_on_tiny_clouds(self, call, tmp_path):
        saved, page = tmp_path / "questions.json", tmp_path / "page.md"
        printed = call("fit", *TINY, "-o", saved)
        weights = {}
        exec(printed, weights)
        assert {"AIR_WEIGHTS", "LIMB_WEIGHTS"} <= {*weights}
        assert [*weights["LIMB_WEIGHTS"]] == [*scores.LIMB_WEIGHTS]
        rows = json.loads(saved.read_text())["rows"]
        assert len(rows) == 4
        assert any(it["about"] == "loop" and it["is_so"] for row in rows for it in row["questions"])
        assert call("fit", saved) == printed

        page.write_text("above\n<!-- check -->\n<!-- end -->\n")
        (tmp_path / "images").mkdir()
        told = call("check", saved, "--markdown", "--page", page)
        assert told.count("| a branch is a limb |") == 3
        assert page.read_text().count("| a branch is a limb |") == 2
        assert (tmp_path / "images" / "probabilities.png").read_bytes().startswith(b"\x89PNG")

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


def test_asks_what_the_refiner_asks(parts):
    """Of the same skeletons: what a clean cloud is asked has the probabilities that the report has."""
    cloud, pipeline = y_junction(1200), default()
    truth = Truth(cloud.nodes, cloud.edges, cloud.radii)
    told = {"loop": "HANDLE_WEIGHTS", "air": "AIR_WEIGHTS", "gap": "BRIDGE_WEIGHTS", "limb": "LIMB_WEIGHTS"}
    asked = [
        (about, scores.probability(getattr(scores, told[about]), facts))
        for about, facts, _ in parts.questions.asked(cloud.points, truth, pipeline)
    ]
    report = pipeline(cloud.points).report
    found = [(it.about, it.probability) for it in report.judgements]
    assert len(found) >= 6
    less, more, _ = sorted(row for row in asked if row[0] == "limb")  # the report's is that both prongs are limbs
    asked[asked.index(less)] = "limb", less[1] * more[1]
    assert sorted(asked) == sorted(found)


class TestTransfer:
    def test_weights_are_used_and_put_back(self, parts, benchmark):
        case = sys.modules["_common.clouds"].Case("torus", "clean_512")
        before = {name: dict(getattr(scores, name)) for name in parts.fitting.WEIGHTS.values()}
        whole = parts.transfer.measure(case, {"HANDLE_WEIGHTS": before["HANDLE_WEIGHTS"]})
        never = parts.transfer.measure(case, {"HANDLE_WEIGHTS": before["HANDLE_WEIGHTS"] | {"constant": -99.0}})
        assert (whole["loops"], never["loops"]) == (0, -1)
        assert before == {name: getattr(scores, name) for name in before}

    def test_a_family_is_left_out(self, parts):
        names, facts = ["f"], np.array([[1.0], [2.0], [3.0], [-1.0], [-2.0], [-3.0]] * 4)
        families = np.array(["a"] * 12 + ["b"] * 12)
        is_so = (facts[:, 0] > 0) == (families == "a")  # of b the other way round
        answered = {"limb": parts.fitting.Answered(names, facts, is_so, families, families)}
        found = {without: parts.transfer.weights_of(answered, without)["LIMB_WEIGHTS"]["f"] for without in "ab"}
        assert found["a"] < -0.5 < 0.5 < found["b"]
        assert abs(parts.transfer.weights_of(answered)["LIMB_WEIGHTS"]["f"]) < 0.1

    def test_table(self, parts):
        rows = [
            dict(
                family=family,
                shape=f"{family}_{seed}",
                variant="clean",
                weights=weights,
                topology=topology,
                perfect=0.0,
            )
            for family in ("rings", "knots")
            for seed in range(4)
            for weights, topology in ((parts.transfer.SEEN, 1.0), (parts.transfer.UNSEEN, float(family == "rings")))
        ]
        rows[-1] = {name: value for name, value in rows[-1].items() if name != "topology"} | {"failure": "no"}
        _, header, lines = parts.transfer.table(rows)
        assert [line[:2] for line in lines] == [["rings", "4"], ["knots", "4"], ["all", "8"]]
        assert lines[0][2:5] == ["1.00", "1.00", "+0.00 [+0.00, +0.00]"]
        assert lines[1][2:5] == ["1.00", "0.00", "-1.00 [-1.00, -1.00]"]
        assert lines[2][4].startswith("-0.50 [")
        assert len(header) == len(lines[0])

    def test_command(self, tool, call, small, tmp_path):
        call("fit", *TINY, "-o", tmp_path / "asked.json")
        page = tmp_path / "page.md"
        page.write_text("<!-- transfer -->\n<!-- end -->\n")
        call("transfer", tmp_path / "asked.json", small.path, "--jobs", 0, "--page", page)
        assert "| trees | 3 | 1.00 | 1.00 |" in page.read_text()
        assert "| all | 7 |" in page.read_text()
