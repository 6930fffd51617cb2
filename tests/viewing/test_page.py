"""What the report holds, without a browser."""

import dataclasses
import math
import re

import numpy as np
import pytest

import glsk_o3d as glsk
from glsk_o3d import save_report, to_line_set
from glsk_o3d.data.decisions import Decision, Supported
from glsk_o3d.data.report import IterationRecord, Report
from glsk_o3d.data.verdict import Reason
from glsk_o3d.editing import detailed
from glsk_o3d.samples import sauropod, torus
from glsk_o3d.viewing import page

# -------------------------------------------------------------------------------------------------------------- view


def test_the_traces_are_the_skeleton_up_to_scale():
    skeleton = glsk.skeletonize(torus(600).points * 7 + 1e6)
    cloud, curve, *others, tubes = page.traces(skeleton, skeleton.points)
    assert [other.name for other in others] == ["skeleton by radius", "skeleton by confidence"]
    diagonal = np.linalg.norm(np.ptp(np.concatenate([skeleton.points, skeleton.vertices]), axis=0))
    shown, exact = np.column_stack([cloud.x, cloud.y, cloud.z]), skeleton.points
    np.testing.assert_allclose((shown - shown[0]) * diagonal / 2, exact - exact[0], atol=1e-8)
    lines = np.column_stack([curve.x, curve.y, curve.z]).reshape(-1, 3, 3)
    exact = skeleton.vertices[skeleton.edges]
    np.testing.assert_allclose((lines[:, :2] - shown[0]) * diagonal / 2, exact - skeleton.points[0], atol=1e-8)
    assert np.isnan(lines[:, 2]).all()
    np.testing.assert_array_equal(curve.customdata[:, 2], skeleton.radii[curve.customdata[:, 0].astype(int)])
    assert len(tubes.x) == len(np.asarray(glsk.to_tubes(skeleton, sides=8).vertices))
    colors = [[int(color[i : i + 2], 16) / 255 for i in (1, 3, 5)] for color in curve.line.color[::3]]
    np.testing.assert_allclose(colors, np.asarray(to_line_set(skeleton, "branch").colors), atol=0.003)


def test_the_slider_shows_the_skeleton_with_other_limbs():
    skeleton = glsk.skeletonize(sauropod(2000).points)
    (slider,) = page.sliders(skeleton, skeleton.points)
    for least, step in zip(page.LIMB_STEPS, slider["steps"], strict=True):
        (changes, traces), other = step["args"], detailed(skeleton, limb=least)
        assert traces == [1]  # behind the cloud
        assert len(changes["x"][0]) == len(changes["line.color"][0]) == 3 * len(other.edges)
    assert slider["steps"][slider["active"]]["label"] == "0.5"
    assert page.sliders(dataclasses.replace(skeleton, report=glsk.Report()), skeleton.points) == []


def test_large_clouds_are_thinned(tree, tmp_path):
    points = np.random.default_rng(0).normal(size=(25_000, 3))
    large = dataclasses.replace(tree, points=points, normals=None, vertex_of_point=np.arange(25_000) % 6)
    save_report(large, tmp_path / "r.html")
    assert "The view shows 20,000 of 25,000 points" in (tmp_path / "r.html").read_text("utf-8")


def test_unknown_radii_and_detached_vertices(forest):
    unknown = dataclasses.replace(forest, radii=[1, math.nan, 1, 1, 1, 1], confidence=[math.nan] * 6)
    (curve,) = page.traces(unknown, np.empty((0, 3)))
    pairs = curve.customdata.reshape(-1, 3, 4)[:, :2]
    assert pairs[..., 0].tolist() == [[0, 3], [1, 2], [2, 5], [4, 4]]
    assert pairs[:, 0, 1].tolist() == [0, 1, 1, 2]


# -------------------------------------------------------------------------------------------------------------- file


def test_any_skeleton_makes_a_page(skeleton, tmp_path):
    save_report(skeleton, tmp_path / "r.html", title="caf\udce9.ply")  # no Unicode, as a file name may be
    text = (tmp_path / "r.html").read_text("utf-8")
    assert "default-src 'none'" in text
    assert "The view shows" not in text  # though some points are not finite
    assert "<title>caf?.ply</title>" in text
    assert [path.name for path in tmp_path.iterdir()] == ["r.html"]


HOSTILE = "<meta http-equiv=refresh content='//x'>\"'--><svg/onload=x>&lt;{digest}{0.__class__}%s$x^{\\\\frac$\x1b[2J"


@pytest.mark.parametrize("ending", [".json", ".npz"])
def test_no_text_of_a_file_becomes_part_of_the_page(tmp_path, tree, ending):
    place = (0.0, 0.0, 0.0)
    texts = dict(stop_reason=HOSTILE, stages=(HOSTILE,), reasons=(Reason("other", HOSTILE),), recipe={HOSTILE: HOSTILE})
    numbers = dict(n_draws=8, support=(Supported(HOSTILE, place, present=True, share=0.25),), seconds={HOSTILE: 1.0})
    report = dataclasses.replace(judged((0.5, True)), **texts, **numbers, versions={HOSTILE: HOSTILE})
    glsk.save_skeleton(dataclasses.replace(tree, report=report), tmp_path / f"s{ending}")
    save_report(glsk.read_skeleton(tmp_path / f"s{ending}"), tmp_path / "r.html", title=HOSTILE)
    text = (tmp_path / "r.html").read_text("utf-8")
    assert "<svg/onload" not in text
    assert "http-equiv=refresh" not in text.replace("&lt;meta http-equiv=refresh", "")
    assert text.count("&lt;meta http-equiv=refresh") >= 8
    assert "{0.__class__}" in text


# ---------------------------------------------------------------------------------------------------------- sections


def test_solves_are_rows_and_warnings_are_listed_once():
    names = [field.name for field in dataclasses.fields(IterationRecord)]
    records = tuple(IterationRecord(**dict.fromkeys(names, 0) | {"iteration": i, "n_points": 900}) for i in (1, 2))
    text = page.contraction(Report(iterations=records, stop_reason="<b>"))
    assert re.findall(r"<tr><td>(\d)</td><td>900</td>", text) == ["1", "2"]
    assert "Not converged: &lt;b&gt;." in text
    assert page.contraction(Report()) == page.warnings(()) == ""
    assert page.warnings(["<a>", "b", "<a>"]).count("<li>") == 2


def judged(*pairs):
    return Report(
        decisions=tuple(Decision("gap", (float(i), 0.0, 0.0), p, changed) for i, (p, changed) in enumerate(pairs))
    )


def test_what_changed_and_close_calls_are_listed_the_closest_first():
    text = page.topology(judged((0.99, True), (0.01, False), (0.6, True), (0.45, False)))
    assert "gap bridged: 2, gap left: 2; 2 of 4 close calls." in text
    places = re.findall(r"the gap at \((\d), 0, 0\)", text)
    assert places == ["3", "2", "0"]
    long = page.topology(judged(*[(0.5, True)] * (page.MOST_LISTED_ROWS + 3)))
    assert long.count("<td>gap bridged</td>") == page.MOST_LISTED_ROWS
    assert "and 3 clearer ones" in long
    assert page.topology(Report()) == ""
