"""The picture of what probabilities mean."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from _common.plots import BLUE, GREY, keep, sheet

from .fitting import Answered
from .reliability import QUESTIONS, parts


def draw_reliability(told_of: Mapping[str, tuple[np.ndarray, Answered]], folder: Path) -> Path:
    """How often it is so over the probability that was said, a panel for each kind of question, with counts."""
    figure, panels = sheet(5.4, rows=2, columns=2, sharex=True, sharey=True)
    for axes, (about, question) in zip(panels.ravel(), QUESTIONS.items(), strict=True):
        axes.plot([0, 1], [0, 1], color=GREY, linewidth=0.8, zorder=0)
        axes.set_title(question, fontsize=9)
        axes.set(xlim=(-0.03, 1.03), ylim=(-0.03, 1.03), aspect="equal")
        for count, mean, (often, low, high) in parts(*told_of[about]) if about in told_of else ():
            axes.vlines(mean, low, high, color=BLUE, linewidth=1.5)
            axes.plot(mean, often, "o", color=BLUE, markersize=5)
            right = mean < 0.8  # of the dot, or there is no room
            style = dict(textcoords="offset points", fontsize=7, color=GREY, va="center")
            axes.annotate(str(count), (mean, often), (6 if right else -6, 0), ha="left" if right else "right", **style)
    figure.supxlabel("probability that was said", fontsize=9)
    figure.supylabel("how often it was so", fontsize=9)
    return keep(figure, folder, "probabilities")
