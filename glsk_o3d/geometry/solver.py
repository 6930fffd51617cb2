"""The linear solve of the contraction."""

from typing import Any

import numpy as np
from scipy.sparse import csc_array, csr_array, csr_matrix
from scipy.sparse.linalg import SuperLU, splu

from .vectors import Ints, box

# precision
SOLVE_TOLERANCE = 1e-7  # of the cloud's size; refinement ends here
SOLVE_ACCEPTABLE = 1e-4  # of the cloud's size; a solve that stalls above this is refused
MAX_REFINEMENTS = 6
# speed: columns at a time: one is a fifth faster than the usual 10 at 1000 points, a twentieth at 50000; but where more
# of the first half of all unknowns than `WIDE_CUT` are linked with the other, as in solids, 16 are three times faster
NARROW_PANEL, WIDE_PANEL, WIDE_CUT = 1, 16, 900


class SolveError(ArithmeticError):
    """The contraction system is singular or too ill-conditioned to be solved."""


def factorised(matrix: csc_array, ordered: bool = False, panel: int = NARROW_PANEL, **options: Any) -> SuperLU:
    """LU factors of a sparse, symmetric, positive definite csc matrix; RuntimeError if it is singular.

    Unknowns that are not `ordered` are eliminated in the order of the minimum degree.
    """
    order, options = "NATURAL" if ordered else "MMD_AT_PLUS_A", {"SymmetricMode": True, **options}
    return splu(matrix, permc_spec=order, diag_pivot_thresh=0.0, relax=1, panel_size=panel, options=options)


class Elimination:
    """The order in which unknowns are eliminated: kept from system to system as long as these have as many entries.

    To find it takes a third of the time of a factorisation. It suits the same links with other weights; where points
    were merged, or weights are no longer exactly 0, as those of the right angles of a grid, it makes ten times as many
    entries and more as one found anew.
    """

    def __init__(self) -> None:
        self.place: Ints | None = None
        self.n_entries, self.panel = 0, NARROW_PANEL

    def factorised(self, matrix: csc_array) -> SuperLU:
        """Factors of a system whose unknowns are in their places, if these are known."""
        kept, half = self.place is not None and matrix.nnz == self.n_entries, matrix.shape[0] // 2
        if self.place is None and matrix.nnz:  # along a Morton curve either half of the points is a part of the cloud
            cut = np.count_nonzero(matrix.indices[matrix.indptr[1 : half + 1] - 1] >= half)
            self.panel = WIDE_PANEL if cut > WIDE_CUT else NARROW_PANEL
        factor = factorised(matrix, kept, panel=self.panel, Equil=False)
        if not kept:
            self.place = factor.perm_c if self.place is None else factor.perm_c[self.place]
            self.n_entries = matrix.nnz
        return factor


def solve_contraction(
    laplacian: csr_matrix,
    row_weight: np.ndarray,
    position_weight: np.ndarray,
    points: np.ndarray,
    elimination: Elimination | None = None,
) -> tuple[np.ndarray, float]:
    r"""Minimise :math:`\|W_L L X\|^2 + \|W_H (X - P)\|^2` (Wen et al. 2024, equation 3; Cao et al. 2010).

    The normal equations :math:`(L^T W_L^2 L + W_H^2) X = W_H^2 P` are factorised once for the three coordinates. They
    are ill-conditioned late in a contraction, so that this alone is wrong in the second digit; iterative refinement
    with the residual in factored form, :math:`W_H^2 (P - X) - L^T W_L^2 (L X)`, brings the correction below 1e-7.

    The weights (n,) are the diagonals of :math:`W_L` and :math:`W_H`; `position_weight` must be positive. The order of
    the unknowns is kept in the `elimination`. Returns the places (n, 3) and the last correction over the cloud's size,
    an estimate of the error; SolveError if the factorisation breaks down or the estimate stays above 1e-4.
    """
    elimination = elimination or Elimination()
    place = np.arange(len(points)) if elimination.place is None else elimination.place
    system = _stacked(laplacian.tocsr(), row_weight, position_weight, place)
    transposed = system.T.tocsr()
    # Wen (3): W_L L X = 0 and W_H X = W_H P in the sense of least squares
    wanted, right = np.zeros((2 * len(points), 3)), np.empty_like(points)
    wanted[len(points) :] = position_weight[:, None] * points
    right[place] = position_weight[:, None] * wanted[len(points) :]
    try:
        factor = elimination.factorised((transposed @ system).tocsc())  # this also sorts it
    except RuntimeError as error:
        raise SolveError(f"the contraction system cannot be factorised ({error})") from error
    x = factor.solve(right)
    low, high = box(points)
    size, error = (high - low).max(), np.inf
    for _ in range(MAX_REFINEMENTS):
        correction = factor.solve(transposed @ (wanted - system @ x))
        change = np.abs(correction).max() / size
        if not change < error:  # also when it is NaN
            break
        x, error = x + correction, change
        if error < SOLVE_TOLERANCE:
            break
    if not error < SOLVE_ACCEPTABLE:
        raise SolveError(f"the contraction system is too ill-conditioned: corrections stay at {error:.1e} of the size")
    # The sum of all equations. The rows of a Laplacian sum to zero, so only W_H keeps the cloud in its place: where
    # it drowns beside L^T L in rounding, the corrections vanish but the points drift.
    pull = (system @ np.ones(len(points))) @ (wanted - system @ x)
    held = (position_weight**2).sum() * size
    drift = np.abs(pull).max() / held if held > 0 else np.inf
    if not drift < SOLVE_ACCEPTABLE:
        raise SolveError(f"the contraction system is too ill-conditioned: the cloud drifts by {drift:.1e} of its size")
    return x.take(place, axis=0), float(error)


def _stacked(
    laplacian: csr_matrix, row_weight: np.ndarray, position_weight: np.ndarray, place: np.ndarray
) -> csr_array:
    """The rows of W_L L, and below them W_H; every unknown has its place among the columns."""
    n, indices, starts = len(place), laplacian.indices, laplacian.indptr
    data = np.concatenate([np.repeat(row_weight, np.diff(starts)) * laplacian.data, position_weight])
    columns = place.astype(indices.dtype)
    ends = starts[-1] + np.arange(1, n + 1, dtype=starts.dtype)
    rows = np.concatenate([columns[indices], columns]), np.concatenate([starts, ends])
    return csr_array((data, *rows), shape=(2 * n, n))
