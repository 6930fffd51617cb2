"""Closed-form eigenvalues against NumPy's."""

import numpy as np
import pytest

from glsk_o3d.numerics.eigen import largest_eigenvalue, main_direction


def matrices(spread, n=500, seed=0):
    rng = np.random.default_rng(seed)
    turns = np.linalg.qr(rng.normal(size=(n, 3, 3)))[0]
    return np.matmul(turns * spread, turns.transpose(0, 2, 1)), turns


@pytest.mark.parametrize("scale", [1e-12, 1, 1e12])
@pytest.mark.parametrize("spread", [(1, 2, 5), (0, 0, 1), (0, 1e-9, 1), (-3, 1, 2), (-3, -2, -1), (1, 1, 1.1)])
def test_against_known_ones(spread, scale):
    made, turns = matrices(scale * np.array(spread, float))
    np.testing.assert_allclose(largest_eigenvalue(made), scale * spread[2], rtol=1e-12, atol=1e-14 * scale)
    along = main_direction(made)
    np.testing.assert_allclose(np.linalg.norm(along, axis=1), 1, rtol=1e-12)
    np.testing.assert_allclose(np.abs(np.einsum("ni,ni->n", along, turns[:, :, 2])), 1, rtol=1e-12)


@pytest.mark.parametrize("spread", [(0, 0, 0), (2, 2, 2), (0, 1, 1), (1, 1 + 1e-9, 1 + 1e-9)])
def test_equal_ones(spread):
    """Where the two largest are the same, the closed form is good to the root of rounding."""
    made, _ = matrices(np.array(spread, float))
    np.testing.assert_allclose(largest_eigenvalue(made), np.linalg.eigvalsh(made)[:, 2], rtol=3e-8, atol=1e-12)
