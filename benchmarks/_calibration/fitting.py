"""Logistic models, fitted to questions whose answers are known."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize
from scipy.special import expit

from glsk_o3d.refinement import scores

WEIGHTS = {"loop": "HANDLE_WEIGHTS", "air": "AIR_WEIGHTS", "gap": "BRIDGE_WEIGHTS", "limb": "LIMB_WEIGHTS"}
"""What a question's weights are called in `glsk_o3d.refinement.scores`."""
PENALTY = 1.0  # of half a weight's square, as if it were drawn from a normal distribution; the constant has none


class Answered(NamedTuple):
    """Questions of one kind: their facts, whether it is so, and of which shapes and families they are."""

    names: list[str]
    facts: np.ndarray
    is_so: np.ndarray
    shapes: np.ndarray
    families: np.ndarray

    def of(self, some: np.ndarray) -> Answered:
        """Some of them."""
        return Answered(self.names, *(each[some] for each in self[1:]))


def by_question(rows: list[dict]) -> dict[str, Answered]:
    """The questions of all clouds, by what they are about."""
    found: dict[str, list[tuple]] = {about: [] for about in WEIGHTS}
    for row in rows:
        for it in row.get("questions", ()):
            found[it["about"]].append((it["facts"], it["is_so"], row["shape"], row["family"]))
    told = {}
    for about, each in found.items():
        if each:
            facts, is_so, shapes, families = zip(*each, strict=True)
            names = list(facts[0])
            table = np.array([[fact[name] for name in names] for fact in facts])
            told[about] = Answered(names, table, np.array(is_so), np.array(shapes), np.array(families))
    return told


def fitted(answered: Answered) -> dict[str, float]:
    """The weights with which the questions are answered best: least log loss, with a light L2 penalty."""
    table = np.column_stack([np.ones(len(answered.facts)), answered.facts])
    penalty = PENALTY * np.append(0, np.ones(len(answered.names)))

    def loss(weights):
        total = table @ weights
        value = np.logaddexp(0, np.where(answered.is_so, -total, total)).sum() + penalty @ weights**2 / 2
        return value, table.T @ (expit(total) - answered.is_so) + penalty * weights

    found = minimize(loss, np.zeros(table.shape[1]), jac=True, method="BFGS").x
    return dict(zip(["constant", *answered.names], found.tolist(), strict=True))


def said(weights: Mapping[str, float], answered: Answered) -> np.ndarray:
    """Probabilities, (n,) float array."""
    return np.array([scores.probability(weights, dict(zip(answered.names, it, strict=True))) for it in answered.facts])


def packaged(about: str) -> dict[str, float]:
    """The weights that the package has."""
    return getattr(scores, WEIGHTS[about])
