"""The window: where there is no display an error, where there is one a picture."""

import sys
from types import SimpleNamespace
from typing import ClassVar

import numpy as np
import pytest

from glsk_o3d import DisplayError
from glsk_o3d.viewing.window import has_display, layers, show

needs_x11 = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="about X11")


@pytest.fixture
def no_display(monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)


@needs_x11
@pytest.mark.usefixtures("no_display")
@pytest.mark.parametrize("display", [None, "", ":4242"])
def test_without_a_display(tree, monkeypatch, display):
    if display is not None:
        monkeypatch.setenv("DISPLAY", display)
    assert not has_display()
    with pytest.raises(DisplayError, match=r"no display .*save_report"):
        show(tree)


@needs_x11
def test_a_window_that_cannot_be_opened(tree, monkeypatch):
    monkeypatch.setattr("glsk_o3d.viewing.window.has_display", lambda: True)
    monkeypatch.setattr("open3d.visualization.VisualizerWithKeyCallback.create_window", lambda *_: False)
    with pytest.raises(DisplayError, match="Open3D cannot open"):
        show(tree)


def test_what_it_shows(run, forest, bare):
    skeleton = run[0]
    shapes = layers(skeleton)
    (cloud,), (lines, thin), (tubes,) = (shapes[name] for name in ("cloud", "skeleton", "radius tubes"))
    np.testing.assert_array_equal(np.asarray(cloud.points), skeleton.points)
    assert np.asarray(lines.lines).tolist() == skeleton.edges.tolist()
    assert thin.get_surface_area() < 0.5 * tubes.get_surface_area()
    assert len(layers(forest)["cloud"][0].points) == np.isfinite(forest.points).all(axis=1).sum() < len(forest.points)
    assert layers(bare)["cloud"] == []
    scan = cloud.paint_uniform_color((1, 0, 0))
    assert np.asarray(layers(skeleton, scan)["cloud"][0].colors)[0].tolist() == [1, 0, 0]


class Window:
    """In the place of Open3D's: it presses the keys, and counts the shapes that are shown before and after each."""

    counts: ClassVar[list[int]] = []

    def __init__(self):
        self.shown, self.switches = [], {}

    def create_window(self, *_):
        return True

    def get_render_option(self):
        return SimpleNamespace()

    def add_geometry(self, shape, **_):
        self.shown.append(shape)

    def remove_geometry(self, shape, **_):
        self.shown.remove(shape)

    def register_key_callback(self, key, switch):
        self.switches[chr(key)] = switch

    def run(self):
        for key in "TTSC":
            self.counts.append(len(self.shown))
            assert self.switches[key](self)
        self.counts.append(len(self.shown))

    def destroy_window(self):
        self.counts.append(-1)


def test_keys_show_and_hide(run, monkeypatch):
    monkeypatch.setattr("glsk_o3d.viewing.window.has_display", lambda: True)
    monkeypatch.setattr("open3d.visualization.VisualizerWithKeyCallback", Window)
    show(run[0])
    assert Window.counts == [3, 4, 3, 1, 0, -1]  # cloud, lines and their tubes; radius tubes; without these; nothing
