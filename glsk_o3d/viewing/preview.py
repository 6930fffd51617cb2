"""Pictures of a skeleton in its cloud, without a window: plain, and coloured by a measure."""

import os
import textwrap
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..analysis.summary import point_count, structure
from ..errors import InvalidParameterError
from ..interop.atomic import check_ending
from ..numerics.vectors import norm
from ..skeleton import Skeleton
from . import figures
from .figures import INK, PAPER

_RED, _AMBER = "#d0121f", "#a05000"
_LINE_HEIGHT, _LETTER_WIDTH, _MOST_LINES, _MOST_WARNINGS = 0.16, 0.066, 2, 2  # inches; lines of each warning, warnings
_FAR_DOT, _NEAR_DOT = np.array([0.89] * 3), np.array([0.64] * 3)
ROOT_MARK = {"marker": "D", "s": 22, "facecolors": "#1f5fbf", "edgecolors": "white", "linewidths": 0.6, "label": "root"}
"""How the place is drawn that a tree grows from."""

# Fitted to the eye: the cloud's dots as a share of the area of a view, and each in square points at least and at most;
# the width of lines and of the dots on them over the median branch, and at least and at most in points.
_DOTS_SHARE, _DOT_AREA = 0.12, (0.6, 5)
_LINE_SHARE, _LINE_WIDTH = 0.065, (0.6, 1.5)
_DOT_SHARE, _WIDEST_DOT, _LONE_DOT = 0.12, 3.0, 3.7
_MOST_MARKS = 12  # of what samples disagree with
_BAR = (1.7, 0.09)  # width and height of the colour bar, in inches
_BAR_ROOM = 0.75  # for it and the words below, in inches
_BAR_CORNER = (0.3, 0.2)  # from the upper right corner of the picture to that of the bar, in inches


def save_preview(
    skeleton: Skeleton, path: str | os.PathLike, *, size: tuple[int, int] | None = None, title: str | None = None
) -> None:
    """Draw a skeleton and its cloud from three sides into a PNG file.

    The three views look along the coordinate axes, all at the scale of the bar above them: x across and z up, y across
    and z up, x across and y up. They are arranged so that they are large. The cloud is grey, lighter where it is
    farther; edges are red, junctions dark dots and leaves open ones, unless branches are too short for dots; a blue
    diamond is where a tree grows from, ``Report.root``. After `support`, amber rings mark parts that few samples show,
    and crosses those that the skeleton lacks but samples show, with their numbers. Below are the counts, the first two
    warnings, and the number of the others.

    Parameters
    ----------
    skeleton : Skeleton
    path : path-like
        PNG; it appears complete or not at all.
    size : (width, height), optional
        In pixels. By default it follows the object: from 900 x 450 to 1800 x 1200.
    title : str, optional
        Above the views.

    Raises
    ------
    FileFormatError, MissingPackageError, OSError
        The ending is not ``.png``, matplotlib is not installed, or the file cannot be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import torus
    >>> with TemporaryDirectory() as folder:
    ...     save_preview(skeletonize(torus(1000).points), f"{folder}/ring.png")
    """
    check_ending(path, "preview is a picture", ".png")
    figures.save_figure(draw(skeleton, size, title, warnings=skeleton.report.warnings), path)


def save_assessment(
    skeleton: Skeleton,
    points: np.ndarray,
    values: np.ndarray,
    path: str | os.PathLike,
    *,
    label: str,
    best: int = 0,
    unknown: str = "not measured",
    size: tuple[int, int] = (1800, 760),
    title: str | None = None,
) -> None:
    """Draw a skeleton in its cloud from three sides, as `save_preview` does, its edges coloured by a measure.

    Parameters
    ----------
    skeleton : Skeleton
    points : (N, 3) float array
        The cloud, in grey.
    values : (E,) float array
        One per edge, shown from 0 to 1 and clipped to that range; NaN is black.
    path : path-like
        PNG; it appears complete or not at all.
    label : str
        Name of the values, on the colour bar.
    best : {0, 1}
        The good end of the scale, dark blue; the bad one is orange.
    unknown : str
        Meaning of NaN, below the colour bar if there is any.
    size : (width, height)
        In pixels.
    title : str, optional
        Above the views.

    Raises
    ------
    InvalidParameterError
        There is not one value per edge.
    FileFormatError, MissingPackageError, OSError
        The ending is not ``.png``, matplotlib is not installed, or the file cannot be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.analysis import compare
    >>> from glsk_o3d.samples import torus
    >>> ring = torus(1000)
    >>> skeleton = skeletonize(ring.points)
    >>> error = compare(skeleton, ring).edge_error
    >>> with TemporaryDirectory() as folder:
    ...     save_assessment(skeleton, ring.points, error, f"{folder}/error.png", label="error")
    """
    check_ending(path, "picture is a PNG", ".png")
    if np.shape(values) != (len(skeleton.edges),):
        raise InvalidParameterError(f"{len(skeleton.edges)} edges need as many values, not {np.shape(values)}")
    shown = replace(skeleton, points=points, vertex_of_point=np.empty(0), normals=np.empty(0))
    figure = draw(shown, size, title, least_head=_BAR_ROOM)
    _colour(figure, values, label, best, unknown)
    figures.save_figure(figure, path)


