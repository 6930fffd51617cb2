"""What all pictures share: a figure, three views of an object in it, a colour bar, and its file."""

import os
from collections.abc import Iterator
from typing import Any

import numpy as np

from ..interop.atomic import write_atomically
from ..interop.packages import require

DPI = 150
INK, PAPER = "#333333", "white"
MOST_DRAWN_POINTS = 20_000

# All fitted to the eye; lengths in inches.
VIEW_GAP, VIEW_NAME = 0.3, 0.28  # between views at least; below each, for the names of its axes
SMALLEST_PICTURE, LARGEST_PICTURE = (6.0, 3.0), (12.0, 8.0)  # width and height of one that is cut to its object
LONGEST_BAR, ABOVE_VIEWS = 0.9, 0.12  # of the scale, which stands so far above the views
WORTH_A_CHANGE = 1.2  # how much larger views must be in several rows than in one
THINNEST = 0.08  # of an extent, over the largest: flat things have room for the width of their lines
_ARRANGEMENTS = (  # rows of views, each by the coordinates that go across and up; the usual one first
    (((0, 2), (1, 2), (0, 1)),),
    (((0, 2), (1, 2)), ((0, 1),)),
    (((0, 2),), ((1, 2),), ((0, 1),)),
)


def new_figure(size: Any) -> Any:
    """A white figure of so many inches, on a canvas of its own: pyplot and its global state stay out of it."""
    require("matplotlib")
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(size, facecolor=PAPER)
    FigureCanvasAgg(figure)
    return figure


def save_figure(figure: Any, path: str | os.PathLike[str]) -> None:
    """Write a figure as PNG, without the version of matplotlib; it appears complete or not at all."""
    options = {"format": "png", "dpi": DPI, "metadata": {"Software": None}}
    write_atomically(path, lambda temporary: figure.savefig(temporary, **options))


def printable(text: object) -> str:
    """A text that may be a file name, which may be no Unicode, as one that can be drawn and encoded."""
    return str(text).encode("utf-8", "replace").decode()


def thinned(points: np.ndarray, most: int) -> np.ndarray:
    """At most so many of the finite points, drawn at random but always the same: their indices, ascending."""
    finite = np.flatnonzero(np.isfinite(points).all(axis=1))
    if len(finite) <= most:
        return finite
    return np.sort(np.random.default_rng(0).choice(finite, most, replace=False))


def room(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Middle and size, (3,) float arrays, of the box of points, (n, 3) float array, that is drawn.

    matplotlib's transforms lose digits unless the middle is taken off.
    """
    low, high = (points.min(axis=0), points.max(axis=0)) if len(points) else np.zeros((2, 3))
    return low + (high - low) / 2, np.maximum(high - low, THINNEST * (high - low).max() or 1.0)


def fitting_size(extent: np.ndarray, *, head: float, foot: float) -> np.ndarray:
    """Width and height in inches of a picture that three views of such an extent fill; see `three_views`."""
    _, _, size = _arrange(extent, np.subtract(LARGEST_PICTURE, [0, head + foot]))
    return np.clip(size + [0, head + foot], SMALLEST_PICTURE, LARGEST_PICTURE)


def three_views(figure: Any, extent: np.ndarray, *, head: float, foot: float) -> Iterator[tuple[int, int, Any]]:
    """Axes for the views from the front, the side and above, all at one scale, with the names of their axes below each.

    A bar of a round length, in the units of the coordinates, stands above the first one. They are side by side, or
    where they are larger so, two above one or one above the other. What is drawn is around the origin, of this extent,
    (3,) float array; head and foot are the room above and below in inches. Gives the coordinates that are drawn, across
    and up, and their axes.
    """
    whole = figure.get_size_inches()
    free = whole - [0, head + foot]
    rows, scale, used = _arrange(extent, free)
    spare = free - used
    base = whole[1] - head - spare[1] / 2
    gap = VIEW_GAP + spare[0] / (max(map(len, rows)) + 1)
    _scale_bar(figure, scale, gap, base + ABOVE_VIEWS)
    for row in rows:
        tallest = scale * max(extent[b] for _, b in row)
        base, x = base - tallest, gap
        for a, b in row:
            size = scale * extent[[a, b]]
            axes = figure.add_axes([*([x, base + (tallest - size[1]) / 2] / whole), *(size / whole)])
            axes.set_axis_off()
            axes.set(xlim=extent[a] * np.array([-0.5, 0.5]), ylim=extent[b] * np.array([-0.5, 0.5]))
            yield a, b, axes
            name = f"{'xyz'[a]}\N{RIGHTWARDS ARROW} {'xyz'[b]}\N{UPWARDS ARROW}"
            place = [x + size[0] / 2, base - 0.8 * VIEW_NAME] / whole
            figure.text(*place, name, ha="center", color="#999999", fontsize=7)
            x += size[0] + gap
        base -= VIEW_NAME


def _scale_bar(figure: Any, scale: float, x: float, y: float) -> None:
    """A bar as long as some round number, with the number: of so many inches per unit, and at a place in inches."""
    from matplotlib.lines import Line2D
    from matplotlib.ticker import MaxNLocator

    length = MaxNLocator(2, steps=[1, 2, 5, 10]).tick_values(0, LONGEST_BAR / scale)[1]
    ends, inches = [x, x + scale * length], {"transform": figure.dpi_scale_trans, "color": INK}
    figure.add_artist(Line2D(ends, [y, y], marker="|", markersize=5, linewidth=0.9, **inches))
    figure.text(ends[1] + 0.08, y, f"{length:g}", va="center_baseline", fontsize=7, **inches)


def _arrange(extent: np.ndarray, free: np.ndarray) -> tuple[Any, float, np.ndarray]:
    """The rows of views that are largest, one row unless others are much larger; inches per unit, and size in inches.

    The size is that of the views, the gaps beside them and the names below.
    """
    layouts = []
    for rows in _ARRANGEMENTS:
        across = max(sum(extent[a] for a, _ in row) for row in rows)
        up = sum(max(extent[b] for _, b in row) for row in rows)
        beside = np.array([VIEW_GAP * (max(map(len, rows)) + 1), VIEW_NAME * len(rows)])
        scale = min((free - beside) / [across, up])
        layouts.append((rows, scale, scale * np.array([across, up]) + beside))
    best = max(layouts, key=lambda layout: layout[1])
    return best if best[1] > WORTH_A_CHANGE * layouts[0][1] else layouts[0]
