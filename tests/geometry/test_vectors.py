"""Rows of vectors."""

import numpy as np

from glsk_o3d.geometry.vectors import dot, norm

RNG = np.random.default_rng(0)


def test_rows_do_not_depend_on_each_other():
    """Bit for bit, so that skeletons do not depend on the order of the points."""
    a, b = RNG.normal(size=(2, 1001, 3))
    turn = RNG.permutation(len(a))
    np.testing.assert_array_equal(dot(a[turn], b[turn]), dot(a, b)[turn])
    np.testing.assert_array_equal(norm(a[turn]), norm(a)[turn])
