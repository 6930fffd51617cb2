"""The contraction solve against dense solutions of the stacked least-squares system, in extended precision."""

import numpy as np
import pytest
from scipy.sparse import csr_matrix

from glsk_o3d import samples
from glsk_o3d.filters.ring_builder import RingBuilder
from glsk_o3d.geometry import solver as module
from glsk_o3d.geometry.cotangent import cotangent_laplacian
from glsk_o3d.geometry.solver import Elimination, SolveError, solve_contraction


def least_squares(laplacian, row_weight, position_weight, points, dtype=np.longdouble):
    """Householder QR of [W_L L; W_H] X = [0; W_H P]: its condition is the root of that of the normal equations."""
    n = len(points)
    a = np.vstack([row_weight[:, None] * laplacian.toarray(), np.diag(position_weight)]).astype(dtype)
    b = np.vstack([np.zeros_like(points), position_weight[:, None] * points]).astype(dtype)
    for j in range(n):
        v = a[j:, j].copy()
        v[0] += np.copysign(np.sqrt(v @ v), v[0])
        v /= np.sqrt(v @ v)
        a[j:, j:] -= 2 * v[:, None] * (v @ a[j:, j:])
        b[j:] -= 2 * v[:, None] * (v @ b[j:])
    x = np.zeros((n, 3), dtype)
    for j in reversed(range(n)):
        x[j] = (b[j] - a[j, j + 1 : n] @ x[j + 1 :]) / a[j, j]
    return x.astype(float)


def condition(laplacian, row_weight, position_weight):
    """Of the normal equations."""
    stacked = np.vstack([row_weight[:, None] * laplacian.toarray(), np.diag(position_weight)])
    return np.linalg.cond(stacked) ** 2


def small_system(shape, n=150, seed=0):
    state = RingBuilder()(samples.SAMPLES[shape](n=n, seed=seed).points)
    return cotangent_laplacian(state.positions, state.rings), state.positions, state.ring_size0


SHAPES = ("torus", "y_junction", "sheet")


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("contraction", [0.0, 0.1, 5.0, 100.0, 2048.0])
def test_a_solve_is_the_dense_solution_of_least_squares(shape, contraction):
    laplacian, points, size = small_system(shape)
    rows = np.full(len(points), contraction)
    attraction = np.clip(size.mean() / size, 0.2, 5)
    x, error = solve_contraction(laplacian, rows, attraction, points)
    expected = least_squares(laplacian, rows, attraction, points)
    assert np.abs(x - expected).max() < 1e-9
    assert error < 1e-7


def test_refinement_corrects_what_the_factorisation_misses():
    """Normal equations of condition 1e14: the plain solution is off by far more than the refined one."""
    n = 60
    rng = np.random.default_rng(3)
    u, v = (np.linalg.qr(rng.normal(size=(n, n)))[0] for _ in range(2))
    laplacian = csr_matrix(u @ np.diag(np.r_[np.logspace(0, 7, n - 1), 0]) @ v.T)
    points, ones = rng.normal(size=(n, 3)), np.ones(n)
    assert condition(laplacian, ones, ones) > 1e13
    x, _ = solve_contraction(laplacian, ones, ones, points)
    expected = least_squares(laplacian, ones, ones, points)
    dense = laplacian.toarray()
    plain = np.linalg.solve(dense.T @ dense + np.eye(n), points)
    size = np.ptp(points, axis=0).max()
    assert np.abs(plain - expected).max() / size > 1e-6
    assert np.abs(x - expected).max() / size < 1e-7


@pytest.mark.parametrize(
    "spoil",
    [
        pytest.param(lambda l, r, a, p: (0 * l, r, 0 * a, p), id="no equation at all"),
        pytest.param(lambda l, r, a, p: (l * np.nan, r, a, p), id="NaN in the Laplacian"),
        pytest.param(lambda l, r, a, p: (l, r, a * np.nan, p), id="NaN in the weights"),
        pytest.param(lambda l, r, a, p: (l, r, a, p * np.nan), id="NaN in the points"),
        pytest.param(lambda l, r, a, p: (l, 400 * r, 1e-4 * a, p), id="too ill-conditioned"),
    ],
)
def test_a_system_without_a_trustworthy_solution_is_refused(spoil):
    laplacian, points, _ = small_system("torus")
    system = spoil(laplacian, np.full(len(points), 5.0), np.ones(len(points)), points)
    with pytest.raises(SolveError):
        solve_contraction(*system)


def test_the_order_of_elimination_is_kept(monkeypatch):
    """The second system with the same links is solved as the first, without looking for the order again."""
    laplacian, points, size = small_system("torus")
    rows, attraction, elimination = np.full(len(points), 0.5), size.mean() / size, Elimination()
    solve_contraction(laplacian, rows, attraction, points, elimination)
    np.testing.assert_array_equal(np.sort(elimination.place), np.arange(len(points)))
    ordered = []
    factorised = module.factorised
    monkeypatch.setattr(
        module, "factorised", lambda *given, **options: ordered.append(given[1:]) or factorised(*given, **options)
    )
    x, _ = solve_contraction(laplacian, 3 * rows, attraction, points, elimination)
    alone, _ = solve_contraction(laplacian, 3 * rows, attraction, points)
    assert ordered == [(True,), (False,)]
    np.testing.assert_allclose(x, alone, rtol=0, atol=1e-9)
