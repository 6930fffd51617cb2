"""Whether what has some probability is so as often."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from _common.tables import Table, Tables, number
from glsk_bench.table import mean_with_interval, told
from scipy.stats import rankdata

from .fitting import Answered, fitted, said

PARTS = 5  # of the range of probabilities, of the same width
SURE = 1e-9  # a probability is taken to be as far from 0 and 1, or one mistake would make the loss infinite
QUESTIONS = {
    "loop": "a loop is a handle",
    "air": "a branch crosses air",
    "gap": "the object goes on across a gap",
    "limb": "a branch is a limb",
}


def log_loss(chance: np.ndarray, is_so: np.ndarray) -> float:
    """Mean of minus the logarithm of the probability of what is so, in nats."""
    chance = np.clip(chance, SURE, 1 - SURE)
    return float(-np.log(np.where(is_so, chance, 1 - chance)).mean())


def area_under_curve(chance: np.ndarray, is_so: np.ndarray) -> float:
    """The share of pairs, of one that is so and one that is not, in which that has the larger probability; ties half.

    NaN without such pairs.
    """
    n, m = np.count_nonzero(is_so), np.count_nonzero(~is_so)
    return (rankdata(chance)[is_so].sum() - n * (n + 1) / 2) / (n * m) if n and m else np.nan


def parts(chance: np.ndarray, answered: Answered) -> list[tuple[int, float, tuple[float, float, float]]]:
    """Of every part of the range that is not empty: the count, the mean probability, and how often it is so."""
    part, found = np.minimum((chance * PARTS).astype(int), PARTS - 1), []
    for k in np.unique(part):
        here = part == k
        often = mean_with_interval(answered.shapes[here].tolist(), answered.is_so[here].tolist())
        found.append((int(here.sum()), float(chance[here].mean()), often))
    return found


def overview(told_of: Mapping[str, tuple[np.ndarray, Answered]]) -> Table:
    """A line for each kind of question."""
    lines = []
    for about, (chance, answered) in told_of.items():
        is_so = answered.is_so
        counts = [
            str(len(is_so)),
            number(is_so.mean()),
            number(chance.mean()),
            number(((chance >= 0.5) == is_so).mean()),
        ]
        losses = [number(log_loss(chance, is_so)), number(log_loss(np.full(len(is_so), is_so.mean()), is_so))]
        lines.append([QUESTIONS[about], *counts, *losses, number(area_under_curve(chance, is_so))])
    header = ["the question", "asked", "so", "said", "right at .5", "log loss", "of the share", "AUC"]
    return "by question", header, lines


def reliability(told_of: Mapping[str, tuple[np.ndarray, Answered]]) -> Table:
    """What is said and how often it is so, with intervals, by parts of the range."""
    lines = []
    for about, (chance, answered) in told_of.items():
        for place, (count, mean, often) in enumerate(parts(chance, answered)):
            lines.append([QUESTIONS[about] * (place == 0), str(count), number(mean, 2), told(*often)])
    return "said, and so how often", ["the question", "asked", "said", "so"], lines


def families(told_of: Mapping[str, tuple[np.ndarray, Answered]]) -> Table:
    """How good what is said is family by family."""
    lines = []
    for about, (chance, answered) in told_of.items():
        for place, family in enumerate(dict.fromkeys(answered.families.tolist())):
            here = answered.families == family
            p, is_so = chance[here], answered.is_so[here]
            losses = [number(log_loss(p, is_so)), number(log_loss(np.full(len(p), is_so.mean()), is_so))]
            counts = [str(len(p)), number(is_so.mean()), number(p.mean())]
            lines.append(
                [QUESTIONS[about] * (place == 0), family, *counts, *losses, number(area_under_curve(p, is_so))]
            )
    return "by family", ["the question", "family", "asked", "so", "said", "log loss", "of the share", "AUC"], lines


def tables(told_of: Mapping[str, tuple[np.ndarray, Answered]]) -> Tables:
    """All three."""
    return [overview(told_of), reliability(told_of), families(told_of)]


def without_family(answered: Answered, learnt: Answered) -> np.ndarray:
    """What weights say of each family that were fitted without it, to other questions, (n,) float array."""
    chances = np.empty(len(answered.is_so))
    for family in np.unique(answered.families):
        here = answered.families == family
        chances[here] = said(fitted(learnt.of(learnt.families != family)), answered.of(here))
    return chances
