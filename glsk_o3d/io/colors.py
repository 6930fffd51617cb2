"""Colours for the parts of a skeleton and of its cloud."""

from collections.abc import Sequence
from typing import Literal, TypeAlias

import numpy as np

from ..analysis.branches import branch_table
from ..data.skeleton import Skeleton, as_color
from ..interop.packages import require

ColorChoice: TypeAlias = Literal["branch", "order", "radius", "confidence", "support"] | Sequence[float]
"""What colours show, or one colour for all: red, green and blue from 0 to 1."""

UNKNOWN_GREY = (0.6, 0.6, 0.6)
COLOR_NAMES = ("branch", "order", "radius", "confidence", "support")


def shades(skeleton: Skeleton, color: ColorChoice, branch: np.ndarray, vertices: np.ndarray) -> np.ndarray:
    """Colours, (n, 3) float array from 0 to 1, of things that each belong to a branch and to one or k vertices.

    Branches have 18 colours in turn. All else goes from dark blue to yellow: orders of the branches, as in the table of
    them, from 0 to the highest of the skeleton; radii from the least to the largest; confidences and support from 0 to
    1. Each thing has the mean of its vertices; where `branch` or one of `vertices` is -1, it is grey.
    """
    if not isinstance(color, str) or color not in COLOR_NAMES:
        return np.tile(as_color(color, f"must be one of {COLOR_NAMES} or three numbers from 0 to 1"), (len(branch), 1))
    if color == "branch":
        palette = np.delete(require("matplotlib").colormaps["tab20"].colors, [14, 15], axis=0)  # grey is for none
        palette = np.concatenate([palette[::2], palette[1::2]])  # the strong ones first
        return np.where((branch >= 0)[:, None], palette[branch % len(palette)], UNKNOWN_GREY)
    if color == "order":
        order = branch_table(skeleton).order if len(branch) else np.zeros(1, int)
        return ramp(np.where(branch >= 0, order[branch] / max(order.max(), 1), np.nan))
    vertices = vertices if vertices.ndim == 2 else vertices[:, None]
    values = skeleton.support if color == "support" else skeleton.confidence
    if color == "radius":
        radii = skeleton.radii
        low, high = np.nanmin(radii, initial=np.inf), np.nanmax(radii, initial=-np.inf)
        values = (radii - low) / (high - low) if high > low else np.where(np.isnan(radii), np.nan, 0)
    return ramp(np.where((vertices >= 0).all(axis=1), values[vertices].mean(axis=1), np.nan))


def ramp(values: np.ndarray) -> np.ndarray:
    """Colours of numbers from 0 to 1; what is beyond has that of the end, NaN is grey."""
    viridis = require("matplotlib").colormaps["viridis"]
    return np.where(np.isnan(values)[:, None], UNKNOWN_GREY, viridis(np.nan_to_num(values))[:, :3])
