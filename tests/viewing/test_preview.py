"""Pictures of a skeleton in its cloud."""

import dataclasses
import re
import sys

import numpy as np
import pytest

from glsk_o3d import Skeleton
from glsk_o3d.data.decisions import Supported
from glsk_o3d.data.report import Report
from glsk_o3d.errors import FileFormatError
from glsk_o3d.viewing import preview
from glsk_o3d.viewing.page import save_report
from glsk_o3d.viewing.preview import save_preview

matplotlib = pytest.importorskip("matplotlib")
from matplotlib.image import imread  # noqa: E402

WITHOUT_POINTS = {"points": (), "vertex_of_point": (), "normals": ()}


def is_red(image):
    return (image[..., 0] > 0.7) & (image[..., 1] < 0.35) & (image[..., 2] < 0.4)


def is_grey(image):
    grey = (image[..., 0] > 0.6) & (image[..., 0] < 0.95) & (np.ptp(image[..., :3], axis=-1) < 0.02)
    return grey[: int(0.85 * len(grey))]


@pytest.mark.parametrize("size", [(4, 2, 1), (1, 1, 9), (3e-7, 0, 0), (2e90, 1e90, 1)])
def test_views_have_one_scale_and_the_bar_is_as_long_as_it_says(make, size):
    figure = preview.draw(shaped(make, *size))
    scales = [
        axes.get_position().size * figure.get_size_inches() / np.ptp([axes.get_xlim(), axes.get_ylim()], axis=1)
        for axes in figure.axes
    ]
    np.testing.assert_allclose(scales, scales[0][0])
    (bar,) = figure.artists
    inches = np.ptp(bar.get_xdata())
    (told,) = [float(text.get_text()) for text in figure.texts if re.fullmatch(r"[-+.e\d]+", text.get_text())]
    front = figure.axes[0]
    scale = front.get_position().width * figure.get_figwidth() / np.ptp(front.get_xlim())
    assert inches == pytest.approx(told * scale)
    assert 0.35 < inches < 1


def shaped(make, *size):
    corners = np.array(list(np.ndindex(2, 2, 2))) * size
    edges = [(0, 1), (1, 3), (3, 7), (7, 6), (6, 4), (4, 0)]
    return dataclasses.replace(make(corners, edges), **WITHOUT_POINTS)


@pytest.mark.parametrize(
    ("size", "share"), [((1, 1, 1), 0.75), ((5, 5, 20), 0.8), ((30, 1, 1), 0.85), ((9, 6, 0), 0.8)]
)
def test_objects_of_any_shape_fill_their_picture(make, tmp_path, size, share):
    figure = preview.draw(shaped(make, *size))
    largest = max(axes.get_position().size.max() for axes in figure.axes)
    assert largest > (0.8 if size[0] == 30 else 0.25)  # views of what is long are above each other
    save_preview(shaped(make, *size), tmp_path / "p.png")
    image = imread(tmp_path / "p.png")
    rows, columns = np.nonzero(is_red(image))
    height, width = image.shape[:2]
    assert 450 <= height <= 1200
    assert 900 <= width <= 1800
    assert max(np.ptp(rows) / height, np.ptp(columns) / width) > share
    assert min(rows.min(), columns.min(), height - rows.max(), width - columns.max()) > 5


def test_planar_clouds_and_clouds_without_a_skeleton(make, tmp_path):
    flat = np.random.default_rng(0).random((500, 3)) * [1, 1, 0]
    whole = dataclasses.replace(make(flat[:3], [[0, 1]]), points=flat, vertex_of_point=None, normals=None)
    found = []
    for skeleton in (whole, Skeleton((), (), (), (), flat, ()), Skeleton((), (), (), (), (), ())):
        save_preview(skeleton, tmp_path / "p.png")
        image = imread(tmp_path / "p.png")
        found.append((is_red(image).any(), is_grey(image).sum() > 1000))
    assert found == [(True, True), (False, True), (False, False)]


def test_the_same_picture_every_time_without_global_state(tree, tmp_path):
    points = np.random.default_rng(0).normal(size=(20_001, 3))
    many = dataclasses.replace(tree, points=points, vertex_of_point=None, normals=None)
    before = dict(matplotlib.rcParams)
    for name in "ab":
        save_preview(many, tmp_path / f"{name}.png")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert dict(matplotlib.rcParams) == before
    assert "matplotlib.pyplot" not in sys.modules or not sys.modules["matplotlib.pyplot"].get_fignums()


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
def test_words_stay_in_the_picture_and_nothing_overlaps(title, warnings):
    """Also in that of a tall object, which is narrow: titles, counts and warnings are broken to its width."""
    tall = Skeleton([[0, 0, 0], [0.1, 0, 50], [0, 0, 100]], [(0, 1), (1, 2)], np.ones(3), (), (), ())
    tall = dataclasses.replace(tall, report=Report(n_input=123_456_789, warnings=warnings))
    figure = preview.draw(tall, title)
    figure.canvas.draw()
    width, height = figure.get_size_inches() * figure.dpi
    boxes = [text.get_window_extent() for text in figure.texts]
    assert width < 1000
    assert all(0 <= box.x0 < box.x1 <= width and 0 <= box.y0 < box.y1 <= height for box in boxes)
    boxes += [axes.get_window_extent() for axes in figure.axes]
    assert not any(a.overlaps(b) for i, a in enumerate(boxes) for b in boxes[:i])
    words = " ".join(text.get_text() for text in figure.texts)
    assert "points 123,456,789" in words
    assert words.count("warning: ") == min(len(warnings), 2)
    assert ("and 1 more warning" in words) == (len(warnings) == 3)
