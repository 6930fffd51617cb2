"""A picture of a skeleton in its cloud, coloured by a measure."""

from __future__ import annotations

import dataclasses
import os
from typing import TYPE_CHECKING

import numpy as np

from ..errors import InvalidParameterError
from ..interop.atomic import check_ending
from . import preview

if TYPE_CHECKING:
    from ..skeleton import Skeleton

_BAR = (1.7, 0.09)  # width and height of the colour bar, in inches
_CORNER = (0.3, 0.2)  # from the upper right corner of the picture to that of the bar, in inches


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
        One per edge, shown from 0 to 1; those outside have the colour of the nearer end, and NaN is drawn in black.
    path : path-like
        PNG; it appears complete or not at all.
    label : str
        What the values are, on the colour bar.
    best : {0, 1}
        The good end of the scale, dark blue; the bad one is orange.
    unknown : str
        What NaN means, below the colour bar if there is any.
    size : (width, height)
        In pixels.
    title : str, optional
        Above the views.

    Raises
    ------
    InvalidParameterError
        There is not one value per edge.
    FileFormatError
        The ending is not ``.png``.
    MissingPackageError
        matplotlib is not installed.
    OSError
        The folder does not exist, or the file cannot be written.

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
    shown = dataclasses.replace(skeleton, points=points, vertex_of_point=np.empty(0), normals=np.empty(0))
    figure = preview.draw(shown, size, title)
    _colour(figure, values, label, best, unknown)
    preview.save_figure(figure, path)


def _colour(figure, values, label, best, unknown):
    from matplotlib import colormaps  # it is there: the figure was drawn with it
    from matplotlib.cm import ScalarMappable
    from matplotlib.collections import LineCollection
    from matplotlib.colors import ListedColormap, Normalize

    shades = colormaps["plasma"](np.linspace(0, 0.8, 256))  # its last fifth is too light for thin lines on white
    shades = ListedColormap(shades[::-1] if best else shades).with_extremes(bad=preview.INK)
    scale = ScalarMappable(Normalize(0, 1, clip=True), shades)
    for axes in figure.axes:
        for drawn in axes.collections[1:]:  # the first is the cloud
            if isinstance(drawn, LineCollection):
                drawn.set(color=scale.to_rgba(np.ma.masked_invalid(values)), linewidths=2)
            else:
                drawn.set_edgecolor(preview.INK)
    width, height = figure.get_size_inches()
    box = [width - _CORNER[0] - _BAR[0], height - _CORNER[1] - _BAR[1], *_BAR]
    preview.colour_bar(figure, scale, np.divide(box, [width, height] * 2), [0, 0.5, 1])
    middle = (box[1] + _BAR[1] / 2) / height
    figure.text((box[0] - 0.1) / width, middle, label, ha="right", va="center_baseline", color=preview.INK, fontsize=8)
    if np.isnan(values).any():
        right, below = (width - _CORNER[0]) / width, (box[1] - 0.3) / height
        figure.text(right, below, f"black: {unknown}", ha="right", va="top", color=preview.INK, fontsize=7)
