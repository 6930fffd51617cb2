"""A picture of a skeleton in its cloud, without a window."""

from __future__ import annotations

import os
import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..analysis.summary import point_count
from ..interop.atomic import check_ending, write_atomically
from ..interop.packages import require
from ..numerics.vectors import norm
from .layout import VIEW_GAP, fitting_size, room, three_views
from .recorder import thinned

if TYPE_CHECKING:
    from ..skeleton import Skeleton

MOST_DRAWN_POINTS = 20_000
DPI = 150
INK, _RED, _AMBER, _PAPER = "#333333", "#d0121f", "#a05000", "white"
_LINE_HEIGHT, _LETTER_WIDTH, _MOST_LINES, _MOST_WARNINGS = 0.16, 0.066, 2, 2  # inches; lines of each warning, warnings
_FAR_DOT, _NEAR_DOT = np.array([0.91] * 3), np.array([0.70] * 3)
ROOT_MARK = {"marker": "D", "s": 22, "facecolors": "#1f5fbf", "edgecolors": "white", "linewidths": 0.6, "label": "root"}
"""How the place is drawn that a tree grows from."""

# Fitted to the eye: the cloud's dots as a share of the area of a view, and each in square points at least and at most;
# the width of lines and of the dots on them over the median branch, and at least and at most in points.
_DOTS_SHARE, _DOT_AREA = 0.1, (0.5, 3)
_LINE_SHARE, _LINE_WIDTH = 0.065, (0.6, 1.5)
_DOT_SHARE, _WIDEST_DOT, _LONE_DOT = 0.12, 3.0, 3.7
_MOST_MARKS = 12  # of what samples disagree with


def save_preview(
    skeleton: Skeleton, path: str | os.PathLike, *, size: tuple[int, int] | None = None, title: str | None = None
) -> None:
    """Draw a skeleton and its cloud from three sides into a PNG file.

    The three views look along the coordinate axes, all at one scale: x across and y up, x across and z up, y across and
    z up. They are arranged so that they are large. The cloud is grey, lighter where it is farther; edges are red,
    junctions dark dots and leaves open ones, unless branches are too short for dots; a blue diamond is where a tree
    grows from, ``Report.root``. Where `support` was asked for, amber rings mark what few samples show, and crosses what
    some show and the skeleton lacks, with how many. Below are the counts and what the run warned of: the first two
    warnings, long ones shortened, fewer and shorter in a low picture, and how many more there are.

    Parameters
    ----------
    skeleton : Skeleton
    path : path-like
        PNG; it appears complete or not at all.
    size : (width, height), optional
        In pixels. By default as the object is wide and tall: from 900 x 450 to 1800 x 1200.
    title : str, optional
        Above the views.

    Raises
    ------
    FileFormatError
        The ending is not ``.png``.
    MissingPackageError
        matplotlib is not installed.
    FileNotFoundError
        The folder does not exist.
    OSError
        The file cannot be written.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import torus
    >>> with TemporaryDirectory() as folder:
    ...     save_preview(skeletonize(torus(1000).points), f"{folder}/ring.png")
    ...     Path(folder, "ring.png").stat().st_size > 10_000
    True
    """
    check_ending(path, "preview is a picture", ".png")
    save_figure(draw(skeleton, size, title, warnings=skeleton.report.warnings), path)


def draw(skeleton: Skeleton, size, title, caption=True, warnings: Sequence[str] = ()):
    """The figure, not yet in a file."""
    cloud = skeleton.points[thinned(skeleton.points, MOST_DRAWN_POINTS)]
    centre, extent = room(np.concatenate([cloud, skeleton.vertices]))
    head, foot = 0.55 if title else 0.25, 0.34
    if size is None:
        told = _LINE_HEIGHT * (_MOST_LINES * _MOST_WARNINGS + 1) if warnings else 0
        size = DPI * fitting_size(extent, head=head, foot=foot + told)
    figure = new_figure((size[0], size[1]))
    width, height = figure.get_size_inches()
    warned = _warned(warnings, width, int(height / 3 / _LINE_HEIGHT))
    below = _LINE_HEIGHT * len(warned)
    for a, b, axes in three_views(figure, extent, head=head, foot=foot + below):
        scale = 72 * axes.get_position().width * width / extent[a]  # points per unit
        _draw_cloud(axes, cloud - centre, a, b, scale**2 * np.prod(np.sort(extent)[1:]))
        _draw_curve(axes, skeleton, skeleton.vertices - centre, [a, b], scale)
        _mark_doubts(axes, skeleton.report, centre, [a, b])
        if skeleton.report.root:
            place = np.subtract(skeleton.report.root, centre)[[a, b]]
            mark = axes.scatter(*place, **ROOT_MARK, zorder=4, clip_on=False)
    if skeleton.report.root:
        figure.legend(handles=[mark], loc="upper left", frameon=False, fontsize=8, labelcolor=INK, borderaxespad=0.3)
    if caption:
        counts = _caption(skeleton)
        points = 8 * min(1, (width - VIEW_GAP) / (_LETTER_WIDTH * len(counts)))
        figure.text(0.5, (0.12 + below) / height, counts, ha="center", color=INK, fontsize=points)
    for row, line in enumerate(reversed(warned)):
        place = (0.1 + row * _LINE_HEIGHT) / height
        figure.text(0.5, place, printable(line), ha="center", color=_AMBER, fontsize=8, parse_math=False)
    if title:
        figure.text(0.5, 1 - 0.33 / height, printable(title), ha="center", color=INK, fontsize=12, parse_math=False)
    return figure