def draw(skeleton: Skeleton, size, title, caption=True, warnings: Sequence[str] = (), point_colors=None, least_head=0):
    """The figure, not yet in a file."""
    drawn = figures.thinned(skeleton.points, figures.MOST_DRAWN_POINTS)
    cloud, paint = skeleton.points[drawn], None if point_colors is None else np.asarray(point_colors)[drawn]
    centre, extent = figures.room(np.concatenate([cloud, skeleton.vertices]))
    foot, root = 0.34, skeleton.report.root
    head = max(0.58 if title else 0.42 if root else 0.25, least_head)
    if size is None:
        told = _LINE_HEIGHT * (_MOST_LINES * _MOST_WARNINGS + 1) if warnings else 0
        size = figures.DPI * figures.fitting_size(extent, head=head, foot=foot + told)
    figure = figures.new_figure((size[0], size[1]))
    width, height = figure.get_size_inches()
    warned = _warned(warnings, width, height)
    below = _LINE_HEIGHT * len(warned)
    for a, b, axes in figures.three_views(figure, extent, head=head, foot=foot + below):
        scale = 72 * axes.get_position().width * width / extent[a]  # points per unit
        _draw_cloud(axes, cloud - centre, paint, a, b, scale**2 * np.prod(np.sort(extent)[1:]))
        _draw_curve(axes, skeleton, skeleton.vertices - centre, [a, b], scale)
        _mark_doubts(axes, skeleton.report, centre, [a, b])
        if root:
            mark = axes.scatter(*np.subtract(root, centre)[[a, b]], **ROOT_MARK, zorder=4, clip_on=False)
    if root:
        style = dict(loc="upper left", frameon=False, borderpad=0, borderaxespad=0, handlelength=0.8)
        corner = (figures.VIEW_GAP / width, 1 - 0.1 / height)
        figure.legend(handles=[mark], fontsize=8, labelcolor=INK, bbox_to_anchor=corner, **style)
    if caption:
        counts = _caption(skeleton)
        points = 8 * min(1, (width - figures.VIEW_GAP) / (_LETTER_WIDTH * len(counts)))
        figure.text(0.5, (0.12 + below) / height, counts, ha="center", color=INK, fontsize=points)
    style = dict(x=0.5, ha="center", parse_math=False)
    for row, line in enumerate(reversed(warned)):
        place = (0.1 + row * _LINE_HEIGHT) / height
        figure.text(y=place, s=figures.printable(line), color=_AMBER, fontsize=8, **style)
    if title:
        figure.text(y=1 - 0.33 / height, s=figures.printable(title), color=INK, fontsize=12, **style)
    return figure


def _draw_cloud(axes, cloud, paint, a, b, area):
    """Dots of such colours, or grey and lighter where they are farther; smaller the more are in the area [points^2]."""
    depth, toward = cloud[:, 3 - a - b], 1 if (a, b) != (0, 2) else -1  # x, y, z are right-handed
    order = np.argsort(toward * depth, kind="stable")
    near = (np.arange(len(order)) / max(len(order) - 1, 1))[:, None]
    style = {"linewidths": 0, "clip_on": False, "s": np.clip(_DOTS_SHARE * area / max(len(cloud), 1), *_DOT_AREA)}
    colors = _FAR_DOT + near * (_NEAR_DOT - _FAR_DOT) if paint is None else paint[order]
    axes.scatter(cloud[order, a], cloud[order, b], c=colors, **style)


