"""A picture of a cross-check: the cloud coloured by how far it and a mesh disagree, with both skeletons."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import numpy as np

from ..interop.atomic import check_ending
from ..viewing import figures

if TYPE_CHECKING:
    from .check import CrossCheck

_OURS, _THEIRS, _UNKNOWN = "#111111", "#0a6fc2", "#c9c9c9"

# All fitted to the eye.
_MOST_REASONS = 3  # lines of text
_MOST_DEGREES = 60.0  # at which the colours end
_HEAD_ROOM, _FOOT_ROOM = 0.95, 0.57  # inches above and below the three views


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

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> from glsk_o3d.crosscheck import cross_check
    >>> from glsk_o3d.samples import torus
    >>> with TemporaryDirectory() as folder:
    ...     save_crosscheck_picture(cross_check(torus(2000).points), f"{folder}/where.png")
    ...     Path(folder, "where.png").stat().st_size > 10_000
    True
    """
    check_ending(path, "picture is a PNG", ".png")
    figures.save_figure(_draw(check, size, title), path)


def _draw(check, size, title):
    figure = figures.new_figure(size)
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.collections import LineCollection
    from matplotlib.colors import Normalize, to_rgba

    shown = figures.thinned(check.points, figures.MOST_DRAWN_POINTS)
    shown = shown[np.argsort(np.nan_to_num(check.angle[shown], nan=-1), kind="stable")]  # the worst lie on top
    points, angle = check.points[shown], check.angle[shown]
    both = [points, check.skeleton.vertices, check.mesh_skeleton.vertices]  # they may differ widely
    centre, extent = figures.room(np.concatenate(both))
    scale = ScalarMappable(Normalize(0, _MOST_DEGREES, clip=True), colormaps["YlOrRd"])
    colours = np.where(np.isnan(angle)[:, None], to_rgba(_UNKNOWN), scale.to_rgba(np.nan_to_num(angle)))
    dot = float(np.clip(16000 / max(len(points), 1), 2, 6))
    for a, b, axes in figures.three_views(figure, extent, head=_HEAD_ROOM, foot=_FOOT_ROOM):
        axes.scatter(*(points - centre)[:, [a, b]].T, s=dot, c=colours, linewidths=0, clip_on=False)
        for skeleton, colour, line in ((check.mesh_skeleton, _THEIRS, 2.6), (check.skeleton, _OURS, 1.2)):
            places = (skeleton.vertices - centre)[:, [a, b]]
            for paint, wider in (("white", 1.4), (colour, 0)):  # a white edge lifts it off the cloud
                style = dict(colors=paint, linewidths=line + wider, capstyle="round", clip_on=False)
                axes.add_collection(LineCollection(places[skeleton.edges], **style))
            alone = skeleton.degree == 0
            axes.scatter(*places[alone].T, s=16, c=colour, linewidths=0, zorder=3, clip_on=False)
    height = figure.get_figheight()
    _write(figure, check, title, height)
    box = [0.42, 0.3 / height, 0.16, 0.09 / height]
    figures.colour_bar(figure, scale, box, [0, 30, 60], ["0", "30", "60\N{DEGREE SIGN} and more"])
    return figure


def _write(figure, check, title, height):
    """The verdict and its reasons above the views, and below them what the colours are."""
    reasons = [*check.reasons[:_MOST_REASONS]]
    if len(check.reasons) > _MOST_REASONS:
        reasons[-1] += f"; and {len(check.reasons) - _MOST_REASONS} more"
    style = dict(ha="center", color=figures.INK, parse_math=False)
    head = f"{figures.printable(title)}: {check.verdict}" if title else check.verdict
    figure.text(0.5, 1 - 0.33 / height, head, fontsize=12, **style)
    for row, reason in enumerate(reasons):
        figure.text(0.5, 1 - (0.55 + 0.16 * row) / height, reason, fontsize=7.5, **style)
    style = dict(y=0.34 / height, va="center_baseline", fontsize=8)
    figure.text(0.41, s="angle between the Laplacian coordinates", ha="right", color=figures.INK, **style)
    if np.isnan(check.angle).any():
        figure.text(0.625, s="not compared", color="#999999", **style)
    figure.text(0.70, s="skeleton of the cloud", color=_OURS, **style)
    figure.text(0.81, s="of the mesh", color=_THEIRS, **style)
