"""What pictures and pages share: a figure and its file, texts, counts, and a sample of the points."""

import os
from typing import Any

import numpy as np

from ..analysis.summary import point_count, structure
from ..data.skeleton import Skeleton
from ..interop.atomic import write_atomically
from ..interop.packages import require

DPI = 150
INK, PAPER = "#333333", "white"
MOST_DRAWN_POINTS = 20_000


def new_figure(size: Any, layout: str | None = None) -> Any:
    """A white figure of so many inches, on a canvas of its own: pyplot and its global state stay out of it."""
    require("matplotlib")
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(size, facecolor=PAPER, layout=layout)
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


def counts(skeleton: Skeleton) -> dict[str, str]:
    """The counts of a skeleton and its length, as people read them; of a cloud alone its points."""
    facts = {"points": point_count(skeleton), **(structure(skeleton) if len(skeleton.vertices) else {})}
    return {
        name.replace("_", " "): f"{value:.4g}" if name == "length" else f"{value:,}" for name, value in facts.items()
    }
