"""What the report holds, without a browser."""

import base64
import dataclasses
import json
import math
import re
from html.parser import HTMLParser

import numpy as np
import pytest

import glsk_o3d as glsk
from glsk_o3d import save_report, to_line_set
from glsk_o3d.analysis import segment
from glsk_o3d.data.decisions import Decision, Supported
from glsk_o3d.data.report import IterationRecord, Report
from glsk_o3d.io.formats import fields
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


class Structure(HTMLParser):
    """The elements of a page with their attributes, and the text in them; not that of scripts."""

    def __init__(self, page):
        super().__init__()
        self.elements, self.text = [], ""
        self.feed(page)

    def handle_starttag(self, tag, attributes):
        self.elements.append((tag, attributes))

    def handle_data(self, data):
        self.text += data if self.elements and self.elements[-1][0] not in ("script", "style") else ""


def with_texts(value, text, path=()):
    """Where a report holds words, or keys that are any, and the same report with other words there."""
    if isinstance(value, dict):
        for key, each in value.items():
            yield from ((place, {**value, key: new}) for place, new in with_texts(each, text, (*path, key)))
            if path and path[-1] in ("seconds", "versions", "recipe"):
                yield (*path, f"key {key}"), {**{k: v for k, v in value.items() if k != key}, text: each}
    elif isinstance(value, list | tuple):
        for i, each in enumerate(value):
            for place, new in with_texts(each, text, (*path, i)):
                yield place, [*value[:i], new, *value[i + 1 :]]
    elif isinstance(value, str):
        yield path, text


@pytest.mark.parametrize("ending", [".json", ".npz"])
def test_no_text_of_a_file_becomes_part_of_the_page(tmp_path, tree, ending):
    place = (0.0, 0.0, 0.0)
    full = dataclasses.replace(
        judged((0.5, True)),
        stop_reason="word",
        stages=("word",),
        recipe={"glsk_o3d": {"version": 1}, "pipeline": [{"filter": "word", "links": "word"}]},
        warnings=("word",),
        n_draws=8,
        support=(Supported("word", place, present=True, share=0.25),),
        seconds={"word": 1.0},
    )

    def page(report, title):
        values = json.loads(fields.write_json(tree)) | {"report": report}
        if ending == ".json":
            (tmp_path / "s.json").write_text(json.dumps(values))
        else:
            arrays = {name: getattr(tree, name) for name in fields.ARRAYS}
            marks = {name: values[name] for name in ("format", "format_version")}
            np.savez(tmp_path / "s.npz", **arrays, **marks, report=json.dumps(report))
        save_report(glsk.read_skeleton(tmp_path / f"s{ending}"), tmp_path / "r.html", title=title)
        return Structure((tmp_path / "r.html").read_text("utf-8"))

    plain = json.loads(json.dumps(full.to_dict()))
    expected = page(plain, "word").elements
    shown, refused = set(), set()
    for place, report in with_texts(plain, HOSTILE):
        try:
            made = page(report, HOSTILE)
        except glsk.FileFormatError:
            refused.add(place[0])
            continue
        assert made.elements == expected or place[0] == "recipe"
        assert [tag for tag, _ in made.elements] == [tag for tag, _ in expected]
        if made.text.count("http-equiv=refresh") > 2:  # besides the title and the heading
            shown.add(place[0])
    assert refused == {"decisions"}
    assert shown >= {"stop_reason", "recipe", "warnings", "support", "seconds", "versions"}


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
