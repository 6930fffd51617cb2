"""Pictures of a skeleton in its cloud, without a window."""

import os
import textwrap
from typing import Any

import numpy as np

from ..data.report import Report
from ..data.skeleton import Skeleton
from ..errors import InvalidParameterError
from ..geometry.vectors import box
from ..interop.atomic import check_ending
from ..interop.packages import require
from . import figures
from .figures import INK, PAPER

_RED, _BLUE, _AMBER = "#d0121f", "#1f5fbf", "#a05000"
_FAR_DOT, _NEAR_DOT, _AMBER_DOT = np.array([0.89] * 3), np.array([0.64] * 3), np.array([0.93, 0.6, 0.15])
ROOT_MARK = {"marker": "D", "s": 22, "facecolors": _BLUE, "edgecolors": "white", "linewidths": 0.6, "label": "root"}
"""How the place is drawn that a tree grows from."""

# All fitted to the eye.
_VIEWS = ((0, 2), (1, 2), (0, 1))  # coordinates across and up: from the front, from the side, and from above
_SMALLEST_VIEWS, _LARGEST_VIEWS = (5.0, 2.0), (11.0, 6.5)  # inches, of all views together
_THINNEST = 0.08  # of an extent, over the largest: flat things have room for the width of their lines
_DOT_INK, _DOT_AREA = 40_000.0, (0.6, 5.0)  # square points of all dots of a cloud together, and of one
_MOST_DOTTED = 100  # branches, beyond which ends and junctions have no dots
_MOST_LINES, _MOST_WARNINGS, _MOST_MARKS = 2, 2, 12  # lines of a warning; warnings; marks of what samples disagree with
_LETTERS = 14  # of the smaller size, per inch