def _draw_curve(axes, skeleton, vertices, across_up, scale):
    """Edges, and junctions and leaves where branches are long enough for dots on them; the scale is points per unit."""
    from matplotlib.collections import LineCollection

    lengths = [norm(np.diff(skeleton.vertices[path], axis=0)).sum() for path in skeleton.branches]
    branch = scale * float(np.median(lengths)) if lengths else 0.0
    line = float(np.clip(_LINE_SHARE * branch, *_LINE_WIDTH))
    segments = vertices[skeleton.edges][:, :, across_up]
    axes.add_collection(LineCollection(segments, colors=_RED, linewidths=line, capstyle="round", clip_on=False))
    dot = min(_DOT_SHARE * branch, _WIDEST_DOT)
    spots = [(skeleton.degree == 0, _RED, _LONE_DOT)]
    if dot > line:
        spots += [(skeleton.degree == 1, PAPER, dot), (skeleton.degree > 2, INK, dot)]
    for chosen, face, wide in spots:
        style = {"s": wide**2, "facecolors": face, "edgecolors": _RED if face == PAPER else face}
        axes.scatter(*vertices[chosen][:, across_up].T, zorder=3, clip_on=False, linewidths=0.3 * wide, **style)


def _mark_doubts(axes, report, centre, across_up):
    """Amber rings around what few samples show, crosses where many show what is not there, and how many of them."""
    for it in report.unsupported[:_MOST_MARKS]:
        x, y = np.subtract(it.place, centre)[across_up]
        ring, cross = dict(marker="o", facecolors="none", edgecolors=_AMBER), dict(marker="x", c=_AMBER)
        axes.scatter(x, y, s=70, linewidths=1, zorder=5, clip_on=False, **(ring if it.present else cross))
        note = f"{round(it.share * report.n_draws)}/{report.n_draws}"
        axes.annotate(note, (x, y), (6, 4), textcoords="offset points", color=_AMBER, fontsize=6, annotation_clip=False)


def _warned(warnings: Sequence[str], width: float, height: float) -> list[str]:
    """The first two warnings in two lines each, and how many more there are; fewer in a low picture."""
    letters = max(int((width - 2 * figures.VIEW_GAP) / _LETTER_WIDTH), 20)
    lines: list[str] = []
    for warning in warnings[:_MOST_WARNINGS]:
        lines += textwrap.wrap(f"warning: {warning}", letters, max_lines=_MOST_LINES, placeholder=" ...")
    more = len(warnings) - _MOST_WARNINGS
    if more > 0:
        lines.append(f"and {more} more warning{'s' * (more > 1)}")
    return lines[: int(height / 3 / _LINE_HEIGHT)]


def _caption(skeleton: Skeleton) -> str:
    n = point_count(skeleton)
    counts = {"points": n, **(structure(skeleton) if len(skeleton.vertices) or not n else {})}  # else a cloud alone
    told = [name for name in counts if name != "length" and (name != "points" or counts[name])]
    one = {"vertices": "vertex", "leaves": "leaf"}
    words = [f"{counts[name]} {one.get(name, name[:-1]) if counts[name] == 1 else name}" for name in told]
    return "   \N{MIDDLE DOT}   ".join(words)


def _colour(figure, values, label, best, unknown):
    """Colour the edges in a figure of `draw` by values from 0 to 1, and say by a bar in its corner what they are."""
    from matplotlib import colormaps  # it is there: the figure was drawn with it
    from matplotlib.cm import ScalarMappable
    from matplotlib.collections import LineCollection
    from matplotlib.colors import ListedColormap, Normalize

    shades = colormaps["plasma"](np.linspace(0, 0.8, 256))  # its last fifth is too light for thin lines on white
    shades = ListedColormap(shades[::-1] if best else shades).with_extremes(bad=INK)
    scale = ScalarMappable(Normalize(0, 1, clip=True), shades)
    for axes in figure.axes:
        for drawn in axes.collections[1:]:  # the first is the cloud
            if isinstance(drawn, LineCollection):
                drawn.set(color=scale.to_rgba(np.ma.masked_invalid(values)), linewidths=2)
            else:
                drawn.set_edgecolor(INK)
    size = figure.get_size_inches()
    low = size - _BAR_CORNER - _BAR  # the lower left corner of the bar
    figures.colour_bar(figure, scale, [*(low / size), *(_BAR / size)], [0, 0.5, 1])
    beside = (low + [-0.1, _BAR[1] / 2]) / size
    figure.text(*beside, label, ha="right", va="center_baseline", color=INK, fontsize=8)
    if np.isnan(values).any():
        below = (low + [_BAR[0], -0.3]) / size
        figure.text(*below, f"black: {unknown}", ha="right", va="top", color=INK, fontsize=7)
