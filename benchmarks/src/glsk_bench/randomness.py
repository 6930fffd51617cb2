"""Random numbers that follow from names alone."""

from __future__ import annotations

import zlib

import numpy as np
from scipy.spatial.transform import Rotation


def generator(*key: str | int) -> np.random.Generator:
    """Random numbers that follow from some words and whole numbers.

    Parameters
    ----------
    *key : str or int
        Whole numbers are not negative. Words count by their CRC-32, which no version of Python changes.

    Returns
    -------
    numpy.random.Generator

    Examples
    --------
    >>> int(generator("tubes", 3).integers(1000)) == int(generator("tubes", 3).integers(1000))
    True
    """
    return np.random.default_rng([zlib.crc32(part.encode()) if isinstance(part, str) else int(part) for part in key])


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """A positive number whose logarithm is uniform: as many between 1 and 2 as between 2 and 4."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def any_rotation(rng: np.random.Generator) -> Rotation:
    """A rotation of which none is likelier than another."""
    return Rotation.from_quat(rng.normal(size=4))
