"""Probabilities from evidence: small logistic models, fitted on random shapes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

# All fitted, by benchmarks/calibrate.py on random shapes and things as scanners see them; docs/method.md says what the
# facts are.
AIR_WEIGHTS = {
    "constant": -5.8,
    "deficit": 1.7,
    "surface": -0.5,
    "straightness": -3.2,
    "noise": 1.9,
    "bonds": -0.9,
    "inner": 3.4,
    "length": -0.5,
}
HANDLE_WEIGHTS = {"constant": -0.9, "opening": 2.9, "winding": -3.3, "bonds": 0.5, "confidence": 3.0}
BRIDGE_WEIGHTS = {"constant": -3.7, "winding": 5.8, "straightness": 2.5, "cap": -0.7}
LIMB_WEIGHTS = {"constant": -5.3, "protrusion": 3.0, "web": -4.7, "confidence": 4.0, "roundness": 2.5}


def probability(weights: Mapping[str, float], facts: Mapping[str, float]) -> float:
    """Logistic model: the probability that the weighted sum of some facts, and of a ``"constant"``, stands for."""
    total = weights["constant"] + sum(weight * facts[name] for name, weight in weights.items() if name != "constant")
    return float(1 / (1 + np.exp(-np.clip(total, -50, 50))))
