"""LPRReducer: energies, pairs, rings and bookkeeping."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glsk_o3d import Contractor, LPRReducer, RingBuilder, StageError, samples
from glsk_o3d.filters.lpr_reducer import match, merge_energy

CLOUDS = {
    "torus": samples.torus(n=600).points,
    "y_junction": samples.y_junction(n=600).points,
    "scan": samples.sauropod(n=700, noise=0.002).points,
}
VARIANTS = [
    LPRReducer(),
    LPRReducer(conserve_mass=False, order="index"),
    LPRReducer(conserve_mass=False),
    LPRReducer(order="index"),
]


def contracted(points, passes=1, reducer=None):
    state = RingBuilder()(points)
    for i in range(passes):
        state = Contractor(max_iterations=1)(state)
        state = reducer(state) if reducer and i < passes - 1 else state
    return state


@pytest.fixture(scope="module", params=CLOUDS)
def state(request):
    """After the first solve."""
    return contracted(CLOUDS[request.param])


def test_a_reducer_is_a_filter_after_a_contraction():
    with pytest.raises(StageError, match="Contractor"):
        LPRReducer()(RingBuilder()(CLOUDS["torus"]))
    pipeline = RingBuilder() | Contractor(max_iterations=1) | LPRReducer()
    reduced = pipeline(CLOUDS["torus"])
    assert 300 <= len(reduced) < 450
    assert reduced.report.stages == tuple(map(repr, pipeline.stages))


def slow_energy(state):
    """Equations 6 to 12, point by point."""
    psi = 1.2 * state.ring_ratio_drop
    energies = []
    for i in range(len(state)):
        s0, s, delta = state.ring_size0[i], state.ring_size[i], state.laplacian_coordinates[i]
        eta = max(s - psi * s0, 1e-4) / s0
        v1 = (9 * state.contraction_weight) ** 2 * np.linalg.norm(eta * delta) ** 2
        moved = state.positions[i] - state.previous[i]
        v2 = np.linalg.norm(psi * s0 / (s0 - s) * moved) ** 2 / eta**2
        mean = state.laplacian_coordinates[state.rings[i]].mean(axis=0)
        energies.append(v1 - v2 + 3 * np.linalg.norm(delta - mean) ** 2)
    return np.array(energies)


def test_merge_energies_are_those_of_the_equations(state):
    for case in (state, contracted(state.points, 3, LPRReducer())):
        np.testing.assert_allclose(merge_energy(case), slow_energy(case), rtol=1e-9)


@settings(max_examples=100)
@given(st.lists(st.tuples(st.integers(0, 9), st.integers(0, 9)).filter(lambda pair: pair[0] != pair[1]), max_size=25))
def test_a_matching_is_greedy(pairs):
    representatives, swallowed = (np.array([pair[end] for pair in pairs], int) for end in (0, 1))
    chosen = match(10, representatives, swallowed).tolist()
    taken = set()
    for position, pair in enumerate(pairs):
        if position in chosen:
            assert not taken & set(pair)  # a point takes part once
            taken |= set(pair)
        else:
            assert taken & set(pair)  # and nothing that came before in the order was left out
    assert chosen == sorted(chosen)


@pytest.mark.parametrize("reducer", VARIANTS, ids=repr)
def test_a_pass_merges_pairs_and_accounts_for_every_point(state, reducer):
    after = reducer(state)
    assert len(state) / 2 <= len(after) < len(state)
    assert set(after.survivors.tolist()) < set(state.survivors.tolist())
    assert (np.diff(after.survivors) > 0).all()
    # the owners are total, and a survivor owns itself
    assert after.map.survivor_of_row.shape == (state.report.n_distinct,)
    np.testing.assert_array_equal(np.unique(after.map.survivor_of_row), np.arange(len(after)))
    np.testing.assert_array_equal(after.map.survivor_of_row[after.survivors], np.arange(len(after)))
    # a point that stayed keeps its place, and takes in at most one other survivor
    at = np.searchsorted(state.survivors, after.survivors)
    for name in ("positions", "previous", "laplacian_coordinates"):
        np.testing.assert_array_equal(getattr(after, name), getattr(state, name)[at], err_msg=name)
    new_representative = after.map.survivor_of_row[state.survivors]
    assert np.bincount(new_representative).max() == 2
    # who was owned together stays together
    np.testing.assert_array_equal(after.map.survivor_of_row, new_representative[state.map.survivor_of_row])
    # every merge joins a point and its nearest ring neighbour, and pays
    swallowed = np.setdiff1d(np.arange(len(state)), at)
    representatives = at[new_representative[swallowed]]
    np.testing.assert_array_equal(state.rings.nearest(state.positions)[0][representatives], swallowed)
    assert (merge_energy(state)[representatives] < reducer.phi * state.ring_size[representatives] ** 2).all()
    if reducer.conserve_mass:  # and ring sizes are those of the rings as they are now
        np.testing.assert_array_equal(after.mass, np.bincount(after.map.survivor_of_row))
        s0, s = (after.rings.nearest(places)[1] for places in (after.cloud[after.survivors], after.positions))
    else:  # as before the merges
        np.testing.assert_array_equal(after.mass, 1)
        s0, s = state.ring_size0[at], state.ring_size[at]
    np.testing.assert_array_equal(after.ring_size0, s0)
    np.testing.assert_array_equal(after.ring_size, s)
    assert (after.rings.indices != after.rings.centres).all()  # nobody surrounds itself
