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

    def test_the_handle_of_a_pot_is_one_if_the_loop_goes_through_the_wall(self):
        """From one foot to the other the way along the handle is shorter than that through the middle of the pot."""
        handle = [(0.9, -0.3, 0), (1.5, -0.3, 0), (1.5, 0.3, 0), (0.9, 0.3, 0)]
        nodes = np.array([(0, -1, 0), (0, -0.3, 0), (0, 0.3, 0), (0, 1, 0), *handle])
        edges = np.array([(0, 1), (1, 2), (2, 3), (1, 4), (4, 5), (5, 6), (6, 7), (7, 2)])
        pot = Truth(nodes, edges, np.array([1.0, 1, 1, 1, 0.05, 0.05, 0.05, 0.05]))
        loop = np.array([(1.02, -0.3, 0), *handle[1:3], (1.02, 0.3, 0)])
        assert questions.Placed(pot, loop).is_handle(np.arange(4))
        to_and_fro = np.array([(0.9, -0.3, 0), (1.5, -0.3, 0), (1.5, 0, 0), (1.5, -0.25, 0)])
        assert not questions.Placed(pot, to_and_fro).is_handle(np.arange(4))

    def test_asks_what_the_refiner_asks(self):
        """Of the same skeletons: what a clean cloud is asked has the probabilities that the report has."""
        cloud, pipeline = y_junction(1200), default()
        found = [*questions.asked(cloud.points, Truth(cloud.nodes, cloud.edges, cloud.radii), pipeline)]
        told = [(about, bool(is_so)) for about, _, is_so in found]
        assert told.count(("limb", True)) == 3
        assert not {("limb", False), ("air", True)} & {*told}
        asked = [(about, logistic(calibrate.ASKED[about].weights, facts)) for about, facts, _ in found]
        assert sorted(asked) == sorted((it.about, it.probability) for it in pipeline(cloud.points).report.decisions)


def asked(n=6000):
    """Questions whose answers are drawn with the probabilities of a logistic model."""
    rng = np.random.default_rng(0)
    facts = rng.normal(size=(n, 2))
    is_so = rng.random(n) < expit(facts @ [2, -1] - 0.5)
    return [
        dict(facts=dict(one=a, other=b), is_so=so, share=1) for (a, b), so in zip(facts.tolist(), is_so, strict=True)
    ]


class TestArithmetic:
    def test_the_weights_that_made_the_answers_are_found(self):
        weights = calibrate.fitted(asked())
        np.testing.assert_allclose([*weights.values()], [-0.5, 2, -1], atol=0.15)
        assert [*weights] == ["constant", "one", "other"]
        some = asked(500)
        lies = [it | dict(is_so=not it["is_so"], share=1e-9) for it in some]  # a cloud with very many counts once
        found, known = ([*calibrate.fitted(these).values()] for these in ([*some, *lies], some))
        np.testing.assert_allclose(found, known, rtol=0.03)  # the penalty counts half, of twice as many
        plain = [it | dict(is_so=it["facts"]["one"] > 0) for it in asked(200)]
        assert 2 < calibrate.fitted(plain)["one"] < 20  # an answer that one fact gives away has finite weights

    def test_loss_and_area_in_closed_form(self):
        is_so = np.array([True, True, False, False])
        assert calibrate.log_loss(np.full(4, 0.5), is_so) == pytest.approx(np.log(2))
        assert np.isfinite(calibrate.log_loss(1.0 - is_so, is_so))
        for chance, area in (([0.9, 0.8, 0.1, 0.2], 1), ([0.1] * 4, 0.5), ([0.9, 0.3, 0.5, 0.1], 0.75)):
            assert calibrate.area_under_curve(np.array(chance), is_so) == area
        assert np.isnan(calibrate.area_under_curve(np.ones(2), is_so[:2]))


class TestCommands:
    def test_on_tiny_clouds(self, call, small, tmp_path):
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
        told = call("check", saved, "--page", page)
        assert told.count("| a branch is a limb |") == 3
        assert page.read_text().count("| a branch is a limb |") == 3
        assert (tmp_path / "images" / "probabilities.png").read_bytes().startswith(b"\x89PNG")
        call("transfer", saved, small.path, "--jobs", 0, "--page", page)
        assert "| trees | 3 | 1.00 | 1.00 |" in page.read_text()
        assert "| all | 7 |" in page.read_text()