def save_preview(
    skeleton: Skeleton,
    path: str | os.PathLike[str],
    *,
    title: str | None = None,
    beside: Skeleton | None = None,
    marked: np.ndarray | None = None,
) -> None:
    """Draw a skeleton and its cloud from three sides into a PNG file.

    The three views are those of an engineering drawing: from the front (x across, z up), beside it from the side (y
    across, z up), and below it from above (x across, y up), all at the scale of the bar. The cloud is grey, lighter
    where it is farther; edges are red, junctions dark dots and leaves open ones, unless there are more than a hundred
    branches; a blue diamond is where a tree grows from, ``Report.root``. After `support`, amber rings mark parts that
    few samples show, and crosses those that the skeleton lacks but samples show, with their numbers. Below are the
    counts, the first two warnings, and the number of the others.

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
    curves = [(curve, color) for curve, color in ((beside, _BLUE), (skeleton, _RED)) if curve is not None]
    drawn = np.concatenate([cloud, *(curve.vertices for curve, _ in curves)])
    low, high = box(drawn) if len(drawn) else np.zeros((2, 3))
    # the middle is taken off, and the unit is the largest side: transforms of matplotlib lose digits
    centre, unit = low + (high - low) / 2, (high - low).max() or 1.0
    extent = np.maximum((high - low) / unit, _THINNEST)
    figure, views = _three_views(extent, unit)
    for a, b, axes in views:
        _draw_cloud(axes, (cloud - centre) / unit, amber, a, b)
        for curve, color in curves:
            _draw_curve(axes, curve, ((curve.vertices - centre) / unit)[:, [a, b]], color)
        _mark_doubts(axes, skeleton.report, centre, unit, [a, b])
        if skeleton.report.root:
            place = (np.subtract(skeleton.report.root, centre) / unit)[[a, b]]
            axes.scatter(*place, **ROOT_MARK, zorder=4, clip_on=False)
    letters = int(_LETTERS * figure.get_figwidth())
    heads = _wrapped(title or "", int(letters / 1.5))
    color = _AMBER if skeleton.report.warnings else INK
    figure.suptitle("\n".join(heads), color=INK, fontsize=12, parse_math=False)
    figure.supxlabel("\n".join(_caption(skeleton, letters)), color=color, fontsize=8, parse_math=False)
    return figure


def _three_views(extent: np.ndarray, unit: float) -> tuple[Any, list[tuple[int, int, Any]]]:
    """A figure, and the axes of the views, at one scale, with the coordinates that go across and up.

    The objects are around the origin; their sides are `extent` in a `unit` of the user's, in which the bar has a length
    that is a round number.
    """
    require("matplotlib")
    from matplotlib.font_manager import FontProperties
    from matplotlib.ticker import MaxNLocator
    from mpl_toolkits.axes_grid1.anchored_artists import AnchoredSizeBar

    sides = extent[0] + extent[1], extent[2] + extent[1]
    size = np.clip(min(np.divide(_LARGEST_VIEWS, sides)) * np.array(sides), _SMALLEST_VIEWS, _LARGEST_VIEWS)
    figure = figures.new_figure(size + [1.0, 1.5], layout="compressed")
    grid = figure.subplots(2, 2, width_ratios=extent[:2], height_ratios=extent[[2, 1]])
    grid[1, 1].set_axis_off()
    views = [(a, b, axes) for (a, b), axes in zip(_VIEWS, grid.flat, strict=False)]
    for a, b, axes in views:
        axes.set(xticks=[], yticks=[], xlim=(-extent[a] / 2, extent[a] / 2), ylim=(-extent[b] / 2, extent[b] / 2))
        axes.set_aspect("equal")
        axes.spines[:].set_visible(False)
        axes.set_xlabel("xyz"[a], color="#999999", fontsize=7)
        axes.set_ylabel("xyz"[b], color="#999999", fontsize=7)
    length = MaxNLocator(2, steps=[1, 2, 5, 10]).tick_values(0, extent[0] * unit / 2)[1]
    place = dict(loc="lower left", bbox_to_anchor=(0, 1), bbox_transform=grid[0, 0].transAxes)  # above the view
    style = dict(frameon=False, borderpad=0.5, color=INK, fontproperties=FontProperties(size=7))
    grid[0, 0].add_artist(AnchoredSizeBar(grid[0, 0].transData, length / unit, f"{length:g}", **place, **style))
    return figure, views


def _caption(skeleton: Skeleton, letters: int) -> list[str]:
    """The counts and the first warnings, in lines of at most so many letters."""
    warnings = skeleton.report.warnings
    pairs = "   ".join(f"{name} {value}" for name, value in figures.counts(skeleton).items())
    lines = [*textwrap.wrap(pairs, letters)]
    for text in warnings[:_MOST_WARNINGS]:
        lines += _wrapped(f"warning: {text}", letters)
    hidden = len(warnings) - _MOST_WARNINGS
    return lines + [f"and {hidden} more warning{'s' * (hidden > 1)}"] * (hidden > 0)


def _wrapped(text: str, letters: int) -> list[str]:
    """A text in at most two lines."""
    return textwrap.wrap(figures.printable(text), letters, max_lines=_MOST_LINES, placeholder=" ...")


def _draw_cloud(axes: Any, cloud: np.ndarray, amber: np.ndarray, a: int, b: int) -> None:
    """Grey dots, lighter where they are farther, some of them amber; smaller the more there are."""
    depth, toward = cloud[:, 3 - a - b], 1 if (a, b) != (0, 2) else -1  # x, y, z are right-handed
    order = np.argsort(toward * depth, kind="stable")
    near = np.linspace(0, 1, len(order))[:, None]
    color = np.where(amber[order, None], _AMBER_DOT, _FAR_DOT + near * (_NEAR_DOT - _FAR_DOT))
    area = np.clip(_DOT_INK / max(len(cloud), 1), *_DOT_AREA)
    axes.scatter(cloud[order, a], cloud[order, b], c=color, s=area, linewidths=0, clip_on=False)


def _draw_curve(axes: Any, skeleton: Skeleton, vertices: np.ndarray, color: str) -> None:
    """Edges between vertices, (n, 2) float array, with dots at junctions, leaves and detached vertices."""
    from matplotlib.collections import LineCollection

    style = dict(capstyle="round", clip_on=False)
    axes.add_collection(LineCollection(vertices[skeleton.edges], colors=color, linewidths=1.3, **style))
    dots = [(skeleton.degree == 0, color, color)]
    if len(skeleton.branches) <= _MOST_DOTTED:
        dots += [(skeleton.degree == 1, PAPER, color), (skeleton.degree > 2, INK, INK)]
    for chosen, face, edge in dots:
        style = dict(s=8, linewidths=0.8, facecolors=face, edgecolors=edge, zorder=3, clip_on=False)
        axes.scatter(*vertices[chosen].T, **style)


def _mark_doubts(axes: Any, report: Report, centre: np.ndarray, unit: float, across_up: list[int]) -> None:
    """Amber rings around what few samples show, crosses where many show what the skeleton lacks, with their share."""
    for part in report.unsupported[:_MOST_MARKS]:
        x, y = (np.subtract(part.place, centre) / unit)[across_up]
        ring, cross = dict(marker="o", facecolors="none", edgecolors=_AMBER), dict(marker="x", c=_AMBER)
        axes.scatter(x, y, s=70, linewidths=1, zorder=5, clip_on=False, **(ring if part.present else cross))
        note = f"{round(part.share * report.n_draws)}/{report.n_draws}"
        axes.annotate(note, (x, y), (6, 4), textcoords="offset points", color=_AMBER, fontsize=6, annotation_clip=False)
