"""The window: where there is no display an error, where there is one a picture."""

import sys
from unittest.mock import MagicMock

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
@pytest.mark.parametrize("display", [None, ":4242"])
def test_without_a_display(tree, monkeypatch, display):
    if display is not None:
        monkeypatch.setenv("DISPLAY", display)
    assert not has_display()
    with pytest.raises(DisplayError, match=r"no display .*save_report"):
        show(tree)


def test_layers_of_the_window(run, forest, bare):
    skeleton = run
    shapes = layers(skeleton)
    (cloud,), (lines, thin), (tubes,) = (shapes[name] for name in ("cloud", "skeleton", "radius tubes"))
    np.testing.assert_array_equal(np.asarray(cloud.points), skeleton.points)
    assert np.asarray(lines.lines).tolist() == skeleton.edges.tolist()
    assert thin.get_surface_area() < 0.5 * tubes.get_surface_area()
    assert len(layers(forest)["cloud"][0].points) == np.isfinite(forest.points).all(axis=1).sum() < len(forest.points)
    assert layers(bare)["cloud"] == []
    scan = cloud.paint_uniform_color((1, 0, 0))
    assert np.asarray(layers(skeleton, scan)["cloud"][0].colors)[0].tolist() == [1, 0, 0]


def test_keys_show_and_hide(run, monkeypatch):
    window, shown, counts = MagicMock(), [], []
    window.add_geometry.side_effect = lambda shape, **_: shown.append(shape)
    window.remove_geometry.side_effect = lambda shape, **_: shown.remove(shape)

    def press():
        switches = {chr(key): switch for (key, switch), _ in window.register_key_callback.call_args_list}
        for key in "TTSC":
            counts.append(len(shown))
            assert switches[key](window)
        counts.append(len(shown))

    window.run.side_effect = press
    monkeypatch.setattr("glsk_o3d.viewing.window.has_display", lambda: True)
    monkeypatch.setattr("open3d.visualization.VisualizerWithKeyCallback", lambda: window)
    show(run)
    assert counts == [3, 4, 3, 1, 0]  # cloud, lines and their tubes; radius tubes; without these; nothing
    window.destroy_window.assert_called_once()
