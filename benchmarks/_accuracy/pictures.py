"""The pictures of docs/accuracy.md."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
from _common.plots import BLUE, INK, LOOKS, keep, look, plain_log, sheet
from _common.results import pick, summary

from .ideas import losses
from .known_axes import random_shapes, share
from .measuring import by_pipeline, by_variant
from .solves import stops


def draw_truth(rows: list[dict], folder: Path) -> Path:
    """Error and right topologies of the pipelines, variant by variant, with the intervals of these."""
    rows = random_shapes(rows)
    variants, names = by_variant(rows), list(by_pipeline(rows))
    places = np.arange(len(variants))
    groups = {name: [pick(group, pipeline=name) for group in variants.values()] for name in names}
    figure, (left, right) = sheet(1.0 + 0.33 * len(variants), columns=2, sharey=True, width_ratios=(3, 2))
    for axes in (left, right):
        axes.hlines(places, 0, 1, transform=axes.get_yaxis_transform(), color="#e4e4e4", linewidth=0.8, zorder=0)
        axes.tick_params(axis="y", length=0)
    for i, name in reversed(list(enumerate(names))):  # the first on top
        style = dict(linestyle="", markersize=6, label=name, **look(name))
        beside = places + 0.16 * (i - (len(names) - 1) / 2)  # so that no interval hides another
        left.plot([summary(group)["error"] for group in groups[name]], places, **style)
        means, low, high = np.transpose([share(group, "topology") for group in groups[name]])
        right.hlines(beside, low, high, color=style["color"], linewidth=1.5)
        right.plot(means, beside, **style | dict(markersize=4))
    left.set(xlabel="mean error, local radii", xlim=(0, None), ylim=(len(variants) - 0.5, -0.5))
    left.set_yticks(places, list(variants))
    right.set(xlabel="right topologies", xlim=(0, 1.05))
    shown, labels = (each[::-1] for each in left.get_legend_handles_labels())
    figure.legend(shown, labels, loc="outside upper center", ncols=len(names), frameon=False)
    return keep(figure, folder, "accuracy_clouds")


def draw_ablation(rows: list[dict], folder: Path) -> Path:
    """What is lost without each idea: how much more error, how many shapes."""
    mean, ideas = losses(rows)
    whole = mean["default"]
    rise = [100 * (mean[name]["error"] / whole["error"] - 1) for name in ideas]
    lost = [whole["right"] - mean[name]["right"] for name in ideas]
    figure, both = sheet(0.9 + 0.23 * len(ideas), columns=2, sharey=True, width_ratios=(3, 2))
    titles = ("error rises by %", f"right topologies\nlost, of {whole['right']}")
    for axes, title, values in zip(both, titles, (rise, lost), strict=True):
        bars = axes.barh(range(len(ideas)), values, color=BLUE)
        words = [f"{value:.0f}".replace("-0", "0").replace("-", "\N{MINUS SIGN}") for value in values]
        axes.bar_label(bars, words, padding=3, fontsize=8)
        axes.axvline(0, color=INK, linewidth=0.8)
        axes.set_title(title, fontsize=10)
        axes.set_xticks([])
        axes.margins(x=0.18, y=0.01)
        axes.spines[["left", "bottom"]].set_visible(False)
        axes.tick_params(axis="y", length=0)
    both[0].set_yticks(range(len(ideas)), ideas, fontsize=9)
    both[0].invert_yaxis()
    return keep(figure, folder, "accuracy_ideas")


def draw_stop(rows: list[dict], folder: Path) -> Path:
    """The error over the number of solves, with rings where the rule stops."""
    figure, axes = sheet(3.2)
    styles = itertools.cycle(LOOKS.values())
    for (name, group), style in zip(by_variant(rows).items(), styles, strict=False):
        means = {int(label): summary(here) for label, here in by_pipeline(group).items() if label != "rule"}
        axes.plot(list(means), [mean["error"] for mean in means.values()], markersize=4, label=name, **style)
        for n, count in stops(group).items():
            if n in means:
                place, words = (n, means[n]["error"]), f"{count} of {means[n]['n']}"
                axes.plot(*place, "o", markersize=11, markerfacecolor="none", color=INK)
                axes.annotate(words, place, (0, 10), textcoords="offset points", ha="center", fontsize=9)
    axes.set(xlabel="solves; rings: the rule stops here", ylabel="mean error, local radii", yscale="log")
    plain_log(axes.yaxis)
    axes.legend(frameon=False)
    return keep(figure, folder, "accuracy_solves")
