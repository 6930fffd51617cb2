"""The report as a browser shows it."""

import dataclasses
import json

import numpy as np
import pytest

import glsk_o3d as glsk
from glsk_o3d.data.report import Report
from glsk_o3d.data.skeleton import Skeleton

HOSTILE = "</title></script><script>alert(1)</script><img src=x onerror=alert(2)>\"'&amp;{{data}}"
TOO_WIDE = """[...document.querySelectorAll("body *")].filter((part) => !part.closest(".wide *"))
    .filter((part) => part.getBoundingClientRect().right > innerWidth + 0.5).map((part) => part.outerHTML)"""


@pytest.fixture(scope="module")
def report(run, tmp_path_factory):
    path = tmp_path_factory.mktemp("report") / "report.html"
    glsk.save_report(run, path, title="sample.ply")
    return path


def drawn(image):
    """Which pixels differ from the ground."""
    return (np.abs(image - image[3, 3]) > 12).any(axis=-1)


def turn_wheel(page, far):
    """Turn it and wait until that has come to the page, which is late; gives whether the view has taken it."""
    page.evaluate(
        "() => { window.turned = new Promise((done) =>"
        " addEventListener('wheel', (event) => done(event.defaultPrevented), { once: true, passive: true })) }"
    )
    page.mouse.wheel(0, far)
    return page.evaluate("turned")


def test_layers_and_colours(report, look, pixels):
    page = look(report)
    everything = pixels(page)
    assert 0.02 < drawn(everything).mean() < 0.9
    assert page.title() == "sample.ply"
    assert page.locator("#still").is_hidden()
    layers = ("cloud", "skeleton", "tubes")
    for layer in layers[:2]:
        page.uncheck(f"#{layer}")
    assert not drawn(pixels(page)).any()
    alone = []
    for layer in layers:
        page.check(f"#{layer}")
        alone.append(drawn(pixels(page)))
        page.uncheck(f"#{layer}")
    cloud, skeleton, tubes = alone
    assert cloud.sum() > skeleton.sum() > 0
    assert (tubes & skeleton).sum() > 0.99 * skeleton.sum()  # the curve runs inside its tubes
    assert (tubes & cloud).sum() > 0.7 * cloud.sum()
    for layer in layers[:2]:
        page.check(f"#{layer}")
    np.testing.assert_array_equal(pixels(page), everything)
    assert page.locator("#colour option").all_inner_texts() == ["branch", "radius", "confidence"]
    page.select_option("#colour", "radius")
    assert (pixels(page) != everything).any(axis=-1).mean() > 0.01
    assert page.locator("#legend").is_visible()


def test_a_slider_shows_pruned_limbs_and_hides_others(run, look, pixels, tmp_path):
    tips = run.vertices[run.leaves[:2]]
    there = glsk.Decision("limb", tuple(tips[0].tolist()), 0.8, changed=False)
    aside = tips[1] + np.ptp(run.points, axis=0).max() / 5 * np.arange(3)[:, None] * [0, 0, 1]
    gone = glsk.Decision("limb", tuple(aside[-1].tolist()), 0.2, True, tuple(map(tuple, aside.tolist())), (0.01,) * 3)
    judged = dataclasses.replace(run, report=dataclasses.replace(run.report, decisions=(there, gone)))
    glsk.save_report(judged, tmp_path / "judged.html")
    page = look(tmp_path / "judged.html")
    page.uncheck("#cloud")
    shown = {}
    for value in (None, 0.1, 0.5, 0.9):
        if value is not None:
            page.locator("#limb").evaluate(
                "(slider, value) => { slider.value = value; slider.dispatchEvent(new Event('input')) }", value
            )
        shown[value] = drawn(pixels(page))
    np.testing.assert_array_equal(shown[None], shown[0.5])
    assert shown[0.1].sum() > shown[0.5].sum() > shown[0.9].sum() > 0
    plain = dataclasses.replace(run, report=dataclasses.replace(run.report, decisions=()))
    glsk.save_report(plain, tmp_path / "plain.html")
    assert look(tmp_path / "plain.html").locator("#limb").is_hidden()


