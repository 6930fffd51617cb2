"""Pictures of a skeleton in its cloud, without a window."""

import os
import textwrap
from typing import Any

import numpy as np

from ..analysis.summary import point_count, structure
from ..data.report import Report
from ..data.skeleton import Skeleton
from ..errors import InvalidParameterError
from ..geometry.vectors import norm
from ..interop.atomic import check_ending
from . import figures
from .figures import INK, PAPER

_RED, _BLUE, _AMBER = "#d0121f", "#1f5fbf", "#a05000"
_LINE_HEIGHT, _LETTER_WIDTH, _MOST_LINES, _MOST_WARNINGS = 0.16, 0.066, 2, 2  # inches; lines of each warning, warnings
_TITLE_SIZE = 1.5  # over the size of the other letters
_FAR_DOT, _NEAR_DOT, _AMBER_DOT = np.array([0.89] * 3), np.array([0.64] * 3), np.array([0.93, 0.6, 0.15])
ROOT_MARK = {"marker": "D", "s": 22, "facecolors": _BLUE, "edgecolors": "white", "linewidths": 0.6, "label": "root"}
"""How the place is drawn that a tree grows from."""

# Fitted to the eye: the cloud's dots as a share of the area of a view, and each in square points at least and at most;
# the width of lines and of the dots on them over the median branch, and at least and at most in points.
_DOTS_SHARE, _DOT_AREA = 0.12, (0.6, 5)
_LINE_SHARE, _LINE_WIDTH = 0.065, (0.6, 1.5)
_DOT_SHARE, _WIDEST_DOT, _LONE_DOT = 0.12, 3.0, 3.7
_MOST_MARKS = 12  # of what samples disagree with


def save_preview(
    skeleton: Skeleton,
    path: str | os.PathLike[str],
    *,
    title: str | None = None,
    beside: Skeleton | None = None,
    marked: np.ndarray | None = None,
) -> None:
    """Draw a skeleton and its cloud from three sides into a PNG file.

    The three views look along the coordinate axes, all at the scale of the bar above them: x across and z up, y across
    and z up, x across and y up. They are arranged so that they are large, in 900 x 450 to 1800 x 1200 pixels. The cloud
    is grey, lighter where it is farther; edges are red, junctions dark dots and leaves open ones, unless branches are
    too short for dots; a blue diamond is where a tree grows from, ``Report.root``. After `support`, amber rings mark
    parts that few samples show, and crosses those that the skeleton lacks but samples show, with their numbers. Below
    are the counts, the first two warnings, and the number of the others.

    Parameters
    ----------
    skeleton : Skeleton
    path : path-like
        PNG; it appears complete or not at all.
    title : str, optional
        Above the views.
    beside : Skeleton, optional
        Another one of the same object, as of a cross-check: drawn in blue below the first.
    marked : (N,) bool array, optional
        Points of the skeleton's cloud that are amber.

    Raises
    ------
    InvalidParameterError, FileFormatError, MissingPackageError, OSError
        `marked` has not a value for each point, the ending is not ``.png``, matplotlib is not installed, or the file
        cannot be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import torus
    >>> with TemporaryDirectory() as folder:
    ...     save_preview(skeletonize(torus(1000).points), f"{folder}/ring.png")
    """
    check_ending(path, "preview is a picture", ".png")
    figures.save_figure(draw(skeleton, title, beside, marked), path)


def draw(
    skeleton: Skeleton, title: str | None = None, beside: Skeleton | None = None, marked: np.ndarray | None = None
) -> Any:
    """The figure, not yet in a file."""
    points = skeleton.whole.points
    if marked is not None and np.shape(marked) != (len(points),):
        raise InvalidParameterError(f"marked: {len(points)} points need as many values, not {np.shape(marked)}")
    shown = figures.thinned(points, figures.MOST_DRAWN_POINTS)
    cloud, amber = points[shown], np.zeros(len(shown), bool) if marked is None else np.asarray(marked, bool)[shown]
    vertices = [curve.vertices for curve in (skeleton, beside) if curve is not None]
    centre, extent = figures.room(np.concatenate([cloud, *vertices]))
    head, foot, report = 0.58 if title else 0.25, 0.34, skeleton.report
    room = _LINE_HEIGHT * (_MOST_LINES * _MOST_WARNINGS + 1) if report.warnings else 0
    figure = figures.new_figure(figures.fitting_size(extent, head=head, foot=foot + room))
    width, height = figure.get_size_inches()
    pairs = (f"{name}_{value}" for name, value in counts(skeleton).items())
    counted = [line.replace("_", " ") for line in _wrapped("   ".join(pairs), width)]
    warned = [line for text in report.warnings[:_MOST_WARNINGS] for line in _wrapped(f"warning: {text}", width)]
    if (more := len(report.warnings) - _MOST_WARNINGS) > 0:
        warned.append(f"and {more} more warning{'s' * (more > 1)}")
    heads = _wrapped(figures.printable(title or ""), width / _TITLE_SIZE)
    below, head = _LINE_HEIGHT * len(warned), head + _TITLE_SIZE * _LINE_HEIGHT * max(len(heads) - 1, 0)
    foot += _LINE_HEIGHT * (len(counted) - 1)
    for a, b, axes in figures.three_views(figure, extent, head=head, foot=foot + below):
        scale = 72 * axes.get_position().width * width / extent[a]  # points per unit
        _draw_cloud(axes, cloud - centre, amber, a, b, scale**2 * np.prod(np.sort(extent)[1:]))
        if beside is not None:
            _draw_curve(axes, beside, beside.vertices - centre, [a, b], scale, _BLUE)
        _draw_curve(axes, skeleton, skeleton.vertices - centre, [a, b], scale, _RED)
        _mark_doubts(axes, report, centre, [a, b])
        if report.root:
            axes.scatter(*np.subtract(report.root, centre)[[a, b]], **ROOT_MARK, zorder=4, clip_on=False)
    style = dict(ha="center", parse_math=False)
    lines = [*((line, INK, 0.12) for line in counted), *((line, _AMBER, 0.1) for line in warned)]
    for row, (line, color, up) in enumerate(reversed(lines)):
        place = (up + row * _LINE_HEIGHT) / height
        figure.text(0.5, place, figures.printable(line), color=color, fontsize=8, **style)
    for row, line in enumerate(heads):
        place = 1 - (0.33 + row * _TITLE_SIZE * _LINE_HEIGHT) / height
        figure.text(0.5, place, line, color=INK, fontsize=8 * _TITLE_SIZE, **style)
    return figure


