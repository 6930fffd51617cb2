"""A picture of a skeleton in its cloud, without a window."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import numpy as np

from .files import check_ending, write_atomically
from .open3d import require

if TYPE_CHECKING:
    from ..skeleton import Skeleton

MOST_POINTS = 20_000
DPI = 150
_VIEWS = ((0, 1), (0, 2), (1, 2))
INK, _RED, _PAPER = "#333333", "#d0121f", "white"
_FAR, _NEAR = np.array([0.90] * 3), np.array([0.68] * 3)


def save_preview(
    skeleton: Skeleton, path: str | os.PathLike, *, size: tuple[int, int] = (1800, 760), title: str | None = None
) -> None:
    """Draw a skeleton and its cloud from three sides into a PNG file.

    The three views look along the coordinate axes, all at one scale: x across and y up, x across and z up, y across and
    z up. The cloud is grey, lighter where it is farther; edges are red, junctions dark dots, leaves open ones.

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
    """
    check_ending(path, "preview is a picture", ".png")
    figure = draw(skeleton, size, title)
    write_atomically(path, lambda temporary: figure.savefig(temporary, format="png", dpi=DPI))


def draw(skeleton: Skeleton, size, title, caption=True):
    """The figure, on a canvas of its own: pyplot and its global state stay out of it."""
    require("matplotlib")
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.collections import LineCollection
    from matplotlib.figure import Figure

    width, height = np.asarray(size) / DPI  # inches, as everything below
    figure = Figure((width, height), facecolor=_PAPER)
    FigureCanvasAgg(figure)
    cloud = skeleton.points[np.isfinite(skeleton.points).all(axis=1)]
    cloud = cloud[:: max(1, -(-len(cloud) // MOST_POINTS))]
    shown = np.concatenate([cloud, skeleton.vertices])
    low, high = (shown.min(axis=0), shown.max(axis=0)) if len(shown) else np.zeros((2, 3))
    centre = low + (high - low) / 2
    cloud, vertices = cloud - centre, skeleton.vertices - centre  # small numbers: matplotlib's transforms lose digits
    extent = np.maximum(high - low, 0.08 * (high - low).max() or 1.0)

    pad, foot, head = 0.3, 0.6, 0.55 if title else 0.25
    across, up = np.array([extent[[a, b]] for a, b in _VIEWS]).T
    scale = min((width - 4 * pad) / across.sum(), (height - foot - head) / up.max())
    gap = (width - scale * across.sum()) / 4
    left = gap
    for (a, b), view_width in zip(_VIEWS, scale * across, strict=True):
        middle = foot + (height - foot - head) / 2
        box = [left, middle - scale * extent[b] / 2, view_width, scale * extent[b]]
        axes = figure.add_axes(np.divide(box, [width, height, width, height]))
        axes.set_axis_off()
        axes.set(xlim=extent[a] * np.array([-0.5, 0.5]), ylim=extent[b] * np.array([-0.5, 0.5]))
        style = {"linewidths": 0, "clip_on": False}
        depth, toward = cloud[:, 3 - a - b], 1 if (a, b) != (0, 2) else -1  # x, y, z are right-handed
        order = np.argsort(toward * depth, kind="stable")
        near = (np.arange(len(order)) / max(len(order) - 1, 1))[:, None]
        axes.scatter(cloud[order, a], cloud[order, b], s=_dot(len(cloud)), c=_FAR + near * (_NEAR - _FAR), **style)
        segments = vertices[skeleton.edges][:, :, [a, b]]
        axes.add_collection(LineCollection(segments, colors=_RED, linewidths=1.5, capstyle="round", clip_on=False))
        for chosen, face, area in (
            (skeleton.degree == 0, _RED, 14),
            (skeleton.degree == 1, _PAPER, 9),
            (skeleton.degree > 2, INK, 9),
        ):
            spots = {"s": area, "facecolors": face, "edgecolors": _RED if face == _PAPER else face, "linewidths": 0.9}
            axes.scatter(*vertices[chosen][:, [a, b]].T, zorder=3, clip_on=False, **spots)
        names = f"{'xyz'[a]}\N{RIGHTWARDS ARROW} {'xyz'[b]}\N{UPWARDS ARROW}"
        figure.text((left + view_width / 2) / width, 0.36 / height, names, ha="center", color="#999999", fontsize=7)
        left += view_width + gap
    if caption:
        figure.text(0.5, 0.12 / height, _caption(skeleton), ha="center", color=INK, fontsize=8)
    if title:
        figure.text(0.5, 1 - 0.33 / height, printable(title), ha="center", color=INK, fontsize=12, parse_math=False)
    return figure


def printable(text: object) -> str:
    """A text that may be a file name, which may be no Unicode, as one that can be drawn and encoded.

    Parameters
    ----------
    text : object

    Returns
    -------
    str
    """
    return str(text).encode("utf-8", "replace").decode()


def _dot(n: int) -> float:
    """Area of a dot of the cloud, in square points."""
    return float(np.clip(4500 / max(n, 1), 0.8, 3))


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
