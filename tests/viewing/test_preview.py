"""Pictures of a skeleton in its cloud."""

import dataclasses
import sys

import numpy as np
import pytest

from glsk_o3d import Reason, Skeleton
from glsk_o3d.data.decisions import Supported
from glsk_o3d.data.report import Report
from glsk_o3d.errors import FileFormatError
from glsk_o3d.viewing import preview
from glsk_o3d.viewing.page import save_report
from glsk_o3d.viewing.preview import save_preview

matplotlib = pytest.importorskip("matplotlib")
from matplotlib.image import imread  # noqa: E402

SHAPES = [(1, 1, 1), (4, 2, 1), (5, 5, 20), (1, 1, 9), (30, 1, 1), (9, 6, 0), (3e-7, 0, 0), (2e90, 1e90, 1)]


def is_red(image):
    return (image[..., 0] > 0.7) & (image[..., 1] < 0.35) & (image[..., 2] < 0.4)


def is_grey(image):
    grey = (image[..., 0] > 0.6) & (image[..., 0] < 0.95) & (np.ptp(image[..., :3], axis=-1) < 0.02)
    return grey[: int(0.85 * len(grey))]


def box_of(make, *size):
    """The outline of a box, without a cloud."""
    corners = np.array(list(np.ndindex(2, 2, 2))) * size
    edges = [(0, 1), (1, 3), (3, 7), (7, 6), (6, 4), (4, 0)]
    return dataclasses.replace(make(corners, edges), points=(), vertex_of_point=(), normals=())


@pytest.mark.parametrize("size", SHAPES)
def test_views_fill_the_picture_at_the_scale_of_the_bar(make, tmp_path, size):
    skeleton = box_of(make, *size)
    figure = preview.draw(skeleton)
    figure.canvas.draw()
    views = figure.axes[:3]
    scales = [
        axes.get_window_extent().size / np.ptp([axes.get_xlim(), axes.get_ylim()], axis=1) / max(size) for axes in views
    ]
    np.testing.assert_allclose(scales, scales[0][0], rtol=1e-6)  # pixels per unit
    (bar,) = [artist for artist in views[0].artists if hasattr(artist, "size_bar")]
    (label,) = bar.txt_label.get_children()
    pixels = bar.size_bar.get_children()[0].get_window_extent().width
    assert pixels == pytest.approx(float(label.get_text()) * scales[0][0], rel=1e-6)
    save_preview(skeleton, tmp_path / "p.png")
    image = imread(tmp_path / "p.png")
    rows, columns = np.nonzero(is_red(image))
    height, width = image.shape[:2]
    assert max(np.ptp(rows) / height, np.ptp(columns) / width) > 0.7
    assert min(rows.min(), columns.min(), height - rows.max(), width - columns.max()) > 0  # nothing is cut off


def test_planar_clouds_and_clouds_without_a_skeleton(make, tmp_path):
    flat = np.random.default_rng(0).random((500, 3)) * [1, 1, 0]
    whole = dataclasses.replace(make(flat[:3], [[0, 1]]), points=flat, vertex_of_point=None, normals=None)
    drawn = []
    for skeleton in (whole, Skeleton((), (), (), (), flat, ()), Skeleton((), (), (), (), (), ())):
        save_preview(skeleton, tmp_path / "p.png")
        image = imread(tmp_path / "p.png")
        drawn.append((is_red(image).any(), is_grey(image).sum() > 1000, *preview.figures.counts(skeleton)))
    assert drawn[0][:4] == (True, True, "points", "vertices")
    assert drawn[1:] == [(False, True, "points"), (False, False, "points")]


def open_figures():
    """Those of pyplot, which other tests of this process may have opened."""
    return sys.modules["matplotlib.pyplot"].get_fignums() if "matplotlib.pyplot" in sys.modules else []


def test_the_same_picture_every_time_without_global_state(tree, tmp_path):
    points = np.random.default_rng(0).normal(size=(20_001, 3))
    many = dataclasses.replace(tree, points=points, vertex_of_point=None, normals=None)
    before, figures = dict(matplotlib.rcParams), open_figures()
    for name in "ab":
        save_preview(many, tmp_path / f"{name}.png")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert dict(matplotlib.rcParams) == before
    assert open_figures() == figures


@pytest.mark.parametrize(("save", "ending"), [(save_preview, "png"), (save_report, "html")])
def test_other_endings_are_refused(tree, tmp_path, save, ending):
    with pytest.raises(FileFormatError, match=rf"p.jpg: .*\.{ending}"):
        save(tree, tmp_path / "p.jpg")
    assert not list(tmp_path.iterdir())


def test_what_samples_disagree_with_is_marked(tree, tmp_path):
    """Three marks in three views, and none where they agree."""
    place = tuple(tree.vertices[0].tolist())
    parts = Supported("end", place, 0.5), Supported("end", place, 0.5, present=False), Supported("loop", place, 1.0)
    amber = []
    for support in (parts[2:], parts[:1], parts):
        report = Report(n_draws=8, n_agreeing=4, support=support)
        save_preview(dataclasses.replace(tree, report=report), tmp_path / "p.png")
        image = imread(tmp_path / "p.png")
        near = np.abs(image[..., :3] - np.array([0xA0, 0x50, 0]) / 255).max(axis=-1) < 0.1
        amber.append(int(near.sum()))
    assert amber[0] == 0
    assert 50 < amber[1] < amber[2]


@pytest.mark.parametrize("title", ["a $title_ with odd^ signs", "plot_17_tree_0042_" * 6 + "south.laz"])
@pytest.mark.parametrize("warnings", [(), ("sheet-like: costs $5 and $6",), ("much is wrong " * 30, "two", "three")])
def test_words_stay_in_the_picture(title, warnings):
    """Also in that of a tall object, which is narrow: titles, counts and warnings are broken to its width."""
    tall = Skeleton([[0, 0, 0], [0.1, 0, 50], [0, 0, 100]], [(0, 1), (1, 2)], np.ones(3), (), (), ())
    report = Report(n_input=123_456_789, reasons=tuple(Reason("other", text) for text in warnings))
    figure = preview.draw(dataclasses.replace(tall, report=report), title)
    figure.canvas.draw()
    width, height = figure.get_size_inches() * figure.dpi
    boxes = [text.get_window_extent() for text in (figure._suptitle, figure._supxlabel)]
    assert all(0 <= box.x0 < box.x1 <= width and 0 <= box.y0 < box.y1 <= height for box in boxes)
    assert not any(box.overlaps(axes.get_window_extent()) for box in boxes for axes in figure.axes[:3])
    words = figure.get_supxlabel()
    assert "points 123,456,789" in " ".join(words.split())
    assert words.count("warning: ") == min(len(warnings), 2)
    assert ("and 1 more warning" in words) == (len(warnings) == 3)
