"""What the report holds, without a browser."""

import base64
import dataclasses
import json
import math
import re

import numpy as np
import pytest

import glsk_o3d as glsk
from glsk_o3d import ContractionRecorder, Contractor, InvalidParameterError, RingBuilder, save_report
from glsk_o3d.judgements import Judgement
from glsk_o3d.report import IterationRecord, Report
from glsk_o3d.samples import torus
from glsk_o3d.viewing import html as sections
from glsk_o3d.viewing.figures import thinned


@pytest.fixture
def data(tmp_path):
    """Write a report and read the data of its view."""

    def read(skeleton, **options):
        save_report(skeleton, tmp_path / "r.html", **options)
        text = (tmp_path / "r.html").read_text("utf-8")
        return json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.DOTALL)[1])

    return read


def unpacked(text, dtype):
    return np.frombuffer(base64.b64decode(text), dtype)


# ---------------------------------------------------------------------------------------------------------- recorder


def test_every_solve_is_told_after_its_merges():
    states, records = [], []
    pipeline = RingBuilder() | Contractor(reducer=glsk.LPRReducer(), max_iterations=3)
    end = pipeline(torus(500).points, on_state=states.append, on_iteration=records.append)
    assert [state.report.iterations[-1] for state in states] == records == list(end.report.iterations)
    assert [len(state) for state in states] == [record.n_points - record.n_merged for record in records]
    np.testing.assert_array_equal(states[-1].positions, end.positions)


def test_the_record_follows_every_point():
    points, states, recorder = torus(400).points, [], ContractionRecorder()
    pipeline = RingBuilder() | Contractor(reducer=glsk.LPRReducer(), max_iterations=3)
    pipeline(points, on_state=lambda state: (recorder(state), states.append(state)))
    np.testing.assert_array_equal(recorder.positions[0], points)
    for state, positions in zip(states, recorder.positions[1:], strict=True):
        np.testing.assert_array_equal(positions[state.point_of_survivor], state.contracted)
    assert len(np.unique(recorder.positions[3], axis=0)) == len(states[2])


def test_a_second_run_starts_a_new_record(run):
    recorder = ContractionRecorder(most_points=50)
    for n in (300, 200):
        (RingBuilder() | Contractor(max_iterations=2))(torus(n).points, on_state=recorder)
    assert [positions.shape for positions in recorder.positions] == [(50, 3)] * 3
    assert recorder.shown.max() < 200
    with pytest.raises(InvalidParameterError, match="another run"):
        save_report(run[0], "never.html", recorder=recorder)


def test_watching_changes_nothing(run):
    again = glsk.skeletonize(run[0].points)
    np.testing.assert_array_equal(again.vertices, run[0].vertices)
    assert again.report.stages == run[0].report.stages


def test_thinning_is_random_and_repeatable():
    points = np.zeros((1000, 3))
    points[::2] = np.nan
    shown = thinned(points, 100)
    assert len(shown) == len(np.unique(shown)) == 100
    assert (shown % 2 == 1).all()
    assert len(np.unique(np.diff(shown))) > 3
    np.testing.assert_array_equal(shown, thinned(points, 100))
    np.testing.assert_array_equal(thinned(points, 500), np.arange(1, 1000, 2))


# -------------------------------------------------------------------------------------------------------------- view


@pytest.mark.parametrize("offset", [0, 1e6])
def test_positions_come_through(data, offset):
    recorder = ContractionRecorder()
    skeleton = glsk.skeletonize(torus(600).points * 7 + offset, on_state=recorder)
    held = data(skeleton, recorder=recorder)
    centre = (np.concatenate([skeleton.points, skeleton.vertices]).min(axis=0) + skeleton.points.max(axis=0)) / 2
    diagonal = np.linalg.norm(np.ptp(skeleton.points, axis=0))
    positions = unpacked(held["positions"], "<i2").reshape(-1, 600, 3) / 32767 * held["unit"] + centre
    np.testing.assert_allclose(positions, recorder.positions, atol=diagonal / 50_000)
    vertices = unpacked(held["vertices"], "<f4").reshape(-1, 3) * held["unit"] + centre
    np.testing.assert_allclose(vertices, skeleton.vertices, atol=1e-6 * diagonal)
    np.testing.assert_allclose(unpacked(held["radii"], "<f4") * held["unit"], skeleton.radii, rtol=1e-6)
    np.testing.assert_array_equal(unpacked(held["edges"], "<u4").reshape(-1, 2), skeleton.edges)
    np.testing.assert_array_equal(unpacked(held["vertex_of_point"], "<i4"), skeleton.vertex_of_point)
    np.testing.assert_array_equal(unpacked(held["branch_of_point"], "<i4"), skeleton.segment())
    colours = [[int(hexa[i : i + 2], 16) / 255 for i in (1, 3, 5)] for hexa in held["palette"]]
    lines = np.asarray(skeleton.to_line_set("branch").colors)
    np.testing.assert_allclose(np.array(colours)[unpacked(held["branch_of_edge"], "<i4")], lines, atol=0.003)
    assert len(held["captions"]) == len(skeleton.report.iterations) + 1


