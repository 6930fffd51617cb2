"""LPRReducer: local point reduction (Wen et al. 2024, section II-C and algorithm 1)."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..data.contraction import Contraction
from ..errors import StageError
from ..geometry.neighbourhoods import plane_axes
from ..geometry.numbers import fitted, published
from ..geometry.rings import Rings, star_rings
from ..geometry.vectors import Floats, dot, norm
from ..parameters import documented, parameter
from ..pipeline import Filter, RunContext


@dataclass(frozen=True)
class ReducerNumbers:
    """Numbers of the LPRReducer."""

    psi_factor: float = published(1.2, "psi' over psi")
    amplification_squared: float = published(9, "s_L squared, in the code and not in the paper")
    curvature: float = published(3, "weight of U in F")
    in_plane: float = fitted(1e-3, "sine of the angle below which a direction lies in the tangent plane")
    least_shrinkage: float = published(1e-4, "floor of s - psi' s(0) in the working frame")


REDUCER = ReducerNumbers()

OF_SURVIVORS = ("positions", "previous", "laplacian_coordinates", "mass", "ring_size0", "ring_size")


@documented
@dataclass(frozen=True, kw_only=True)
class LPRReducer(Filter[Contraction, Contraction]):
    r"""Merge each point with its nearest ring neighbour if that costs little: one pass.

    A point i may take over its nearest ring neighbour m if :math:`F = V_1 - V_2 + 3 U < \varphi s_i^2`. Its new ring is
    the Delaunay star of i among both rings, on the uncontracted points, projected along the Laplacian coordinate of i;
    m's entry in every other ring becomes i. A point takes part in at most one merge a pass.

    Which points pair off hangs on the least differences, and every pass makes them larger: of a cloud moved by 1e-7 no
    survivor of four passes is where it was. One that has no more than `least` survivors is therefore left as it is.

    With `conserve_mass` a survivor takes over the mass of the point it swallows, and the ring sizes s(0) and s(t) are
    measured anew on the combined rings. Without it, bent parts leave their axis.

    Raises
    ------
    StageError
        If the cloud has not been contracted yet.

    Notes
    -----
    As in the published code, the Laplacian coordinates are those before the solve, :math:`s_i - \psi' s_i(0)` is at
    least 1e-4, and V2 lacks the factor :math:`W_H`. As in the paper, the curvature term compares with the point's own
    Laplacian coordinate. Where that lies in the tangent plane, or is nothing beside the ring, the ring is projected on
    the tangent plane instead.

    References
    ----------
    Wen et al. 2024, equations 6 to 12 and algorithm 1.

    Examples
    --------
    >>> from glsk_o3d import Contractor, RingBuilder
    >>> from glsk_o3d.samples import torus
    >>> state = (RingBuilder() | Contractor(max_iterations=1))(torus(500).points)
    >>> len(LPRReducer()(state)) < len(state)
    True
    """

    phi: float = parameter(1e5, "Merge where F is below phi times the squared ring size.", low=0, open_low=True)
    conserve_mass: bool = parameter(True, "Survivors take over the mass of merged points.")
    mend_rings: bool = parameter(
        True, "Rebuild rings that no longer surround their point; otherwise such points later run away."
    )
    order: Literal["cheapest", "index"] = parameter(
        "cheapest",
        "Order of merges: the least F / s^2 first, or the lowest point index.",
        choices=("cheapest", "index"),
    )
    least: int = parameter(0, "Merge nothing once no more survivors are left.", unit="points", low=0)

    def run(self, state: Contraction, context: RunContext) -> Contraction:
        if not state.report.iterations:
            raise StageError("LPRReducer compares ring sizes before and after a contraction: run Contractor first")
        if len(state) <= self.least:
            return state
        nearest, _ = state.rings.nearest(state.positions)
        energy = merge_energy(state)
        candidates = np.flatnonzero(energy < self.phi * state.ring_size**2)  # Wen (12)
        if self.order == "index":
            rank = state.map.point_of_survivor[candidates]
        else:
            with np.errstate(divide="ignore"):
                rank = energy[candidates] / state.ring_size[candidates] ** 2
        candidates = candidates[np.argsort(rank, kind="stable")]
        representatives, combined = match_feasible(state, candidates, nearest[candidates])
        if len(representatives) == 0:
            return state
        return self._merge(state, representatives, nearest[representatives], combined)

    def _merge(
        self, state: Contraction, representatives: np.ndarray, swallowed: np.ndarray, combined: Rings
    ) -> Contraction:
        n = len(state)
        representative = np.arange(n)
        representative[swallowed] = representatives
        keep = representative == np.arange(n)
        index, survivors = np.cumsum(keep) - 1, state.survivors[keep]
        rings = state.rings.replace(representatives, combined).take(np.flatnonzero(keep)).rename(index[representative])
        if self.mend_rings:
            rings = mend_rings(rings, state.cloud[survivors], state.normals[survivors])
        of_survivors = {name: getattr(state, name)[keep] for name in OF_SURVIVORS}
        if self.conserve_mass:
            of_survivors["mass"] = np.bincount(representative, state.mass, n)[keep]
            _, of_survivors["ring_size0"] = rings.nearest(state.cloud[survivors])
            _, of_survivors["ring_size"] = rings.nearest(of_survivors["positions"])
        return state.merged_into(representative, rings=rings, **of_survivors)


def merge_energy(state: Contraction) -> np.ndarray:
    r"""F of every point after a solve: what merging it with its nearest ring neighbour would cost (equations 6 to 11).

    :math:`F = V_1 - V_2 + 3 U`, with :math:`\psi' = 1.2 \psi`, :math:`\eta = (s - \psi' s(0)) / s(0)`,
    :math:`V_1 = (9 w_L |\eta \delta|)^2` with the :math:`w_L` of the solve (9 is the published :math:`s_L^2`),
    :math:`V_2 = (\psi' s(0) |P' - P| / (\eta (s(0) - s)))^2` and :math:`U = |\delta_i - \bar\delta_j|^2` over the ring.
    Minus infinity where a ring did not change.
    """
    s0, s, delta = state.ring_size0, state.ring_size, state.laplacian_coordinates
    drop = REDUCER.psi_factor * state.ring_ratio_drop  # psi'
    eta = np.maximum(s - drop * s0, REDUCER.least_shrinkage) / s0  # Wen (11)
    moved = norm(state.positions - state.previous)
    with np.errstate(divide="ignore", invalid="ignore"):
        pulled = np.nan_to_num(drop * s0 * moved / (eta * (s0 - s)), nan=0.0, posinf=np.inf, neginf=-np.inf)
    contraction: Floats = (REDUCER.amplification_squared * state.contraction_weight * eta) ** 2 * dot(
        delta, delta
    )  # Wen (7)
    attraction: Floats = pulled**2  # Wen (8)
    curved = delta - state.rings.mean_over(delta)
    curvature = dot(curved, curved)  # Wen (9)
    return contraction - attraction + REDUCER.curvature * curvature  # Wen (6)


def combine_rings(state: Contraction, representatives: np.ndarray, swallowed: np.ndarray) -> Rings:
    """Rings of representatives that swallow others: Delaunay stars among both rings, on the uncontracted points."""
    union = np.concatenate([state.rings.padded(representatives), state.rings.padded(swallowed)], axis=1)
    union[(union == representatives[:, None]) | (union == swallowed[:, None])] = -1
    union.sort(axis=1)
    union[:, 1:][union[:, 1:] == union[:, :-1]] = -1  # the two share neighbours
    union = -np.sort(-union, axis=1)[:, : (union >= 0).sum(axis=1).max(initial=0)]
    normals = state.normals[state.survivors[representatives]]
    delta = state.laplacian_coordinates[representatives]
    length = norm(delta)[:, None]
    # of a flat ring they are nothing but rounding, and lead anywhere
    enough = REDUCER.in_plane * np.maximum(length, state.ring_size[representatives, None])
    along = np.abs(dot(delta, normals))[:, None] > enough
    direction = np.where(along, np.divide(delta, length, out=np.zeros_like(delta), where=along), normals)
    return star_rings(state.cloud[state.survivors], representatives, union, plane_axes(direction))


def match_feasible(state: Contraction, representatives: np.ndarray, swallowed: np.ndarray) -> tuple[np.ndarray, Rings]:
    """Greedy matching, in the given order, of the pairs that leave a ring around the representative.

    An umbrella of three or a fan of four is the least that still surrounds a point. The rings cost most, so they are
    made only for pairs that the matching takes; it is repeated without those found wanting until there are none, which
    gives the same pairs as if these had never been there. Returns the representatives and their rings after the merge.
    """
    rings, ring_of = Rings.concatenate([]), np.full(len(state), -1)
    feasible = np.ones(len(representatives), bool)
    while True:
        remaining = np.flatnonzero(feasible)
        chosen = remaining[match(len(state), representatives[remaining], swallowed[remaining])]
        new = chosen[ring_of[representatives[chosen]] < 0]
        if len(new) == 0:
            return representatives[chosen], rings.take(ring_of[representatives[chosen]])
        combined = combine_rings(state, representatives[new], swallowed[new])
        ring_of[representatives[new]] = len(rings) + np.arange(len(new))
        rings = Rings.concatenate([rings, combined])
        feasible[new] = combined.sizes + combined.closed > 3


def mend_rings(rings: Rings, points: np.ndarray, normals: np.ndarray) -> Rings:
    """Rings with those of fewer than three neighbours rebuilt: Delaunay stars among the rings of these neighbours."""
    broken = np.flatnonzero(rings.sizes < 3)
    if len(broken) == 0:
        return rings
    around = rings.padded(broken)
    beyond = [np.where(side[:, None] >= 0, rings.padded(np.maximum(side, 0)), -1) for side in around.T]
    union = np.concatenate([around, *beyond], axis=1)
    union[union == broken[:, None]] = -1
    return rings.replace(broken, star_rings(points, broken, union, plane_axes(normals[broken])))


def match(n: int, representatives: np.ndarray, swallowed: np.ndarray) -> np.ndarray:
    """Greedy matching of pairs of n points in the given order: positions of those whose points are both still free."""
    # Rounds of the pairs that come before all others at both their points. Of nearest neighbours two or three do; only
    # a chain of pairs in its own order takes a round for every second one.
    pairs = np.stack([representatives, swallowed], axis=1)
    free, first, remaining, chosen = np.ones(n, bool), np.empty(n, int), np.arange(len(pairs)), [np.empty(0, int)]
    while len(remaining):
        first[pairs[remaining[::-1]]] = remaining[
            ::-1, None
        ]  # of several writes the last one stays: that of the least position
        ends = pairs[remaining]
        wins = (first[ends] == remaining[:, None]).all(axis=1)
        chosen.append(remaining[wins])
        free[ends[wins]] = False
        remaining = remaining[free[ends].all(axis=1)]
    return np.sort(np.concatenate(chosen))
