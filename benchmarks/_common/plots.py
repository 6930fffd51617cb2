"""How the pictures of the benchmarks look: narrow enough for a telephone, each pipeline in its colour and mark."""

from __future__ import annotations

from pathlib import Path

from glsk_o3d.viewing.figures import INK, save_figure

GREY, ORANGE, BLUE = "#777777", "#d95f02", "#1f4e9c"  # told apart by who sees no red or no green, and in print
LOOKS = {"default": dict(color=BLUE, marker="o"), "wen2024": dict(color=ORANGE, marker="^")}
LOOKS |= {"cao2010": dict(color=GREY, marker="s")}
WIDTH = 5.0  # inches


def look(name: str) -> dict:
    """Colour and mark of a pipeline."""
    return LOOKS.get(name, dict(color=INK, marker="D"))


def sheet(height: float, rows: int = 1, columns: int = 1, width: float = WIDTH, **options):
    """A figure and its axes, without frames; sizes in inches, options as for ``Figure.subplots``."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure((width, height), layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    axes = figure.subplots(rows, columns, **options)
    for each in figure.axes:
        each.spines[["top", "right"]].set_visible(False)
    return figure, axes


def plain_log(axis) -> None:
    """Ticks of a logarithmic axis at 1, 2 and 5, in plain numbers."""
    from matplotlib.ticker import LogLocator, NullLocator

    axis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_locator(NullLocator())


def keep(figure, folder: Path, name: str) -> Path:
    """Write NAME.png into the folder; gives its path."""
    path = folder / f"{name}.png"
    save_figure(figure, path)
    return path