def test_large_clouds_are_thinned_and_the_page_says_so(data, tree, tmp_path):
    n = 50_000
    points = np.random.default_rng(0).normal(size=(n, 3))
    many = dataclasses.replace(tree, points=points, normals=points, vertex_of_point=np.arange(n) % 6)
    held = data(many)
    assert len(unpacked(held["positions"], "<i2")) == 3 * 20_000
    assert "The view shows 20,000 of 50,000 points" in (tmp_path / "r.html").read_text("utf-8")
    assert (tmp_path / "r.html").stat().st_size < 1_000_000


def test_points_that_are_not_finite_are_not_called_thinned(run, tmp_path):
    points = np.vstack([torus(300).points, np.full((5, 3), np.nan)])
    recorder = ContractionRecorder()
    pipeline = RingBuilder(drop_invalid=True) | Contractor(max_iterations=2) | glsk.Connector() | glsk.Refiner()
    for watched in (recorder, None):
        save_report(pipeline(points, on_state=recorder), tmp_path / "r.html", recorder=watched)
        assert "drawn at random" not in (tmp_path / "r.html").read_text("utf-8")


def test_unknown_radii_and_lone_vertices(data, forest):
    held = data(dataclasses.replace(forest, radii=[1, math.nan, 1, 1, 1, 1], confidence=[math.nan] * 6))
    assert list(held["ranges"]) == ["branch"]
    assert unpacked(held["edges"], "<u4").reshape(-1, 2).tolist() == [[0, 3], [1, 2], [2, 5], [4, 4]]
    assert unpacked(held["branch_of_edge"], "<i4").tolist() == [0, 1, 1, 2]


@pytest.mark.parametrize(
    ("sides", "view"), [((1, 3, 2), "yz"), ((3, 1, 2), "xz"), ((3, 2, 1), "xy"), ((3, 3, 3), "xz")]
)
def test_starts_with_the_broad_side(data, make, sides, view):
    corners = make(np.array([[0, 0, 0], sides]), [[0, 1]])
    assert data(dataclasses.replace(corners, points=(), normals=(), vertex_of_point=()))["view"] == view


# -------------------------------------------------------------------------------------------------------------- file


def test_any_skeleton_makes_a_page_that_asks_for_nothing(skeleton, tmp_path):
    save_report(skeleton, tmp_path / "r.html")
    text = (tmp_path / "r.html").read_text("utf-8")
    addresses = re.findall(r"""[^.](?:src|href|action)\s*=\s*["']?([^"'\s>]+)|url\(([^)]*)\)|@import""", text)
    assert [address[:11] for address, _ in addresses] == ["data:image/"]
    assert "default-src 'none'" in text
    assert not re.search(r"\{\{\w+\}\}", text)
    assert [path.name for path in tmp_path.iterdir()] == ["r.html"]


def test_names_that_are_no_unicode(tree, tmp_path):
    save_report(tree, tmp_path / "r.html", title="caf\udce9.ply")
    assert "<title>caf?.ply</title>" in (tmp_path / "r.html").read_text("utf-8")


# ---------------------------------------------------------------------------------------------------------- sections


def test_a_recipe_takes_the_place_of_the_stages(tree):
    assert "<summary>Recipe</summary>" not in sections.origin(tree.report)
    told = dataclasses.replace(tree.report, stages=("RingBuilder(k=5)",))
    assert "RingBuilder(k=5)" in sections.origin(told)
    told = dataclasses.replace(told, recipe={"pipeline": [{"filter": "RingBuilder", "k": "<5>"}]})
    assert "&quot;k&quot;: &quot;&lt;5&gt;&quot;" in sections.origin(told)
    assert "RingBuilder(k=5)" not in sections.origin(told)


