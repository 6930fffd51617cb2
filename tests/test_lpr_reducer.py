"""LPRReducer: energies, pairs, rings and bookkeeping."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import Delaunay

from glsk_o3d import Contractor, LPRReducer, RingBuilder, StageError, samples
from glsk_o3d.lpr_reducer import combine_rings, match, mend_rings, merge_energy
from glsk_o3d.numerics.neighbourhoods import plane_axes
from glsk_o3d.numerics.rings import Rings

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


def assert_star(flat, union, ring, closed):
    """The ring is the Delaunay star of the last of the (n, 2) points among the others, by their names."""
    centre = len(union)
    simplices = Delaunay(flat).simplices
    triangles = simplices[(simplices == centre).any(axis=1)].tolist()
    expected = {frozenset(union[j] for j in triangle if j != centre) for triangle in triangles}
    following = ring[1:] + (ring[:1] if closed else [])
    assert {frozenset(pair) for pair in zip(ring, following, strict=False)} == expected


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


@pytest.fixture(scope="module", params=CLOUDS)
def later(request):
    """After the third solve, with two passes between them."""
    return contracted(CLOUDS[request.param], 3, LPRReducer())


def test_runs_alone_as_a_filter_after_a_contraction():
    with pytest.raises(StageError, match="Contractor"):
        LPRReducer()(RingBuilder()(CLOUDS["torus"]))
    pipeline = RingBuilder() | Contractor(max_iterations=1) | LPRReducer()
    reduced = pipeline(CLOUDS["torus"])
    assert 300 <= len(reduced) < 450
    assert reduced.report.stages == tuple(map(repr, pipeline.stages))


# ---- the energy


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


def test_energy_against_the_equations(state, later):
    for case in (state, later):
        np.testing.assert_allclose(merge_energy(case), slow_energy(case), rtol=1e-9)


# ---- the matching


@settings(max_examples=300)
@given(st.lists(st.tuples(st.integers(0, 9), st.integers(0, 9)).filter(lambda pair: pair[0] != pair[1]), max_size=25))
def test_matching_is_greedy(pairs):
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


# ---- the merged rings


def test_combined_rings_are_delaunay_stars(state):
    nearest, _ = state.rings.nearest(state.positions)
    representatives = np.arange(0, len(state), 7)
    swallowed = nearest[representatives]
    combined = combine_rings(state, representatives, swallowed)
    cloud = state.cloud[state.survivors]
    flat = 0
    for at, (i, m) in enumerate(zip(representatives.tolist(), swallowed.tolist(), strict=True)):
        union = sorted((set(state.rings[i].tolist()) | set(state.rings[m].tolist())) - {i, m})
        delta = state.laplacian_coordinates[i]
        direction = delta / np.linalg.norm(delta)
        if abs(direction @ state.normals[state.survivors[i]]) < 1e-3:
            flat += 1
            direction = state.normals[state.survivors[i]]
        axes = plane_axes(direction[None])[0]
        assert_star((cloud[[*union, i]] - cloud[i]) @ axes, union, combined[at].tolist(), combined.closed[at])
    assert flat < 5


# ---- broken rings


def flat_rings(seed=0):
    """Delaunay stars of random points in the plane z = 0, and their normals."""
    points = np.column_stack([np.random.default_rng(seed).uniform(size=(120, 2)), np.zeros(120)])
    return RingBuilder()(points), np.tile([0.0, 0, 1], (120, 1))


def cut_short(rings, broken, length):
    rows = rings.padded(np.arange(len(rings)))
    rows[broken, length:] = -1
    return Rings.from_padded(rows, rings.closed & ~np.isin(np.arange(len(rings)), broken))


@pytest.mark.parametrize("length", [1, 2])
def test_rings_of_fewer_than_three_are_rebuilt(length):
    """As Delaunay stars among what is left of them and the rings of these."""
    state, normals = flat_rings()
    inside = np.flatnonzero((np.abs(state.positions[:, :2]) < 0.5).all(axis=1) & (state.rings.sizes > 4))
    broken = inside[::6]
    rings = cut_short(state.rings, broken, length)
    mended = mend_rings(rings, state.cloud, normals)
    whole = np.setdiff1d(np.arange(120), broken)
    for i in whole.tolist():
        if rings.sizes[i] >= 3:
            np.testing.assert_array_equal(mended[i], rings[i])
            assert mended.closed[i] == rings.closed[i]
    for i in broken.tolist():
        union = sorted({*rings[i].tolist(), *(k for j in rings[i].tolist() for k in rings[j].tolist())} - {i})
        assert_star(state.cloud[[*union, i], :2], union, mended[i].tolist(), mended.closed[i])
        assert mended.sizes[i] >= 3
    assert len(mended) == 120


# ---- the pass


@pytest.mark.parametrize("reducer", VARIANTS, ids=repr)
def test_bookkeeping_of_a_pass(state, reducer):
    after = reducer(state)
    assert len(state) / 2 <= len(after) < len(state)
    assert set(after.survivors.tolist()) < set(state.survivors.tolist())
    assert (np.diff(after.survivors) > 0).all()
    # the owners are total, and a survivor owns itself
    assert after.representative.shape == (state.report.n_distinct,)
    np.testing.assert_array_equal(np.unique(after.representative), np.arange(len(after)))
    np.testing.assert_array_equal(after.representative[after.survivors], np.arange(len(after)))
    # a point that stayed keeps its place, and takes in at most one other survivor
    at = np.searchsorted(state.survivors, after.survivors)
    for name in ("positions", "previous", "laplacian_coordinates"):
        np.testing.assert_array_equal(getattr(after, name), getattr(state, name)[at], err_msg=name)
    new_representative = after.representative[state.survivors]
    assert np.bincount(new_representative).max() == 2
    # who was owned together stays together
    np.testing.assert_array_equal(after.representative, new_representative[state.representative])
    # every merge joins a point and its nearest ring neighbour, and pays
    swallowed = np.setdiff1d(np.arange(len(state)), at)
    representatives = at[new_representative[swallowed]]
    np.testing.assert_array_equal(state.rings.nearest(state.positions)[0][representatives], swallowed)
    assert (merge_energy(state)[representatives] < reducer.phi * state.ring_size[representatives] ** 2).all()
    if reducer.conserve_mass:  # and ring sizes are those of the rings as they are now
        np.testing.assert_array_equal(after.mass, np.bincount(after.representative))
        s0, s = (after.rings.nearest(places)[1] for places in (after.cloud[after.survivors], after.positions))
    else:  # as before the merges
        np.testing.assert_array_equal(after.mass, 1)
        s0, s = state.ring_size0[at], state.ring_size[at]
    np.testing.assert_array_equal(after.ring_size0, s0)
    np.testing.assert_array_equal(after.ring_size, s)
    assert (after.rings.indices != after.rings.centres).all()  # nobody surrounds itself


@pytest.mark.parametrize("reducer", VARIANTS, ids=repr)
def test_cheapest_first_does_not_depend_on_the_order_of_the_points(reducer):
    """By index does, as in the published code."""
    points = CLOUDS["torus"]
    order = np.random.default_rng(0).permutation(len(points))
    straight, shuffled = (reducer(contracted(cloud)) for cloud in (points, points[order]))
    same = set(straight.point_of_survivor.tolist()) == set(order[shuffled.point_of_survivor].tolist())
    assert same == (reducer.order == "cheapest")
