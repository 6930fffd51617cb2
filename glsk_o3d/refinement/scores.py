"""Probabilities from evidence: small logistic models, fitted on random shapes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

# All fitted, by benchmarks/calibrate.py on random shapes as scanners see them; docs/method.md says what the facts are.
AIR_WEIGHTS = {
    "constant": -4.1,
    "deficit": 2.9,
    "surface": -1.1,
    "straightness": -3.2,
    "noise": 3.5,
    "bonds": -0.8,
    "inner": 2.4,
    "length": -1.5,
}
HANDLE_WEIGHTS = {"constant": -2.1, "opening": 6.2, "winding": -3.3, "bonds": 0.6, "confidence": 3.5}
BRIDGE_WEIGHTS = {"constant": -3.3, "winding": 4.6, "straightness": 2.6, "cap": -0.7}
LIMB_WEIGHTS = {"constant": -2.4, "reach": 4.4}


def probability(weights: Mapping[str, float], facts: Mapping[str, float]) -> float:
    """Logistic model: the probability that the weighted sum of some facts stands for.

    Parameters
    ----------
    weights : mapping
        Of every fact, and ``"constant"``.
    facts : mapping
        At least those that have a weight.
    """
    total = weights["constant"] + sum(weight * facts[name] for name, weight in weights.items() if name != "constant")
    return float(1 / (1 + np.exp(-np.clip(total, -50, 50))))
