"""The report as a browser shows it, without a network."""

import dataclasses
import json

import numpy as np
import pytest

import glsk_o3d as glsk
from glsk_o3d import Reason, Skeleton

HOSTILE = "</title></script><script>alert(1)</script><img src=x onerror=alert(2)>\"'&amp;{{data}}"
SOFTWARE = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader")  # WebGL without a GPU


@pytest.fixture(scope="module")
def browser(launch):
    return launch(*SOFTWARE)


@pytest.fixture
def look(browser, patience, tmp_path):
    """Open the report of a skeleton offline; it must raise no error and ask for nothing but itself."""
    trouble = []
    context = browser.new_context(viewport={"width": 560, "height": 640}, offline=True)
    context.set_default_timeout(1e3 * patience)

    def open_page(skeleton, **options):
        path, requests = tmp_path / "r.html", []
        glsk.save_report(skeleton, path, **options)
        page = context.new_page()
        page.on("pageerror", lambda error: trouble.append(f"error: {error}"))
        page.on("dialog", lambda dialog: (trouble.append(f"dialog: {dialog.message}"), dialog.dismiss()))
        page.on("request", lambda request: request.url.startswith(("data:", "blob:")) or requests.append(request.url))
        page.goto(path.as_uri())
        page.locator("#view .main-svg").first.wait_for()
        if requests != [path.as_uri()]:
            trouble.append(f"asked for {requests}")
        return page

    yield open_page
    context.close()
    assert trouble == []


def test_the_view_is_drawn_in_webgl(run, look):
    page = look(run, title="sample.ply")
    page.locator("#view canvas").first.wait_for()
    names = page.locator("#view .legendtext").all_text_contents()
    assert names == ["cloud", *(f"skeleton by {name}" for name in ("branch", "radius", "confidence")), "radius tubes"]
    assert page.evaluate("document.documentElement.scrollWidth") == 560
    assert page.title() == "sample.ply"


def test_texts_are_texts(run, look):
    reasons = (Reason("other", HOSTILE),)
    texts = dict(reasons=reasons, stop_reason=HOSTILE, recipe={HOSTILE: HOSTILE}, versions={HOSTILE: HOSTILE})
    page = look(dataclasses.replace(run, report=dataclasses.replace(run.report, **texts)), title=HOSTILE)
    assert page.title() == HOSTILE
    for place in ("h1", ".warnings li", ".run td >> nth=-1"):
        assert page.locator(place).text_content() == HOSTILE
    assert json.loads(page.locator("pre").text_content()) == {HOSTILE: HOSTILE}
    assert HOSTILE in page.locator("h2 + p").first.text_content()
    assert page.locator("img").count() == 0


@pytest.mark.parametrize("n", [0, 50])
def test_a_cloud_without_a_skeleton(n, look):
    points, none = np.random.default_rng(0).normal(size=(n, 3)), np.empty(0)
    look(Skeleton(none, none, none, np.full(n, -1), points, np.full_like(points, np.nan)))