def test_turns_zooms_and_comes_back(report, look, pixels):
    page = look(report)
    box = page.locator("#view").bounding_box()
    x, y = box["x"] + 20, box["y"] + 20  # where no vertex is under the mouse
    page.mouse.move(x, y)
    first = pixels(page)
    assert not turn_wheel(page, -100)  # the page scrolls, unless the view was clicked

    def drag(button):
        page.mouse.down(button=button)
        page.mouse.move(x + 60, y + 25, steps=3)
        page.mouse.up(button=button)
        page.mouse.move(x, y)

    acts = {
        "turn": lambda: drag("left"),
        "move": lambda: drag("right"),
        "key": lambda: page.keyboard.press("ArrowLeft"),
        "zoom": lambda: turn_wheel(page, 300),
    }
    for name, act in acts.items():
        page.focus("#view")
        act()
        assert (pixels(page) != first).any(axis=-1).mean() > 0.01, name
        page.keyboard.press("Home")
        np.testing.assert_array_equal(pixels(page), first)


@pytest.mark.parametrize(("view", "across", "up"), [("xy", 0, 1), ("yz", 1, 2)])
def test_projection(view, across, up, look, pixels, tmp_path):
    """An L with arms of 4 to the right and 2 upwards, in the plane through the centre, where the scale is one."""
    corners = np.full((3, 3), 1e6)
    corners[1:, across] += 4
    corners[2, up] += 2
    lying = Skeleton(corners, [[0, 1], [1, 2]], [np.nan] * 3, (), (), ())
    glsk.save_report(lying, tmp_path / "l.html")
    page = look(tmp_path / "l.html")
    page.click(f"button[data-view={view}]")
    mark = drawn(pixels(page))
    rows, columns = np.nonzero(mark)
    thick = mark[:, (columns.min() + columns.max()) // 2].sum()
    width, height = np.ptp(columns) + 1 - thick, np.ptp(rows) + 1 - thick
    assert width / height == pytest.approx(2, abs=0.03)
    assert 0.8 * mark.shape[1] < width < 0.95 * mark.shape[1]
    assert not mark[: rows.max() - 2 * thick, : columns.max() - 2 * thick].any()
    corner = {"x": int(columns.max() + 10 - thick // 2), "y": int(rows.max() + 10 - thick // 2)}
    page.locator("#view").hover(position=corner)
    page.get_by_text("vertex 1 · branch 0", exact=True).wait_for()


def test_fits_the_screen_in_light_and_dark(report, look, pixels):
    grounds, width = [], 390
    for scheme in ("light", "dark"):
        page = look(report, width, 844, scheme)
        assert page.evaluate("document.documentElement.scrollWidth") == width
        assert page.evaluate(TOO_WIDE) == []
        image = pixels(page)
        assert drawn(image).mean() > 0.02
        grounds.append(image[3, 3].mean())
    assert grounds[0] > 200 > 60 > grounds[1]


def test_texts_are_texts(run, look, tmp_path):
    recorded = dataclasses.replace(
        run.report, warnings=(HOSTILE,), stop_reason=HOSTILE, recipe={HOSTILE: HOSTILE}, versions={HOSTILE: HOSTILE}
    )
    glsk.save_report(dataclasses.replace(run, report=recorded), tmp_path / "r.html", title=HOSTILE)
    page = look(tmp_path / "r.html")
    assert page.title() == HOSTILE
    for place in ("h1", ".warnings li", ".run td >> nth=-1"):
        assert page.locator(place).text_content() == HOSTILE
    assert json.loads(page.locator("pre").text_content()) == {HOSTILE: HOSTILE}
    assert HOSTILE in page.locator("h2 + p").first.text_content()
    assert page.locator("script").count() == 2
    assert page.locator("img").count() == 0


def test_words_in_the_place_of_the_view_without_webgl_or_scripts(report, look, launch):
    blind = launch("--disable-3d-apis")
    for page in (look(report, within=blind), look(report, java_script_enabled=False)):
        assert page.locator("#view").is_hidden()
        assert page.get_by_text("This browser shows no WebGL 2").is_visible()
        assert page.locator("#viewer > p:visible").count() == 1


@pytest.mark.parametrize("report", [Report(), None])
def test_little_to_show(report, look, tmp_path):
    points = np.random.default_rng(0).normal(size=(50, 3)) if report else np.empty((0, 3))
    none = np.empty(0)
    nowhere = Skeleton(none, none, none, np.full(len(points), -1), points, np.full_like(points, np.nan))
    glsk.save_report(nowhere, tmp_path / "r.html")
    page = look(tmp_path / "r.html")
    assert page.locator("#view").is_visible()
    assert page.locator("label:has(#skeleton)").is_hidden()
