"""Contractor: rings -> contracted cloud (Wen et al. 2024, section II-B; Cao et al. 2010)."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np
from scipy.sparse import csr_matrix

from ..data.contraction import Contraction
from ..data.report import REFUSED, STOPPED_BY_CALLER, IterationRecord
from ..geometry.cotangent import cotangent_laplacian
from ..geometry.eigen import largest_eigenvalue
from ..geometry.neighbourhoods import wide_covariances
from ..geometry.numbers import derived, fitted
from ..geometry.rings import Rings
from ..geometry.solver import Elimination, SolveError, solve_contraction
from ..geometry.vectors import TINY
from ..parameters import documented, parameter
from ..pipeline import Filter, RunContext
from .stopping import ExplainedScore, StopRule


@dataclass(frozen=True)
class ContractorNumbers:
    """Numbers of the Contractor."""

    line_variance: float = fitted(0.99, "explained variance that counts as a line")
    own_weight: int = fitted(4, "neighbours that a point counts as in its own surroundings")
    rounding: float = derived(1e-12, "share of the squares of which a difference is rounding")


CONTRACTOR = ContractorNumbers()


Reducer: TypeAlias = Callable[[Contraction], Contraction]
Laplacian: TypeAlias = Callable[[Contraction], csr_matrix]


def ring_laplacian(state: Contraction) -> csr_matrix:
    """The cotangent Laplacian of the current points on their rings."""
    return cotangent_laplacian(state.positions, state.rings)


@documented
@dataclass(frozen=True, kw_only=True)
class Contractor(Filter[Contraction, Contraction]):
    r"""Contract a cloud onto its curve skeleton, with an optional reduction after each solve.

    Each iteration solves :math:`(w_L^2 L^T M^{-1} L + M W_H^2) P' = M W_H^2 P` with the cotangent Laplacian L of the
    current points, raises :math:`w_L`, sets :math:`W_H = s(0) / s(t)`, and lets the reducer merge points. M is the
    diagonal of the survivors' masses; it is the identity unless points were merged before, or by a reducer that
    conserves mass.

    A late, ill-conditioned solve can throw points out of the cloud: beyond 1.2 times the bounding box or, in a frame
    that turns with the cloud, the ball around it. Such a solve is repeated with the runaway points held. If that
    fails, the last sound state is kept, and the report says so.

    References
    ----------
    Wen et al. 2024, equations 3 to 5 and figure 2; Cao et al. 2010, section 4. Equation 5 reads as a cumulative
    product; both published codes take the ratio to the first cloud, and so does this filter.

    Examples
    --------
    >>> from glsk_o3d import RingBuilder
    >>> from glsk_o3d.samples import torus
    >>> state = (RingBuilder() | Contractor(max_iterations=2))(torus(500).points)
    >>> state.report.stop_reason
    'reached max_iterations = 2'
    """

    reducer: Reducer | None = parameter(
        None, "Merges redundant points after solves; None keeps them all.", type="reducer?"
    )
    stop: StopRule = parameter(ExplainedScore(), "Decides after each solve whether to stop.", type="stop")
    max_iterations: int = parameter(10, "Most solves.", unit="solves", low=1)
    initial_contraction: float = parameter(
        0.2, "w_L of the first solve times the mean ring edge in the working frame.", low=0, open_low=True
    )
    amplification: float = parameter(3.0, "Factor on w_L after each solve.", low=1)
    max_contraction: float = parameter(2048.0, "Cap of w_L.", low=0, open_low=True)
    line_hold: float = parameter(
        30.0, "Factor on W_H where the cloud is a line already: more contraction would only shorten it.", low=1
    )
    keep_last: bool = parameter(True, "Keep the solve after which the rule says stop.")
    retries: int = parameter(3, "Times a solve that throws points out of the box is repeated with these held.", low=0)
    max_attraction: float = parameter(1e4, "Cap of W_H.", low=0, open_low=True)

    def run(self, state: Contraction, context: RunContext) -> Contraction:
        return self.contract(state, watch=context.after_solve)

    def contract(
        self,
        state: Contraction,
        laplacian: Laplacian = ring_laplacian,
        *,
        watch: Callable[[Contraction], bool] | None = None,
    ) -> Contraction:
        """Contract by another Laplacian than that of the rings, such as that of a mesh.

        Parameters
        ----------
        state : Contraction
        laplacian : callable
            Gives for a Contraction the (n, n) csr_matrix of its current positions: rows sum to zero, L P points inward.
        watch : callable, optional
            Called with the Contraction after each solve; returns False to stop there.

        Returns
        -------
        Contraction
            Its report has no stage of this filter.
        """
        reducer, elimination = self.reducer, Elimination()
        for _ in range(self.max_iterations):
            start, before = time.perf_counter(), state
            try:
                state, facts = self._solve(state, laplacian, elimination)
            except SolveError as problem:
                return _finished(state, f"solve {len(state.report.iterations) + 1} {REFUSED}: {problem}")
            state = _record(state, **facts, seconds=time.perf_counter() - start)
            reason = self.stop(state.report.iterations)
            if reason is None and reducer is not None:
                n, state = len(state), _reduced(state, reducer, start)
                if len(state) == n:
                    reducer = None  # as in the published code, which gives up after a pass without a merge
                else:
                    elimination = Elimination()
            if watch is not None and not watch(state) and reason is None:
                return _finished(state, STOPPED_BY_CALLER)
            if reason is not None:
                keep = self.keep_last or len(state.report.iterations) == 1
                kept = state if keep else before.with_report(state.report)
                return _finished(kept, reason, converged=True)
        return _finished(state, f"reached max_iterations = {self.max_iterations}")

    def _solve(
        self, state: Contraction, laplacian_of: Laplacian, elimination: Elimination
    ) -> tuple[Contraction, dict[str, Any]]:
        """One contraction step: equations 2, 4 and 5; 3 is `solve_contraction`."""
        # Wen (4)
        contraction = state.contraction_weight * self.amplification or self.initial_contraction / state.mean_ring_edge
        contraction = min(contraction, self.max_contraction)
        with np.errstate(divide="ignore"):
            attraction = state.ring_size0 / state.ring_size  # Wen (5)
        if self.line_hold > 1 and state.report.iterations:
            line = explained_variance(state.positions, state.rings) > CONTRACTOR.line_variance
            attraction = np.where(line, self.line_hold, 1) * attraction
        attraction = np.minimum(attraction, self.max_attraction)
        laplacian, mass = laplacian_of(state), np.sqrt(state.mass)
        positions, facts = self._solve_in_box(state, laplacian, contraction / mass, attraction, mass, elimination)
        _, ring_size = state.rings.nearest(positions)
        contracted = replace(
            state,
            positions=positions,
            previous=state.positions,
            laplacian_coordinates=laplacian @ state.positions,  # Wen (2)
            ring_size=ring_size,
            contraction_weight=contraction,
        )
        # In the first pass the published code takes a(1) itself for the drop, not 1 - a(1); so does this one.
        iterations = state.report.iterations
        drop = iterations[-1].ring_ratio - contracted.ring_ratio if iterations else contracted.ring_ratio  # Wen (10)
        return replace(contracted, ring_ratio_drop=drop), facts

    def _solve_in_box(
        self,
        state: Contraction,
        laplacian: csr_matrix,
        row_weight: np.ndarray,
        attraction: np.ndarray,
        mass: np.ndarray,
        elimination: Elimination,
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Solve; as long as that throws points out of the box, hold these and solve again."""
        held = np.zeros(len(state), bool)
        for _ in range(self.retries + 1):
            weight = np.where(held, self.max_attraction, attraction) * mass
            positions, error = solve_contraction(laplacian, row_weight, weight, state.positions, elimination)
            outside = state.frame.beyond(positions)
            if not outside.any():
                return positions, dict(n_held=int(held.sum()), solve_error=error)
            held |= outside
        raise SolveError(f"it would throw {outside.sum()} of {len(state)} points far out of the cloud")


