"""A skeleton, and a browser to look at pages with."""

import io

import numpy as np
import pytest
from matplotlib.image import imread

import glsk_o3d as glsk
from glsk_o3d.samples import sample_object

SOFTWARE = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader")  # WebGL without a GPU


@pytest.fixture(scope="session")
def run():
    """A skeleton of the sample object."""
    return glsk.skeletonize(sample_object(1500).points)


@pytest.fixture(scope="module")
def browser(launch):
    return launch(*SOFTWARE)


@pytest.fixture
def look(browser, patience):
    """Open a page offline, in an empty profile of its own; it must not complain or ask for anything but itself."""
    contexts, trouble = [], []

    def open_page(path, width=560, height=640, scheme="light", within=browser, **options):
        context = within.new_context(
            viewport={"width": width, "height": height}, color_scheme=scheme, offline=True, **options
        )
        context.set_default_timeout(1e3 * patience)
        contexts.append(context)
        page = context.new_page()
        page.on("console", lambda message: trouble.append(f"console: {message.text}"))
        page.on("pageerror", lambda error: trouble.append(f"error: {error}"))
        page.on("dialog", lambda dialog: (trouble.append(f"dialog: {dialog.message}"), dialog.dismiss()))
        page.on("request", lambda request: request.url.startswith("data:") or asked.append(request.url))
        asked = []
        page.goto(path.as_uri())
        if asked != [path.as_uri()]:
            trouble.append(f"asked for {asked}")
        return page

    yield open_page
    for context in contexts:
        context.close()
    assert trouble == []


@pytest.fixture(scope="session")
def pixels():
    """What the view looks like, without its round corners, as an (h, w, 3) int array."""

    def shoot(page):
        page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
        image = imread(io.BytesIO(page.locator("#view").screenshot()))
        return np.rint(255 * image[10:-10, 10:-10, :3]).astype(int)

    return shoot
