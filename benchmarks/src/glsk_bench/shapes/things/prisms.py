"""Prisms: one straight or bent sweep of any section."""

from __future__ import annotations

import numpy as np

from ..curves import any_rotation, log_uniform
from .lines import X, Y, arc, lengths_along
from .section import any_power, half_axes
from .solid import Solid

BENT_STEPS = 36  # fitted: smooth enough
BEVELS = (0, 0, 0.15, 0.35)  # fitted: of the edges of flat ends, in the smaller half axis; half of them are sharp
WIDEST_BEND = 0.5  # derived: so many radians over a length of 1, over the half axis, leave room inside the bend
LOGISTIC = 4  # fitted: how soon a neck turns into a bottle


def prisms(rng: np.random.Generator) -> Solid:
    """Draw a prism; half of them are bent, to the wide side or the narrow one."""
    solid, radius = Solid(), log_uniform(rng, 0.05, 0.15)
    aspect, power = rng.uniform(1, 4), any_power(rng)
    a, b = half_axes(radius, aspect, power)
    kind = str(rng.choice(["constant", "taper", "bottle", "bulge"]))
    bend = 0.0 if rng.random() < 0.5 else rng.uniform(0.3, 2.0)
    steps = 2 if kind == "constant" and not bend else BENT_STEPS
    towards, half = (X, a) if rng.random() < 0.5 else (Y, b)
    places = arc(1.0, min(bend, float(WIDEST_BEND / half)), steps, towards=towards)
    size = _profile(rng, lengths_along(places), kind)
    ends = ["round" if rng.random() < 0.15 else "flat" for _ in range(2)]
    solid.limb(places, a * size, b * size, power, X, ends, bevel=any_bevel(rng))
    return solid.rotated(any_rotation(rng))


def _profile(rng, t, kind):
    """Size of the section along t in 0 to 1, in its greatest."""
    thin, size = 1 / rng.uniform(1.3, 3), np.ones(len(t))
    if kind == "taper":
        size = 1 + (thin - 1) * t
    elif kind == "bottle":
        shoulder, soft = rng.uniform(0.4, 0.75), rng.uniform(0.04, 0.15)
        size = thin + (1 - thin) / (1 + np.exp((t - shoulder) / soft * LOGISTIC))
    elif kind == "bulge":
        middle, wide = rng.uniform(0.3, 0.7), rng.uniform(0.2, 0.35)
        size = thin + (1 - thin) * np.exp(-(((t - middle) / wide) ** 2))
    return size / size.max()


def any_bevel(rng: np.random.Generator) -> float:
    """How far the edges of flat ends are cut off, if they are."""
    return float(rng.choice(BEVELS))


def any_end(rng: np.random.Generator) -> str:
    """One end of a limb: as many are flat as round."""
    return str(rng.choice(["flat", "round"]))
