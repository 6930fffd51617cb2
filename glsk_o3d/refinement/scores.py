"""Probabilities from evidence: small logistic models, fitted on random shapes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

# All fitted, by benchmarks/calibrate.py on random shapes as scanners see them; docs/method.md says what the facts are.
AIR_WEIGHTS = {
    "constant": -5.8,
    "deficit": 3.3,
    "surface": -1.0,
    "sheets": 0.0,
    "straightness": -2.7,
    "noise": 4.0,
    "bonds": -0.8,
    "inner": 1.4,
    "length": -1.1,
}
HANDLE_WEIGHTS = {"constant": -5.6, "opening": 7.9, "winding": -3.4, "confidence": 10.0, "bonds": 0.7}
BRIDGE_WEIGHTS = {"constant": -3.0, "winding": 4.8, "sheets": -1.0, "straightness": 1.3, "cap": -0.3}
LIMB_WEIGHTS = {"constant": -2.5, "reach": 4.2}


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
