"""Where three views of an object go in a picture, so that they are as large as can be."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

# All fitted to the eye; lengths in inches.
VIEW_GAP, VIEW_NAME = 0.3, 0.28  # between views at least; below each, for the names of its axes
SMALLEST_PICTURE, LARGEST_PICTURE = (6.0, 3.0), (12.0, 8.0)  # width and height of one that is cut to its object
WORTH_A_CHANGE = 1.2  # how much larger views must be in several rows than in one
THINNEST = 0.08  # of an extent, over the largest: flat things have room for the width of their lines
_ARRANGEMENTS = (  # rows of views, each by the coordinates that go across and up; the usual one first
    (((0, 1), (0, 2), (1, 2)),),
    (((0, 2), (1, 2)), ((0, 1),)),
    (((0, 1),), ((0, 2),), ((1, 2),)),
)


class _Layout(NamedTuple):
    rows: tuple[tuple[tuple[int, int], ...], ...]
    scale: float  # inches per unit
    width: float  # inches of the views and the gaps beside them
    height: float  # inches of the views and their names


def room(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Middle and size, (3,) float arrays, of the box of points, (n, 3) float array, that is drawn.

    matplotlib's transforms lose digits unless the middle is taken off.
    """
    low, high = (points.min(axis=0), points.max(axis=0)) if len(points) else np.zeros((2, 3))
    return low + (high - low) / 2, np.maximum(high - low, THINNEST * (high - low).max() or 1.0)


def fitting_size(extent: np.ndarray, *, head: float, foot: float) -> np.ndarray:
    """Width and height in inches of a picture that three views of such an extent fill; see `three_views`."""
    free = np.subtract(LARGEST_PICTURE, [0, head + foot])
    found = _arrange(extent, *free)
    return np.clip([found.width, found.height + head + foot], SMALLEST_PICTURE, LARGEST_PICTURE)


def three_views(figure: Any, extent: np.ndarray, *, head: float, foot: float) -> Iterator[tuple[int, int, Any]]:
    """Axes for the views along the coordinate axes, all at one scale, with the names of their axes below each.

    They are side by side, or where they are larger so, two above one or one above the other. What is drawn is around
    the origin, of this extent, (3,) float array; head and foot are the room above and below in inches. Gives the
    coordinates that are drawn, across and up, and their axes.
    """
    width, height = figure.get_size_inches()
    found = _arrange(extent, width, height - head - foot)
    scale, base = found.scale, height - head - (height - head - foot - found.height) / 2
    columns = max(map(len, found.rows))
    gap = VIEW_GAP + (width - found.width) / (columns + 1)
    for row in found.rows:
        tallest = scale * max(extent[b] for _, b in row)
        base, left = base - tallest, gap
        for a, b in row:
            box = [left, base + (tallest - scale * extent[b]) / 2, scale * extent[a], scale * extent[b]]
            axes = figure.add_axes(np.divide(box, [width, height] * 2))
            axes.set_axis_off()
            axes.set(xlim=extent[a] * np.array([-0.5, 0.5]), ylim=extent[b] * np.array([-0.5, 0.5]))
            yield a, b, axes
            told = f"{'xyz'[a]}\N{RIGHTWARDS ARROW} {'xyz'[b]}\N{UPWARDS ARROW}"
            place = (left + box[2] / 2) / width, (base - 0.8 * VIEW_NAME) / height
            figure.text(*place, told, ha="center", color="#999999", fontsize=7)
            left += box[2] + gap
        base -= VIEW_NAME


def _arrange(extent: np.ndarray, width: float, height: float) -> _Layout:
    """The arrangement in which views are largest: one row, unless others are much larger."""
    found = []
    for rows in _ARRANGEMENTS:
        across = max(sum(extent[a] for a, _ in row) for row in rows)
        up = sum(max(extent[b] for _, b in row) for row in rows)
        gaps, names = VIEW_GAP * (max(map(len, rows)) + 1), VIEW_NAME * len(rows)
        scale = min((width - gaps) / across, (height - names) / up)
        found.append(_Layout(rows, scale, across * scale + gaps, up * scale + names))
    best = max(found, key=lambda layout: layout.scale)
    return best if best.scale > WORTH_A_CHANGE * found[0].scale else found[0]
