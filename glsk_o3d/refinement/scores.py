"""Probabilities from evidence: small logistic models, fitted on random shapes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

# All fitted, by benchmarks/calibrate.py on random shapes as scanners see them; docs/method.md says what the facts are.
AIR_WEIGHTS = {
    "constant": -4.74,
    "deficit": 3.47,
    "surface": -0.91,
    "straightness": -3.63,
    "noise": 4.37,
    "bonds": -0.76,
    "inner": 1.67,
    "length": -1.3,
}
HANDLE_WEIGHTS = {"constant": -4.49, "opening": 3.42, "winding": -2.1, "confidence": 5.79}
BRIDGE_WEIGHTS = {"constant": -2.51, "winding": 4.18, "sheets": -0.67, "straightness": 0.6, "cap": -0.9}
LIMB_WEIGHTS = {"constant": -6.0, "reach": 15.0}


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
