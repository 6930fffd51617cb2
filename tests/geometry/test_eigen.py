"""Closed-form eigenvalues and directions against known ones and NumPy's."""

import numpy as np
import pytest

from glsk_o3d.geometry.eigen import largest_eigenvalue, main_direction, principal_parts
from glsk_o3d.geometry.vectors import PAIRS

SPREADS = [(1, 2, 5), (0, 0, 1), (0, 1e-9, 1), (-3, 1, 2), (1, 1, 1.1), (0, 1, 1), (0, 1, 1 + 1e-9), (2, 2, 2)]


def matrices(spread, n=500, seed=0):
    rng = np.random.default_rng(seed)
    turns = np.linalg.qr(rng.normal(size=(n, 3, 3)))[0]
    return np.matmul(turns * spread, turns.transpose(0, 2, 1)), turns


def entries(made):
    return np.stack([made[:, i, j] for i, j in PAIRS])


@pytest.mark.parametrize("scale", [1e-12, 1, 1e12])
@pytest.mark.parametrize("spread", SPREADS)
def test_eigenvalues_and_directions_are_the_known_ones(spread, scale):
    made, turns = matrices(scale * np.array(spread, float))
    made = entries(made)
    values, least = principal_parts(made)
    # where two are the same the closed form is good to the root of rounding
    for actual, known, others in zip(values, spread, ((1,), (0, 2), (1,)), strict=True):
        alone = min(abs(known - spread[other]) for other in others) > 1e-3
        np.testing.assert_allclose(actual, scale * known, rtol=1e-12, atol=scale * (1e-14 if alone else 3e-8))
    np.testing.assert_array_equal(values[2], largest_eigenvalue(made))
    for directions, column, beside in ((least, 0, 1), (main_direction(made), 2, 1)):
        np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1, rtol=1e-12)
        if abs(spread[column] - spread[beside]) > 1e-6:
            along = np.einsum("ni,ni->n", directions, turns[:, :, column])
            np.testing.assert_allclose(np.abs(along), 1, rtol=1e-12)
        residual = np.einsum("nij,nj->ni", matrices(scale * np.array(spread, float))[0], directions)
        residual -= scale * spread[column] * directions
        assert np.abs(residual).max() < 1e-8 * scale * max(map(abs, spread))


@pytest.mark.parametrize("gap", [1e-2, 1e-4, 1e-6, 1e-8, 1e-10])
def test_directions_of_eigenvalues_that_hardly_stand_out_are_exact(gap):
    """As good as the matrix itself lets them be, on either side of where NumPy takes over."""
    made, turns = matrices(np.array([0, gap, 1]))
    along = np.abs(np.einsum("ni,ni->n", principal_parts(entries(made))[1], turns[:, :, 0]))
    assert (1 - along).max() < 1e-12 + (1e-13 / gap) ** 2
