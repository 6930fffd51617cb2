"""Dot products and lengths of rows of vectors: several times faster than NumPy's own."""

import numpy as np


def dot(a, b):
    """Dot product of each two rows.

    Parameters
    ----------
    a, b : (n, 3) float array

    Returns
    -------
    (n,) float array
    """
    (x, y, z), (u, v, w) = a.T, b.T
    return x * u + y * v + z * w


def norm(a):
    """Length of each row.

    Parameters
    ----------
    a : (n, 3) float array

    Returns
    -------
    (n,) float array
    """
    return np.sqrt(dot(a, a))
