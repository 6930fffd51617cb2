"""Probabilities from evidence: small logistic models, fitted on random shapes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

# All fitted, by benchmarks/calibrate.py on random shapes as scanners see them; docs/method.md says what the facts are.
AIR_WEIGHTS = {
    "constant": -2.9,
    "deficit": 2.6,
    "surface": -1.1,
    "straightness": -4.7,
    "noise": 4.0,
    "bonds": -0.9,
    "inner": 1.7,
    "length": -1.3,
}
HANDLE_WEIGHTS = {"constant": 1.9, "opening": 3.5, "winding": -4.0, "bonds": 0.8, "confidence": 2.8}
BRIDGE_WEIGHTS = {"constant": -3.7, "winding": 5.8, "straightness": 2.5, "cap": -0.7}
LIMB_WEIGHTS = {"constant": -0.8, "reach": 3.2, "web": -4.0}


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
