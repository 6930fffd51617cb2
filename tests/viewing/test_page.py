"""What the report holds, without a browser."""

import base64
import dataclasses
import json
import math
import re

import numpy as np
import pytest

import glsk_o3d as glsk
from glsk_o3d import save_report, to_line_set
from glsk_o3d.analysis import segment
from glsk_o3d.data.decisions import Decision, Supported
from glsk_o3d.data.report import IterationRecord, Report
from glsk_o3d.samples import torus
from glsk_o3d.viewing import page as sections


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


# -------------------------------------------------------------------------------------------------------------- view


def test_positions_come_through(data):
    skeleton = glsk.skeletonize(torus(600).points * 7 + 1e6)
    held = data(skeleton)
    centre = (np.concatenate([skeleton.points, skeleton.vertices]).min(axis=0) + skeleton.points.max(axis=0)) / 2
    diagonal = np.linalg.norm(np.ptp(skeleton.points, axis=0))
    positions = unpacked(held["positions"], "<i2").reshape(600, 3) / 32767 * held["unit"] + centre
    np.testing.assert_allclose(positions, skeleton.points, atol=diagonal / 60_000)
    vertices = unpacked(held["vertices"], "<f4").reshape(-1, 3) * held["unit"] + centre
    np.testing.assert_allclose(vertices, skeleton.vertices, atol=1e-6 * diagonal)
    np.testing.assert_allclose(unpacked(held["radii"], "<f4") * held["unit"], skeleton.radii, rtol=1e-6)
    np.testing.assert_array_equal(unpacked(held["edges"], "<u4").reshape(-1, 2), skeleton.edges)
    np.testing.assert_array_equal(unpacked(held["vertex_of_point"], "<i4"), skeleton.vertex_of_point)
    np.testing.assert_array_equal(unpacked(held["branch_of_point"], "<i4"), segment(skeleton))
    colours = [[int(hexa[i : i + 2], 16) / 255 for i in (1, 3, 5)] for hexa in held["palette"]]
    lines = np.asarray(to_line_set(skeleton, "branch").colors)
    np.testing.assert_allclose(np.array(colours)[unpacked(held["branch_of_edge"], "<i4")], lines, atol=0.003)


def test_large_clouds_are_thinned(data, tree, tmp_path):
    points = np.random.default_rng(0).normal(size=(25_000, 3))
    held = data(dataclasses.replace(tree, points=points, normals=None, vertex_of_point=np.arange(25_000) % 6))
    assert len(unpacked(held["positions"], "<i2")) == 3 * 20_000
    assert "The view shows 20,000 of 25,000 points" in (tmp_path / "r.html").read_text("utf-8")


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
    save_report(skeleton, tmp_path / "r.html", title="caf\udce9.ply")  # no Unicode, as a file name may be
    text = (tmp_path / "r.html").read_text("utf-8")
    addresses = re.findall(r"""[^.](?:src|href|action)\s*=\s*["']?([^"'\s>]+)|url\(([^)]*)\)|@import""", text)
    assert addresses == []
    assert "default-src 'none'" in text
    assert "drawn at random" not in text  # though some points are not finite
    assert "<title>caf?.ply</title>" in text
    assert not re.search(r"\{\{\w+\}\}", text)
    assert [path.name for path in tmp_path.iterdir()] == ["r.html"]


HOSTILE = "<meta http-equiv=refresh content='//x'>\"'--><svg/onload=x>&lt;{digest}{0.__class__}%s$x^{\\\\frac$\x1b[2J"


@pytest.mark.parametrize("ending", [".json", ".npz"])
def test_no_text_of_a_file_becomes_part_of_the_page(tmp_path, tree, ending):
    place = (0.0, 0.0, 0.0)
    texts = dict(stop_reason=HOSTILE, stages=(HOSTILE,), warnings=(HOSTILE,), recipe={HOSTILE: HOSTILE})
    numbers = dict(n_draws=8, support=(Supported(HOSTILE, place, present=True, share=0.25),), seconds={HOSTILE: 1.0})
    report = dataclasses.replace(judged((0.5, True)), **texts, **numbers, versions={HOSTILE: HOSTILE})
    glsk.save_skeleton(dataclasses.replace(tree, report=report), tmp_path / f"s{ending}")
    save_report(glsk.read_skeleton(tmp_path / f"s{ending}"), tmp_path / "r.html", title=HOSTILE)
    text = (tmp_path / "r.html").read_text("utf-8")
    assert "<svg" not in text
    assert "http-equiv=refresh" not in text.replace("&lt;meta http-equiv=refresh", "")
    assert text.count("&lt;meta http-equiv=refresh") >= 8
    assert "{0.__class__}" in text


# ---------------------------------------------------------------------------------------------------------- sections


def test_solves_are_rows_and_warnings_are_told_once_each():
    names = [field.name for field in dataclasses.fields(IterationRecord)]
    records = tuple(IterationRecord(**dict.fromkeys(names, 0) | {"iteration": i, "n_points": 900}) for i in (1, 2))
    text = sections.contraction(Report(iterations=records, stop_reason="<b>"))
    assert re.findall(r"<tr><td>(\d)</td><td>900</td>", text) == ["1", "2"]
    assert "Not converged: &lt;b&gt;." in text
    assert sections.contraction(Report()) == sections.warnings(()) == ""
    assert sections.warnings(["<a>", "b", "<a>"]).count("<li>") == 2


def judged(*pairs):
    return Report(
        decisions=tuple(Decision("gap", (float(i), 0.0, 0.0), p, changed) for i, (p, changed) in enumerate(pairs))
    )


def test_what_changed_and_close_calls_are_listed_the_closest_first():
    text = sections.topology(judged((0.99, True), (0.01, False), (0.6, True), (0.45, False)))
    assert "gap bridged: 2, gap left: 2; 2 of 4 close calls." in text
    places = re.findall(r"the gap at \((\d), 0, 0\)", text)
    assert places == ["3", "2", "0"]
    assert re.findall(r'<tr class="uncertain"><td>(.*?)</td>', text) == ["gap left", "gap bridged"]
    long = sections.topology(judged(*[(0.5, True)] * (sections.MOST_LISTED_ROWS + 3)))
    assert long.count("<td>gap bridged</td>") == sections.MOST_LISTED_ROWS
    assert "and 3 clearer ones" in long
    assert sections.topology(Report()) == ""
