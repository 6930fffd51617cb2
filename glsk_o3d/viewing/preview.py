"""A picture of a skeleton in its cloud, without a window."""

from __future__ import annotations

import os
import textwrap
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..interop.atomic import check_ending, write_atomically
from ..interop.packages import require

if TYPE_CHECKING:
    from ..skeleton import Skeleton

MOST_DRAWN_POINTS = 20_000
DPI = 150
_VIEWS, _VIEW_GAP = ((0, 1), (0, 2), (1, 2)), 0.3  # inches between them at least
INK, _RED, _AMBER, _PAPER = "#333333", "#d0121f", "#a05000", "white"
_LINE_HEIGHT, _LETTER_WIDTH, _MOST_LINES, _MOST_WARNINGS = 0.16, 0.066, 2, 2  # inches; lines of each warning, warnings
_FAR_DOT, _NEAR_DOT = np.array([0.90] * 3), np.array([0.68] * 3)


def save_preview(
    skeleton: Skeleton, path: str | os.PathLike, *, size: tuple[int, int] = (1800, 760), title: str | None = None
) -> None:
    """Draw a skeleton and its cloud from three sides into a PNG file.

    The three views look along the coordinate axes, all at one scale: x across and y up, x across and z up, y across and
    z up. The cloud is grey, lighter where it is farther; edges are red, junctions dark dots, leaves open ones. Below
    are the counts and what the run warned of: the first two warnings, long ones shortened, fewer and shorter in a low
    picture, and how many more there are.

    Parameters
    ----------
    skeleton : Skeleton
    path : path-like
        PNG; it appears complete or not at all.
    size : (width, height)
        In pixels.
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
    figure = new_figure(size)
    from matplotlib.collections import LineCollection

    width, height = figure.get_size_inches()
    cloud = skeleton.points[np.isfinite(skeleton.points).all(axis=1)]
    cloud = cloud[:: max(1, -(-len(cloud) // MOST_DRAWN_POINTS))]
    centre, extent = room(np.concatenate([cloud, skeleton.vertices]))
    cloud, vertices = cloud - centre, skeleton.vertices - centre
    warned = _warned(warnings, width, int(height / 3 / _LINE_HEIGHT))
    below = _LINE_HEIGHT * len(warned)
    views = three_views(figure, extent, head=0.55 if title else 0.25, foot=0.6 + below, names=0.36 + below)
    for a, b, axes in views:
        style = {"linewidths": 0, "clip_on": False, "s": np.clip(4500 / max(len(cloud), 1), 0.8, 3)}
        depth, toward = cloud[:, 3 - a - b], 1 if (a, b) != (0, 2) else -1  # x, y, z are right-handed
        order = np.argsort(toward * depth, kind="stable")
        near = (np.arange(len(order)) / max(len(order) - 1, 1))[:, None]
        axes.scatter(cloud[order, a], cloud[order, b], c=_FAR_DOT + near * (_NEAR_DOT - _FAR_DOT), **style)
        segments = vertices[skeleton.edges][:, :, [a, b]]
        axes.add_collection(LineCollection(segments, colors=_RED, linewidths=1.5, capstyle="round", clip_on=False))
        for chosen, face, area in (
            (skeleton.degree == 0, _RED, 14),
            (skeleton.degree == 1, _PAPER, 9),
            (skeleton.degree > 2, INK, 9),
        ):
            spots = {"s": area, "facecolors": face, "edgecolors": _RED if face == _PAPER else face, "linewidths": 0.9}
            axes.scatter(*vertices[chosen][:, [a, b]].T, zorder=3, clip_on=False, **spots)
    if caption:
        figure.text(0.5, (0.12 + below) / height, _caption(skeleton), ha="center", color=INK, fontsize=8)
    for row, line in enumerate(reversed(warned)):
        place = (0.1 + row * _LINE_HEIGHT) / height
        figure.text(0.5, place, printable(line), ha="center", color=_AMBER, fontsize=8, parse_math=False)
    if title:
        figure.text(0.5, 1 - 0.33 / height, printable(title), ha="center", color=INK, fontsize=12, parse_math=False)
    return figure


def new_figure(size: tuple[int, int]) -> Any:
    """A white figure of so many pixels, on a canvas of its own: pyplot and its global state stay out of it."""
    require("matplotlib")
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(np.asarray(size) / DPI, facecolor=_PAPER)
    FigureCanvasAgg(figure)
    return figure


def room(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Middle and size, (3,) float arrays, of the box of points, (n, 3) float array, that is drawn.

    matplotlib's transforms lose digits unless the middle is taken off.
    """
    low, high = (points.min(axis=0), points.max(axis=0)) if len(points) else np.zeros((2, 3))
    return low + (high - low) / 2, np.maximum(high - low, 0.08 * (high - low).max() or 1.0)


def three_views(
    figure, extent: np.ndarray, *, head: float, foot: float, names: float
) -> Iterator[tuple[int, int, Any]]:
    """Axes for the views along the coordinate axes, all at one scale, with the names of their axes below.

    What is drawn is around the origin, of this extent, (3,) float array; head and foot are the room above and below,
    and names the height of the names, in inches. Gives the coordinates that are drawn, across and up, and their axes.
    """
    width, height = figure.get_size_inches()
    across, up = np.array([extent[[a, b]] for a, b in _VIEWS]).T
    scale = min((width - 4 * _VIEW_GAP) / across.sum(), (height - foot - head) / up.max())
    gap = (width - scale * across.sum()) / 4
    left, middle = gap, foot + (height - foot - head) / 2
    for a, b in _VIEWS:
        box = [left, middle - scale * extent[b] / 2, scale * extent[a], scale * extent[b]]
        axes = figure.add_axes(np.divide(box, [width, height] * 2))
        axes.set_axis_off()
        axes.set(xlim=extent[a] * np.array([-0.5, 0.5]), ylim=extent[b] * np.array([-0.5, 0.5]))
        yield a, b, axes
        told = f"{'xyz'[a]}\N{RIGHTWARDS ARROW} {'xyz'[b]}\N{UPWARDS ARROW}"
        figure.text((left + box[2] / 2) / width, names / height, told, ha="center", color="#999999", fontsize=7)
        left += box[2] + gap


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
    letters = max(int((width - 2 * _VIEW_GAP) / _LETTER_WIDTH), 20)
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
    counts = (
        (len(skeleton.points), "point"),
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
