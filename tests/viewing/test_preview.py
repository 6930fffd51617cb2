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


def boxes(figure):
    """Sides of the box around the red of each view, in pixels."""
    figure.canvas.draw()
    image = np.asarray(figure.canvas.buffer_rgba()) / 255
    height = len(image)
    for axes in figure.axes:
        box = axes.get_window_extent()
        x, y = (
            slice(int(low) - 3, int(high) + 3) for low, high in ((box.x0, box.x1), (height - box.y1, height - box.y0))
        )
        rows, columns = np.nonzero(is_red(image[y, x]))
        yield np.ptp(columns), np.ptp(rows)


@pytest.mark.parametrize("offset", [0, -1e9])
def test_three_views_at_one_scale(make, offset):
    corners = np.array([[0, 0, 0], [4, 0, 0], [4, 2, 0], [4, 2, 1]]) * 8.0 + offset
    box = dataclasses.replace(make(corners, [[0, 1], [1, 2], [2, 3]]), **WITHOUT_POINTS)
    measured = np.array([*boxes(preview.draw(box))])
    np.testing.assert_allclose(measured / (measured[0, 0] / 4), [(4, 1), (2, 1), (4, 2)], atol=0.1)


@pytest.mark.parametrize("size", [(4, 2, 1), (1, 1, 9), (3e-7, 0, 0), (2e90, 1e90, 1)])
def test_the_bar_is_as_long_as_it_says(make, size):
    figure = preview.draw(shaped(make, *size))
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
    ("size", "share"), [((1, 1, 1), 0.75), ((5, 5, 20), 0.8), ((30, 1, 1), 0.85), ((1, 30, 1), 0.85), ((9, 6, 0), 0.8)]
)
def test_objects_of_any_shape_fill_their_picture(make, tmp_path, size, share):
    save_preview(shaped(make, *size), tmp_path / "p.png")
    image = imread(tmp_path / "p.png")
    rows, columns = np.nonzero(is_red(image))
    height, width = image.shape[:2]
    assert 450 <= height <= 1200
    assert 900 <= width <= 1800
    assert max(np.ptp(rows) / height, np.ptp(columns) / width) > share
    assert min(rows.min(), columns.min(), height - rows.max(), width - columns.max()) > 5


def test_dots_do_not_bury_short_branches(make):
    star = make(np.random.default_rng(0).random((101, 3)), [(0, i + 1) for i in range(100)])
    stem = np.column_stack([np.arange(101) / 100, np.zeros(101), np.zeros(101)])
    edges = [(i, i + 1) for i in range(100)] + [(i, 101 + i) for i in range(100)]
    comb = make(np.concatenate([stem, stem[:100] + [0, 0, 0.002]]), edges)
    for skeleton, dots in ((star, 2), (comb, 0)):  # of junctions, and of leaves
        _, _, *spots = preview.draw(skeleton).axes[0].collections
        assert sum(len(spot.get_offsets()) > 0 for spot in spots[1:]) == dots


def test_the_root_is_marked(tree):
    rooted = dataclasses.replace(tree, report=dataclasses.replace(tree.report, root=tuple(tree.vertices[0].tolist())))
    for skeleton, n in ((tree, 0), (rooted, 3)):
        marks = [it for axes in preview.draw(skeleton).axes for it in axes.collections if it.get_label() == "root"]
        assert len(marks) == n


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


def test_caption_counts_the_cloud_and_not_what_the_skeleton_holds_of_it(tree, tmp_path):
    def caption(skeleton, **report):
        skeleton = dataclasses.replace(skeleton, report=Report(**report))
        return [text.get_text() for text in preview.draw(skeleton).texts][-1]

    counts = "vertices 6   edges 5   components 1   loops 0   leaves 3   junctions 1   length "
    assert caption(tree).startswith(f"points 7   {counts}")
    assert caption(tree, n_input=90000).startswith(f"points 90,000   {counts}")
    save_preview(tree, tmp_path / "p.png", title="a $title_ with odd^ signs")
    assert [file.name for file in tmp_path.iterdir()] == ["p.png"]


@pytest.mark.parametrize(("save", "ending"), [(save_preview, "png"), (save_report, "html")])
@pytest.mark.parametrize("name", ["p.jpg", "p"])
def test_other_endings_are_refused(tree, tmp_path, save, ending, name):
    with pytest.raises(FileFormatError, match=rf"{name}: .*\.{ending}"):
        save(tree, tmp_path / name)
    assert not list(tmp_path.iterdir())


LONG = "weakly supported: around 31% of the points " + "they do not agree on an axis, " * 20
WARNINGS = [
    (("sheet-like: costs $5 and $6",), r"warning: sheet-like: costs \$5 and \$6"),
    ((LONG, "second"), r"warning: weakly .* \.\.\. warning: second"),
    (("one", "two", "three", "four"), "warning: one warning: two and 2 more warnings"),
    ((), ""),
]


@pytest.mark.parametrize(("warnings", "told"), WARNINGS)
def test_warnings_are_told_below_and_nothing_overlaps(tree, warnings, told):
    figure = preview.draw(dataclasses.replace(tree, report=Report(warnings=warnings)))
    figure.canvas.draw()
    boxes = [text.get_window_extent() for text in figure.texts]
    assert all(box.x0 >= 0 and box.x1 <= figure.bbox.x1 and box.y0 >= 0 for box in boxes)
    boxes += [axes.get_window_extent() for axes in figure.axes]
    assert not any(a.overlaps(b) for i, a in enumerate(boxes) for b in boxes[:i])
    lines = [text.get_text() for text in reversed(figure.texts) if text.get_color() == preview._AMBER]
    assert re.fullmatch(told, " ".join(lines))


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


@pytest.mark.parametrize("title", ["a", "plot_17_tree_0042_" * 6 + "south.laz", "a scan of many words " * 12])
def test_words_on_the_picture_of_a_tall_object_stay_in_it(title):
    """It is narrow: titles and counts are broken to its width, and nothing is drawn over something else."""
    tall = Skeleton([[0, 0, 0], [0.1, 0, 50], [0, 0, 100]], [(0, 1), (1, 2)], np.ones(3), (), (), ())
    tall = dataclasses.replace(tall, report=Report(n_input=123_456_789, warnings=("much is wrong " * 30,)))
    figure = preview.draw(tall, title)
    width, height = figure.get_size_inches() * figure.dpi
    boxes = [text.get_window_extent() for text in figure.texts]
    assert width < 1000
    assert all(0 <= box.x0 < box.x1 <= width and 0 <= box.y0 < box.y1 <= height for box in boxes)
    boxes.sort(key=lambda box: box.y0)
    apart = [a.overlaps(b) for i, a in enumerate(boxes) for b in boxes[i + 1 :]]
    assert not any(apart)
    words = [text.get_text() for text in figure.texts]
    assert any("points 123,456,789" in line for line in words)
    assert any("length" in line for line in words)