def counts(skeleton: Skeleton) -> dict[str, str]:
    """The counts of a skeleton and its length, as people read them."""
    facts = {"points": point_count(skeleton), **structure(skeleton)}
    return {name: f"{value:.4g}" if name == "length" else f"{value:,}" for name, value in facts.items()}


def _draw_cloud(axes: Any, cloud: np.ndarray, amber: np.ndarray, a: int, b: int, area: float) -> None:
    """Grey dots, lighter where they are farther, some of them amber; smaller the more are in the area [points^2]."""
    depth, toward = cloud[:, 3 - a - b], 1 if (a, b) != (0, 2) else -1  # x, y, z are right-handed
    order = np.argsort(toward * depth, kind="stable")
    near = (np.arange(len(order)) / max(len(order) - 1, 1))[:, None]
    style = {"linewidths": 0, "clip_on": False, "s": np.clip(_DOTS_SHARE * area / max(len(cloud), 1), *_DOT_AREA)}
    color = np.where(amber[order, None], _AMBER_DOT, _FAR_DOT + near * (_NEAR_DOT - _FAR_DOT))
    axes.scatter(cloud[order, a], cloud[order, b], c=color, **style)


def _draw_curve(
    axes: Any, skeleton: Skeleton, vertices: np.ndarray, across_up: list[int], scale: float, color: str
) -> None:
    """Edges, and junctions and leaves where branches are long enough for dots on them; the scale is points per unit."""
    from matplotlib.collections import LineCollection

    lengths = [norm(np.diff(skeleton.vertices[path], axis=0)).sum() for path in skeleton.branches]
    branch = scale * float(np.median(lengths)) if lengths else 0.0
    line = float(np.clip(_LINE_SHARE * branch, *_LINE_WIDTH))
    segments = vertices[skeleton.edges][:, :, across_up]
    axes.add_collection(LineCollection(segments, colors=color, linewidths=line, capstyle="round", clip_on=False))
    dot = min(_DOT_SHARE * branch, _WIDEST_DOT)
    spots = [(skeleton.degree == 0, color, _LONE_DOT)]
    if dot > line:
        spots += [(skeleton.degree == 1, PAPER, dot), (skeleton.degree > 2, INK, dot)]
    for chosen, face, wide in spots:
        style = {"s": wide**2, "facecolors": face, "edgecolors": color if face == PAPER else face}
        axes.scatter(*vertices[chosen][:, across_up].T, zorder=3, clip_on=False, linewidths=0.3 * wide, **style)


def _mark_doubts(axes: Any, report: Report, centre: np.ndarray, across_up: list[int]) -> None:
    """Amber rings around what few samples show, crosses where many show what is not there, and how many of them."""
    for it in report.unsupported[:_MOST_MARKS]:
        x, y = np.subtract(it.place, centre)[across_up]
        ring, cross = dict(marker="o", facecolors="none", edgecolors=_AMBER), dict(marker="x", c=_AMBER)
        axes.scatter(x, y, s=70, linewidths=1, zorder=5, clip_on=False, **(ring if it.present else cross))
        note = f"{round(it.share * report.n_draws)}/{report.n_draws}"
        axes.annotate(note, (x, y), (6, 4), textcoords="offset points", color=_AMBER, fontsize=6, annotation_clip=False)


def _wrapped(text: str, width: float) -> list[str]:
    """A text in at most two lines of small letters as wide as a picture."""
    letters = int((width - 2 * figures.VIEW_GAP) / _LETTER_WIDTH)
    return textwrap.wrap(text, letters, max_lines=_MOST_LINES, placeholder=" ...", break_on_hyphens=False)
