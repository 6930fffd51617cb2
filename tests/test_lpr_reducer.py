"""LPRReducer: energies, pairs, rings and bookkeeping."""

from dataclasses import replace

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


def test_needs_a_contraction_first():
    with pytest.raises(StageError, match="Contractor"):
        LPRReducer()(RingBuilder()(CLOUDS["torus"]))


def test_runs_alone_as_a_filter():
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


def test_energy_where_a_ring_did_not_change(state):
    still = state.ring_size0.copy()
    still[:5] = state.ring_size[:5]
    energy = merge_energy(replace(state, ring_size0=still))
    assert (energy[:5] == -np.inf).all()
    assert np.isfinite(energy[5:]).all()


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


def test_merge_along_a_direction_within_the_tangent_plane_takes_that_plane():
    """On a flat patch the Laplacian coordinates are parallel to it; projected along them all points fall on a line."""
    side = np.stack(np.meshgrid(np.arange(15.0), np.arange(15.0)), -1).reshape(-1, 2)
    points = np.column_stack([side + np.random.default_rng(0).uniform(-0.2, 0.2, side.shape), np.zeros(225)])
    state = contracted(points)
    nearest, _ = state.rings.nearest(state.positions)
    combined = combine_rings(state, np.arange(225), nearest)
    inside = np.all((state.cloud[:, :2] > -0.5) & (state.cloud[:, :2] < 0.5), axis=1)
    assert combined.closed[inside].all()
    assert combined.sizes[inside].min() > 3
    assert len(LPRReducer()(state)) < 225


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


def test_sound_rings_are_left_alone():
    state = contracted(CLOUDS["torus"])
    rings = state.rings
    assert rings.sizes.min() >= 3
    assert mend_rings(rings, state.cloud, state.normals) is rings


def test_mending_leaves_fewer_points_that_nothing_surrounds():
    broken = {}
    for mend in (False, True):
        reduced = contracted(CLOUDS["torus"], 6, LPRReducer(mend_rings=mend))
        broken[mend] = int((reduced.rings.sizes < 3).sum())
    assert broken[True] < broken[False]


# ---- the pass


@pytest.mark.parametrize("reducer", VARIANTS, ids=repr)
class TestBookkeeping:
    def check(self, before, after, reducer):
        n = before.report.n_distinct
        assert len(before) / 2 <= len(after) < len(before)
        assert set(after.survivors.tolist()) < set(before.survivors.tolist())
        assert (np.diff(after.survivors) > 0).all()
        # the owners are total, and a survivor owns itself
        assert after.representative.shape == (n,)
        assert after.representative.min() == 0
        assert after.representative.max() == len(after) - 1
        np.testing.assert_array_equal(after.representative[after.survivors], np.arange(len(after)))
        # a point that stayed keeps its place, and takes in at most one other survivor
        at = np.searchsorted(before.survivors, after.survivors)
        for name in ("positions", "previous", "laplacian_coordinates"):
            np.testing.assert_array_equal(getattr(after, name), getattr(before, name)[at], err_msg=name)
        new_representative = after.representative[before.survivors]
        assert np.bincount(new_representative).max() == 2
        # who was owned together stays together
        np.testing.assert_array_equal(after.representative, new_representative[before.representative])
        # every merge joins a point and its nearest ring neighbour, and pays
        nearest, _ = before.rings.nearest(before.positions)
        energy = merge_energy(before)
        swallowed = np.setdiff1d(np.arange(len(before)), at)
        representatives = at[new_representative[swallowed]]
        np.testing.assert_array_equal(nearest[representatives], swallowed)
        assert (energy[representatives] < reducer.phi * before.ring_size[representatives] ** 2).all()

    def test_first_pass(self, state, reducer):
        self.check(state, reducer(state), reducer)

    def test_later_pass(self, reducer):
        later = contracted(CLOUDS["y_junction"], 3, reducer)
        self.check(later, reducer(later), reducer)

    def test_mass(self, state, reducer):
        reduced = reducer(state)
        if reducer.conserve_mass:
            np.testing.assert_array_equal(reduced.mass, np.bincount(reduced.representative))
            assert reduced.mass.sum() == reduced.report.n_distinct
        else:
            np.testing.assert_array_equal(reduced.mass, 1)

    def test_ring_sizes(self, state, reducer):
        reduced = reducer(state)
        if reducer.conserve_mass:  # of the rings as they are now
            s0, s = (reduced.rings.nearest(p)[1] for p in (reduced.cloud[reduced.survivors], reduced.positions))
        else:  # as before the merges
            at = np.searchsorted(state.survivors, reduced.survivors)
            s0, s = state.ring_size0[at], state.ring_size[at]
        np.testing.assert_array_equal(reduced.ring_size0, s0)
        np.testing.assert_array_equal(reduced.ring_size, s)

    def test_rings(self, state, reducer):
        rings = reducer(state).rings
        assert len(rings) == rings.indices.max() + 1
        assert (rings.indices != rings.centres).all()  # nobody surrounds itself
        assert (rings.indices >= 0).all()
        assert rings.sizes.min() >= 1
        following = rings.triangles[:, 1:]
        assert (following[:, 0] != following[:, 1]).all() or (rings.sizes == 1).any()

    def test_input_order(self, reducer):
        """Cheapest first does not depend on it; by index does, as in the published code."""
        points = CLOUDS["torus"]
        order = np.random.default_rng(0).permutation(len(points))
        straight, shuffled = (reducer(contracted(cloud)) for cloud in (points, points[order]))
        same = set(straight.point_of_survivor.tolist()) == set(order[shuffled.point_of_survivor].tolist())
        assert same == (reducer.order == "cheapest")


def test_lowest_index_first(state):
    """In the published order the pair of the first point that may merge is always made."""
    reduced = LPRReducer(conserve_mass=False, order="index")(state)
    nearest, _ = state.rings.nearest(state.positions)
    combined = combine_rings(state, np.arange(len(state)), nearest)
    may = (merge_energy(state) < 1e5 * state.ring_size**2) & (combined.sizes + combined.closed > 3)
    first = min(np.flatnonzero(may), key=lambda i: state.point_of_survivor[i])
    assert reduced.representative[state.survivors[first]] == reduced.representative[state.survivors[nearest[first]]]
    assert state.survivors[first] in reduced.survivors


def test_mass_is_conserved_over_a_whole_run():
    points = np.repeat(CLOUDS["torus"], 2, axis=0)
    reduced = Contractor(reducer=LPRReducer(), max_iterations=6)(RingBuilder()(points))
    assert reduced.mass.sum() == reduced.report.n_distinct == 600
    assert reduced.report.n_input == 1200
    np.testing.assert_array_equal(np.bincount(reduced.representative), reduced.mass)
    assert reduced.survivor_of_point.min() == 0
    assert len(np.unique(reduced.survivor_of_point)) == len(reduced)


def test_nothing_to_merge_gives_back_the_same_state(state):
    unchanged = LPRReducer(phi=1e-300)(replace(state, previous=state.positions))  # nothing pulls: F is positive
    assert len(unchanged) == len(state)
    np.testing.assert_array_equal(unchanged.rings.indices, state.rings.indices)
