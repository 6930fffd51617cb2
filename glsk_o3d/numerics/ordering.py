"""Morton order: points that are near in space become near in memory."""

import numpy as np

_BITS = 21  # per axis: 63 bits in all


def morton_order(points):
    """Permutation that sorts points along the Morton curve of their bounding box.

    Parameters
    ----------
    points : (n, 3) float array

    Returns
    -------
    (n,) int array
        Stable: equal points keep their order.
    """
    low = points.min(axis=0)
    extent = max(np.ptp(points, axis=0).max(), np.finfo(float).tiny)
    cell = ((points - low) / extent * (2**_BITS - 1)).astype(np.uint64)
    code = _spread(cell[:, 0]) | _spread(cell[:, 1]) << np.uint64(1) | _spread(cell[:, 2]) << np.uint64(2)
    return np.argsort(code, kind="stable")


def _spread(x):
    """Put two zero bits between the bits of 21-bit integers."""
    for shift, mask in (
        (32, 0x1F00000000FFFF),
        (16, 0x1F0000FF0000FF),
        (8, 0x100F00F00F00F00F),
        (4, 0x10C30C30C30C30C3),
        (2, 0x1249249249249249),
    ):
        x = (x | x << np.uint64(shift)) & np.uint64(mask)
    return x
