"""Colours for the parts of a skeleton and of its cloud."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

from ..errors import InvalidParameterError
from ..interop.packages import require

if TYPE_CHECKING:
    from ..skeleton import Skeleton

ColorChoice: TypeAlias = Literal["branch", "radius", "confidence"] | Sequence[float]
"""What colours show, or one colour for all: red, green and blue from 0 to 1."""

UNKNOWN_GREY = (0.6, 0.6, 0.6)
COLOR_NAMES = ("branch", "radius", "confidence")


def shades(skeleton: Skeleton, color: ColorChoice, branch: np.ndarray, vertices: np.ndarray) -> np.ndarray:
    """Colours of things that belong to branches and vertices.

    Parameters
    ----------
    skeleton : Skeleton
    color : {"branch", "radius", "confidence"} or three floats in [0, 1]
        Branches have 18 colours in turn; radii go from dark blue, the least of the skeleton, to yellow, the largest;
        confidences from 0 to 1 likewise. Or one colour for all: red, green, blue.
    branch : (n,) int array
        -1 for none: grey.
    vertices : (n,) or (n, k) int array
        Each thing has the mean value of so many vertices; -1 for none: grey.

    Returns
    -------
    (n, 3) float array
        Red, green and blue from 0 to 1.

    Raises
    ------
    InvalidParameterError
    MissingPackageError
        matplotlib is not installed, and asked for is not one colour for all.
    """
    if not isinstance(color, str) or color not in COLOR_NAMES:
        try:
            one = np.asarray(color, float)
        except (TypeError, ValueError):
            one = np.empty(0)
        if one.shape != (3,) or not ((one >= 0) & (one <= 1)).all():
            raise InvalidParameterError(f"color = {color!r}: must be one of {COLOR_NAMES} or three numbers from 0 to 1")
        return np.tile(one, (len(branch), 1))
    colormaps = require("matplotlib").colormaps
    if color == "branch":
        palette = np.delete(colormaps["tab20"].colors, [14, 15], axis=0)  # grey is for none
        palette = np.concatenate([palette[::2], palette[1::2]])  # the strong ones first
        return np.where((branch >= 0)[:, None], palette[branch % len(palette)], UNKNOWN_GREY)
    if color == "radius":
        low, high = np.nanmin(skeleton.radii, initial=np.inf), np.nanmax(skeleton.radii, initial=-np.inf)
        values = (skeleton.radii - low) / (high - low) if high > low else np.where(np.isnan(skeleton.radii), np.nan, 0)
    else:
        values = skeleton.confidence
    vertices = vertices if vertices.ndim == 2 else vertices[:, None]
    shown = np.where((vertices >= 0).all(axis=1), values[vertices].mean(axis=1), np.nan)
    return np.where(np.isnan(shown)[:, None], UNKNOWN_GREY, colormaps["viridis"](np.nan_to_num(shown))[:, :3])