def test_charts_leave_out_what_is_not_finite():
    names = [field.name for field in dataclasses.fields(IterationRecord)]
    rows = [(1, 100), (2, 50), (3, 25)]
    records = [IterationRecord(**dict.fromkeys(names, 0) | {"iteration": i, "n_points": n}) for i, n in rows]
    records[1] = dataclasses.replace(records[1], explained_change=math.nan)
    chart = sections._chart("n", records, "n_points", ",.4g")
    ys = [float(y) for y in re.findall(r'<circle data-at="\d" cx="[\d.]+" cy="([\d.]+)"', chart)]
    zero, top = 128, 12
    np.testing.assert_allclose(ys, [top, zero - (zero - top) / 2, zero - (zero - top) / 4], atol=0.06)
    assert re.findall(r'data-at="(\d)"', sections._chart("De", records, "explained_change", ".3g")) == ["1", "3"]


@pytest.mark.parametrize(
    ("stop", "words"),
    [
        (glsk.ExplainedScore(threshold=0.2), ["stops below 0.2"]),
        (glsk.RingSizeRatio(), []),
        (lambda iterations: "enough", []),
    ],
)
def test_the_chart_of_the_score_shows_where_its_rule_stops(stop, words):
    report = (RingBuilder() | Contractor(stop=stop, max_iterations=2))(torus(300).points).report
    text = sections.contraction(report)
    assert re.findall("stops below [0-9.]+", text) == words
    lines = re.findall(r'class="threshold".*? y1="([\d.]+)"', text)
    tops = re.findall(r'text-anchor="end">([\d.]+)</text>', text)  # three of each chart
    assert [float(y) for y in lines] == [pytest.approx(128 - 0.2 / float(tops[5]) * 116, abs=0.06) for _ in words]
    assert not words or float(tops[5]) >= 0.2


@pytest.mark.parametrize("stop", [None, 3, {}, {"rule": "ExplainedScore"}, {"rule": "ExplainedScore", "threshold": ""}])
def test_recipes_that_tell_no_threshold(tree, stop):
    report = dataclasses.replace(tree.report, recipe={"pipeline": ["?", {"filter": "Contractor", "stop": stop}]})
    assert "stops below" not in sections.contraction(report)


@pytest.mark.parametrize(("value", "top"), [(0, 1), (0.03, 0.03), (0.031, 0.04), (22367, 30000), (1, 1), (9.5, 10)])
def test_round_tops(value, top):
    assert sections._round_up(value) == pytest.approx(top, rel=1e-12)


def test_warnings_once_each():
    assert sections.warnings(()) == ""
    assert sections.warnings(["<a>", "b", "<a>"]).count("<li>") == 2


@pytest.mark.parametrize(("kept", "told"), [(0, False), (100, False), (40, True)])
def test_a_sample_is_told_of_where_there_was_one(kept, told):
    text = sections.origin(Report(n_input=100, n_sampled=kept, n_distinct=kept))
    assert ("sampled from a large cloud" in text) is told
    assert "input points" in text


# ---------------------------------------------------------------------------------------------------------- topology


def judged(*pairs):
    return Report(
        judgements=tuple(Judgement("gap", (float(i), 0.0, 0.0), p, changed) for i, (p, changed) in enumerate(pairs))
    )


def test_what_changed_and_close_calls_are_listed_the_closest_first():
    text = sections.topology(judged((0.99, True), (0.01, False), (0.6, True), (0.45, False)))
    assert "gap bridged: 2, gap left: 2; 2 of 4 close calls." in text
    places = re.findall(r"the gap at \((\d), 0, 0\)", text)
    assert places == ["3", "2", "0"]
    assert re.findall(r'<tr class="uncertain"><td>(.*?)</td>', text) == ["gap left", "gap bridged"]


def test_clear_answers_that_changed_nothing_are_only_counted():
    assert sections.topology(Report()) == ""
    text = sections.topology(judged((0.01, False), (0.02, False)))
    assert "gap left: 2; 0 of 2 close calls." in text
    assert "<table" not in text


def test_the_list_of_judgements_is_short():
    text = sections.topology(judged(*[(0.5, True)] * (sections.MOST_LISTED_ROWS + 3)))
    assert text.count("<td>gap bridged</td>") == sections.MOST_LISTED_ROWS
    assert "and 3 clearer ones" in text


def test_the_page_tells_how_the_topology_was_judged(tree, tmp_path):
    judgement = Judgement("loop", (1.0, 2.0, 3.0), 0.55, changed=False)
    save_report(
        dataclasses.replace(tree, report=dataclasses.replace(tree.report, judgements=(judgement,))), tmp_path / "r.html"
    )
    assert judgement.question in (tmp_path / "r.html").read_text("utf-8")