def _draw_cloud(axes, cloud, a, b, area):
    """Grey dots, lighter where they are farther, smaller where they are many in such an area [square points]."""
    depth, toward = cloud[:, 3 - a - b], 1 if (a, b) != (0, 2) else -1  # x, y, z are right-handed
    order = np.argsort(toward * depth, kind="stable")
    near = (np.arange(len(order)) / max(len(order) - 1, 1))[:, None]
    style = {"linewidths": 0, "clip_on": False, "s": np.clip(_DOTS_SHARE * area / max(len(cloud), 1), *_DOT_AREA)}
    axes.scatter(cloud[order, a], cloud[order, b], c=_FAR_DOT + near * (_NEAR_DOT - _FAR_DOT), **style)


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
        spots += [(skeleton.degree == 1, _PAPER, dot), (skeleton.degree > 2, INK, dot)]
    for chosen, face, wide in spots:
        style = {"s": wide**2, "facecolors": face, "edgecolors": _RED if face == _PAPER else face}
        axes.scatter(*vertices[chosen][:, across_up].T, zorder=3, clip_on=False, linewidths=0.3 * wide, **style)


def _mark_doubts(axes, report, centre, across_up):
    """Amber rings around what few samples show, crosses where many show what is not there, and how many of them."""
    for it in report.unsupported[:_MOST_MARKS]:
        x, y = np.subtract(it.place, centre)[across_up]
        style: dict[str, Any] = {"s": 70, "linewidths": 1, "zorder": 5, "clip_on": False}
        if it.present:
            axes.scatter(x, y, marker="o", facecolors="none", edgecolors=_AMBER, **style)
        else:
            axes.scatter(x, y, marker="x", c=_AMBER, **style)
        note = f"{round(it.share * report.n_draws)}/{report.n_draws}"
        axes.annotate(note, (x, y), (6, 4), textcoords="offset points", color=_AMBER, fontsize=6, annotation_clip=False)


def new_figure(size: tuple[float, float]) -> Any:
    """A white figure of so many pixels, on a canvas of its own: pyplot and its global state stay out of it."""
    require("matplotlib")
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(np.asarray(size) / DPI, facecolor=_PAPER)
    FigureCanvasAgg(figure)
    return figure


def colour_bar(figure, scale, box, ticks: list[float], labels: list[str] | None = None) -> None:
    """A small horizontal colour bar; the box is left, bottom, width and height, as shares of the figure."""
    bar = figure.colorbar(scale, cax=figure.add_axes(box), orientation="horizontal")
    bar.set_ticks(ticks, labels=labels)
    bar.outline.set_visible(False)
    bar.ax.tick_params(length=0, pad=2, labelsize=7, labelcolor=INK)


def save_figure(figure, path: str | os.PathLike) -> None:
    """Write a figure as PNG, without the version of matplotlib; it appears complete or not at all."""
    options = {"format": "png", "dpi": DPI, "metadata": {"Software": None}}
    write_atomically(path, lambda temporary: figure.savefig(temporary, **options))


def printable(text: object) -> str:
    """A text that may be a file name, which may be no Unicode, as one that can be drawn and encoded."""
    return str(text).encode("utf-8", "replace").decode()


def _warned(warnings: Sequence[str], width: float, room: int) -> list[str]:
    """At most so many lines that tell the warnings in a figure so many inches wide; the last counts what is left."""
    letters = max(int((width - 2 * VIEW_GAP) / _LETTER_WIDTH), 20)
    lines: list[str] = []
    more = len(warnings)
    for warning in warnings[:_MOST_WARNINGS]:
        free = room - len(lines) - (more > 1)
        if free < 1:
            break
        wrapper = textwrap.TextWrapper(letters, max_lines=min(_MOST_LINES, free), placeholder=" ...")
        lines += wrapper.wrap(f"warning: {warning}")
        more -= 1
    if more and room > len(lines):
        told = f"and {more} more" if lines else f"{more}"
        lines.append(f"{told} warning{'s' * (more > 1)}")
    return lines


def _caption(skeleton: Skeleton) -> str:
    n_points = point_count(skeleton)
    counts = (
        *[(n_points, "point")] * (n_points > 0),
        (len(skeleton.vertices), "vertex"),
        (len(skeleton.edges), "edge"),
        (skeleton.n_components, "component"),
        (skeleton.n_loops, "loop"),
        (len(skeleton.leaves), "leaf"),
        (len(skeleton.junctions), "junction"),
    )
    plural = {"vertex": "vertices", "leaf": "leaves"}
    words = [f"{n} {noun if n == 1 else plural.get(noun, noun + 's')}" for n, noun in counts]
    return "   \N{MIDDLE DOT}   ".join(words)
