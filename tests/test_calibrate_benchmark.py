"""The calibration: its labels on shapes where they are plain, its arithmetic, and its commands on tiny clouds."""

import json

import numpy as np
import pytest
from glsk_studies import calibrate, questions
from scipy.special import expit

from glsk_o3d.analysis import Truth
from glsk_o3d.data.decisions import logistic
from glsk_o3d.pipelines import default
from glsk_o3d.samples import y_junction

STUDY = calibrate


def ring(n, turn=0.0):
    angle = 2 * np.pi * (np.arange(n) + turn) / n
    return np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])


class TestLabels:
    def test_the_loop_of_a_ring_is_a_handle_and_one_that_only_goes_to_and_fro_is_none(self):
        axis = Truth(ring(40), np.column_stack([np.arange(40), np.roll(np.arange(40), -1)]), np.full(40, 0.1))
        placed = questions.Placed(axis, ring(17, 0.3))
        assert placed.is_handle(np.arange(17))
        assert placed.is_handle(np.arange(17)[::-1])
        assert not placed.is_handle(np.array([*range(10), *range(8, 0, -1)]))

    def test_questions_are_those_of_the_refiner(self):
        """Of the same skeletons: what a clean cloud is asked has the probabilities that the report has."""
        cloud, pipeline = y_junction(1200), default()
        questions_asked = [*questions.asked(cloud.points, Truth(cloud.nodes, cloud.edges, cloud.radii), pipeline)]
        answers = [(about, bool(is_so)) for about, _, is_so in questions_asked]
        assert answers.count(("limb", True)) == 3
        assert not {("limb", False), ("air", True)} & {*answers}
        asked = [(about, logistic(calibrate.ASKED[about].weights, facts)) for about, facts, _ in questions_asked]
        assert sorted(asked) == sorted((it.about, it.probability) for it in pipeline(cloud.points).report.decisions)


def answered(n=6000):
    """Questions whose answers are drawn with the probabilities of a logistic model."""
    rng = np.random.default_rng(0)
    facts = rng.normal(size=(n, 2))
    is_so = rng.random(n) < expit(facts @ [2, -1] - 0.5)
    shapes, families = ((np.arange(n) % several).astype(str) for several in (50, 3))
    return calibrate.Answered(["one", "other"], facts, is_so, shapes, families)


class TestArithmetic:
    def test_the_weights_that_made_the_answers_are_found(self):
        weights = calibrate.fitted(answered())
        np.testing.assert_allclose([*weights.values()], [-0.5, 2, -1], atol=0.15)
        assert [*weights] == ["constant", "one", "other"]
        plain = answered(200)  # an answer that one fact gives away has finite weights
        assert 2 < calibrate.fitted(plain._replace(is_so=plain.facts[:, 0] > 0))["one"] < 20

    def test_loss_and_area_in_closed_form(self):
        is_so = np.array([True, True, False, False])
        assert calibrate.log_loss(np.full(4, 0.5), is_so) == pytest.approx(np.log(2))
        assert np.isfinite(calibrate.log_loss(1.0 - is_so, is_so))
        for chance, area in (([0.9, 0.8, 0.1, 0.2], 1), ([0.1] * 4, 0.5), ([0.9, 0.3, 0.5, 0.1], 0.75)):
            assert calibrate.area_under_curve(np.array(chance), is_so) == area
        assert np.isnan(calibrate.area_under_curve(np.ones(2), is_so[:2]))


class TestCommands:
    def test_weights_are_fitted_checked_and_transferred(self, call, small, tmp_path):
        saved, page = tmp_path / "questions.json", tmp_path / "page.md"
        few = ("--builtin", "--shapes", "torus,y_junction", "--variant", "clean_512,noise2_512", "--jobs", 0)
        printed = call("fit", *few, "-o", saved)
        weights = {}
        exec(printed, weights)
        assert [*weights["limb"]] == [*calibrate.ASKED["limb"].weights]
        rows = json.loads(saved.read_text())["rows"]
        assert len(rows) == 4
        assert any(it["about"] == "loop" and it["is_so"] for row in rows for it in row["questions"])
        assert call("fit", saved) == printed

        page.write_text("<!-- check -->\n<!-- end -->\n<!-- transfer -->\n<!-- end -->\n")
        (tmp_path / "images").mkdir()
        answers = call("check", saved, "--markdown", "--page", page)
        assert answers.count("| a branch is a limb |") == 3
        assert page.read_text().count("| a branch is a limb |") == 3
        assert (tmp_path / "images" / "probabilities.png").read_bytes().startswith(b"\x89PNG")
        call("transfer", saved, small.path, "--jobs", 0, "--page", page)
        assert "| trees | 3 | 1.00 | 1.00 |" in page.read_text()
        assert "| all | 7 |" in page.read_text()