def explained_variance(points: np.ndarray, rings: Rings) -> np.ndarray:
    """Share, from 0 to 1, of the largest principal component in the spread around every point, over two rings.

    The moments of a point are averaged with those of its ring, twice, and count as much as four neighbours. Rings cost
    a third of what asking for the nearest points costs, and are as good.
    """
    own = (CONTRACTOR.own_weight / (CONTRACTOR.own_weight + rings.sizes))[:, None]
    spread, square = wide_covariances(points, lambda values: own * values + (1 - own) * rings.mean_over(values), 2)
    total = spread[0] + spread[3] + spread[5]
    rounding = CONTRACTOR.rounding * (
        square[0] + square[3] + square[5]
    )  # of the differences: what is less has no direction
    return np.where(total > rounding, largest_eigenvalue(spread) / np.maximum(total, TINY), 0)


def explained_score(points: np.ndarray) -> float:
    """PCA score e = (2 l1 + l2 + l3) / (2 (l1 + l2 + l3)) of points: 1 for a line, 2/3 for a ball."""
    offset = points - points.mean(axis=0)
    spread = np.linalg.eigvalsh(offset.T @ offset)  # Wen (13)
    return float((spread.sum() + spread[-1]) / (2 * spread.sum()))  # Wen (14)


def _record(state: Contraction, **facts: Any) -> Contraction:
    """A state with the record of its last solve in the report."""
    iterations, explained = state.report.iterations, explained_score(state.positions)
    before, n_before = (
        (iterations[-1].explained, iterations[-1].n_points)
        if iterations
        else (explained_score(state.cloud), len(state))
    )
    kept = 1 - (n_before - len(state)) / state.report.n_contracted  # Wen (15)
    record = IterationRecord(
        iteration=len(iterations) + 1,
        n_points=len(state),
        n_merged=0,
        explained=explained,
        explained_change=abs(explained - before) / kept,  # Wen (16)
        ring_ratio=state.ring_ratio,
        contraction_weight=state.contraction_weight,
        **facts,
    )
    return state.with_facts(iterations=(*iterations, record))


def _reduced(state: Contraction, reducer: Reducer, start: float) -> Contraction:
    """A state after a pass of the reducer, which is no stage of its own in the report."""
    reduced = reducer(state)
    *earlier, last = reduced.report.iterations
    last = replace(last, n_merged=len(state) - len(reduced), seconds=time.perf_counter() - start)
    report = RunContext(state.report).report_of(reduced.report)
    return reduced.with_report(report).with_facts(iterations=(*earlier, last))


def _finished(state: Contraction, reason: str, converged: bool = False) -> Contraction:
    return state.with_facts(stop_reason=reason, converged=converged)
