"""A picture of a cross-check: the cloud coloured by how far it and a mesh disagree, with both skeletons."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import numpy as np

from ..interop.files import check_ending, write_atomically
from ..interop.open3d import require
from ..interop.preview import DPI, INK, MOST_POINTS, printable

if TYPE_CHECKING:
    from .crosscheck import CrossCheck

_VIEWS = ((0, 1), (0, 2), (1, 2))
_OURS, _THEIRS, _UNKNOWN = "#111111", "#0a6fc2", "#c9c9c9"
_MOST_REASONS = 3
_MOST = 60.0  # degrees at which the colours end
_PAD, _HEAD, _FOOT = 0.3, 0.95, 0.85  # inches


def save_crosscheck_picture(
    check: CrossCheck, path: str | os.PathLike, *, size: tuple[int, int] = (1800, 860), title: str | None = None
) -> None:
    """Draw a cross-check from three sides into a PNG file.

    Points go from pale yellow, where the Laplacian coordinates of cloud and mesh have one direction, to dark red at 60
    degrees and more; grey ones could not be compared. The worst lie on top. The cloud's skeleton is black, that of the
    mesh blue.

    Parameters
    ----------
    check : CrossCheck
    path : path-like
        PNG; it appears complete or not at all.
    size : (width, height)
        In pixels.
    title : str, optional
        Ahead of the verdict.

    Raises
    ------
    FileFormatError
        The ending is not ``.png``.
    MissingPackageError
        matplotlib is not installed.
    OSError
        The folder does not exist, or the file cannot be written.
    """
    check_ending(path, "picture is a PNG", ".png")
    figure = _draw(check, np.asarray(size) / DPI, title)
    write_atomically(path, lambda temporary: figure.savefig(temporary, format="png", dpi=DPI))


def _draw(check, size, title):
    require("matplotlib")
    from matplotlib import colormaps
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.cm import ScalarMappable
    from matplotlib.collections import LineCollection
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure

    width, height = size
    figure = Figure((width, height), facecolor="white")
    FigureCanvasAgg(figure)
    scale = ScalarMappable(Normalize(0, _MOST, clip=True), colormaps["YlOrRd"])
    points, angle = _shown(check)
    shown = np.concatenate([points, check.skeleton.vertices, check.mesh_skeleton.vertices])  # they may differ widely
    low, high = shown.min(axis=0), shown.max(axis=0)
    centre, extent = low + (high - low) / 2, np.maximum(high - low, 0.08 * (high - low).max())
    points = points - centre  # small numbers: matplotlib's transforms lose digits
    colours = np.where(np.isnan(angle)[:, None], _rgba(_UNKNOWN), scale.to_rgba(np.nan_to_num(angle)))
    across, up = np.array([extent[[a, b]] for a, b in _VIEWS]).T
    unit = min((width - 4 * _PAD) / across.sum(), (height - _HEAD - _FOOT) / up.max())
    gap = (width - unit * across.sum()) / 4
    left, middle = gap, _FOOT + (height - _HEAD - _FOOT) / 2
    for a, b in _VIEWS:
        box = [left, middle - unit * extent[b] / 2, unit * extent[a], unit * extent[b]]
        axes = figure.add_axes(np.divide(box, [width, height] * 2))
        axes.set_axis_off()
        axes.set(xlim=extent[a] * np.array([-0.5, 0.5]), ylim=extent[b] * np.array([-0.5, 0.5]))
        dot = float(np.clip(16000 / max(len(points), 1), 2, 6))
        axes.scatter(points[:, a], points[:, b], s=dot, c=colours, linewidths=0, clip_on=False)
        for skeleton, colour, line in ((check.mesh_skeleton, _THEIRS, 2.6), (check.skeleton, _OURS, 1.2)):
            places = (skeleton.vertices - centre)[:, [a, b]]
            for paint, wider in (("white", 1.4), (colour, 0)):  # a white edge lifts it off the cloud
                style = dict(colors=paint, linewidths=line + wider, capstyle="round", clip_on=False)
                axes.add_collection(LineCollection(places[skeleton.edges], **style))
            alone = skeleton.degree == 0
            axes.scatter(*places[alone].T, s=16, c=colour, linewidths=0, zorder=3, clip_on=False)
        names = f"{'xyz'[a]}\N{RIGHTWARDS ARROW} {'xyz'[b]}\N{UPWARDS ARROW}"
        figure.text((left + box[2] / 2) / width, 0.62 / height, names, ha="center", color="#999999", fontsize=7)
        left += box[2] + gap
    _write(figure, check, title, height)
    bar = figure.colorbar(
        scale, cax=figure.add_axes([0.42, 0.3 / height, 0.16, 0.09 / height]), orientation="horizontal"
    )
    bar.set_ticks([0, 30, 60], labels=["0", "30", "60\N{DEGREE SIGN} and more"])
    bar.outline.set_visible(False)
    bar.ax.tick_params(length=0, pad=2, labelsize=7, labelcolor=INK)
    return figure


def _shown(check):
    """Finite points and their angles, those that cannot be compared first and the worst last."""
    finite = np.flatnonzero(np.isfinite(check.points).all(axis=1))
    finite = finite[:: max(1, -(-len(finite) // MOST_POINTS))]
    order = finite[np.argsort(np.nan_to_num(check.angle[finite], nan=-1), kind="stable")]
    return check.points[order], check.angle[order]


def _write(figure, check, title, height):
    head = f"{printable(title)}: {check.verdict}" if title else check.verdict
    style = dict(ha="center", color=INK, parse_math=False)
    figure.text(0.5, 1 - 0.33 / height, head, fontsize=12, **style)
    reasons = [*check.reasons[:_MOST_REASONS]]
    if len(check.reasons) > _MOST_REASONS:
        reasons[-1] += f"; and {len(check.reasons) - _MOST_REASONS} more"
    for row, reason in enumerate(reasons):
        figure.text(0.5, 1 - (0.55 + 0.16 * row) / height, reason, fontsize=7.5, **style)
    beside = dict(va="center_baseline", fontsize=8)
    level = 0.34 / height
    figure.text(0.41, level, "angle between the Laplacian coordinates", ha="right", color=INK, **beside)
    grey = "not compared" if np.isnan(check.angle).any() else ""
    figure.text(0.625, level, grey, color="#999999", **beside)
    figure.text(0.70, level, "skeleton of the cloud", color=_OURS, **beside)
    figure.text(0.81, level, "of the mesh", color=_THEIRS, **beside)


def _rgba(colour):
    from matplotlib.colors import to_rgba

    return to_rgba(colour)
