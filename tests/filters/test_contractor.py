"""Contractor: the solve by its definition, the weights, the guards, and closed forms."""

from dataclasses import asdict, replace
from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest
from scipy.spatial import cKDTree

from glsk_o3d import Contractor, LPRReducer, Pipeline, RingBuilder, Sampler, pipelines, samples
from glsk_o3d.filters import contractor as module
from glsk_o3d.filters.contractor import explained_score
from glsk_o3d.geometry.cotangent import cotangent_laplacian
from glsk_o3d.geometry.solver import SolveError

BUILDER = Pipeline(*pipelines.cao2010().stages[:2])
CAO, WEN = (named().stages[2] for named in (pipelines.cao2010, pipelines.wen2024))
DEFAULT = Contractor(reducer=LPRReducer())


@pytest.fixture(scope="module")
def built():
    return RingBuilder(k=16)(samples.torus(n=400).points)


def never(_):
    """A stopping rule."""


def test_the_first_solve_is_the_least_squares_solution(built):
    state = Contractor(max_iterations=1, initial_contraction=0.3)(built)
    weight = 0.3 / built.mean_ring_edge
    laplacian = check_solve(built, state, weight, np.ones(len(built)), atol=1e-10)
    np.testing.assert_array_equal(state.previous, built.positions)
    np.testing.assert_allclose(state.laplacian_coordinates, laplacian @ built.positions, atol=1e-10)
    np.testing.assert_array_equal(state.ring_size, built.rings.nearest(state.positions)[1])
    np.testing.assert_array_equal(state.ring_size0, built.ring_size0)
    assert state.contraction_weight == pytest.approx(weight)
    # in the first pass the published code takes a(1) for its drop
    assert state.ring_ratio_drop == pytest.approx(state.ring_ratio)


def test_the_second_solve_weighs_by_the_rings_of_the_first(built):
    one = replace(CAO, max_iterations=1)(built)
    two = replace(CAO, max_iterations=1)(one)
    attraction = np.minimum(one.ring_size0 / one.ring_size, 1e4)
    check_solve(one, two, 3 * one.contraction_weight, attraction, atol=1e-8)
    assert two.ring_ratio_drop == pytest.approx(one.ring_ratio - two.ring_ratio)
    capped = Contractor(stop=never, max_iterations=6, amplification=2.5, max_contraction=40.0)(built)
    weights = [record.contraction_weight for record in capped.report.iterations]
    np.testing.assert_allclose(weights, np.minimum(0.2 / built.mean_ring_edge * 2.5 ** np.arange(6), 40), rtol=1e-12)


def check_solve(before, after, weight, attraction, atol):
    """The solution is that of least squares; gives the Laplacian."""
    laplacian = cotangent_laplacian(before.positions, before.rings).toarray()
    stacked = np.vstack([weight * laplacian, np.diag(attraction)])
    right = np.vstack([0 * before.positions, attraction[:, None] * before.positions])
    np.testing.assert_allclose(after.positions, np.linalg.lstsq(stacked, right, rcond=None)[0], atol=atol)
    return laplacian


def test_a_contraction_in_two_parts_is_that_in_one(built):
    for reducer in (None, LPRReducer()):
        through = Contractor(reducer=reducer, stop=never, max_iterations=4)(built)
        half = Contractor(reducer=reducer, stop=never, max_iterations=2)
        same(half(half(built)), through, rounding=1e-9)  # the order in which unknowns are eliminated is found again
        assert [record.iteration for record in through.report.iterations] == [1, 2, 3, 4]


@pytest.mark.parametrize(
    ("points", "score"),
    [
        (np.outer(np.linspace(0, 1, 50), [1, 2, 3]), 1),
        (np.concatenate([np.eye(3), -np.eye(3)]), 2 / 3),
        (np.concatenate([np.diag([2.0, 1, 0])[:2], -np.diag([2.0, 1, 0])[:2]]) + 7, (2 * 4 + 1) / (2 * 5)),
    ],
    ids=["line", "ball", "ellipse with variances 4, 1, 0"],
)
def test_the_explained_score_of_a_known_spread_is_exact(points, score):
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    for moved in (points, 1e-3 * points @ turn - 5):
        assert explained_score(moved) == pytest.approx(score, abs=1e-9)


def test_records_follow_their_definitions(built):
    filter = Contractor(reducer=LPRReducer(), stop=never, max_iterations=4)
    state = filter(built)
    records = state.report.iterations
    assert [record.iteration for record in records] == [1, 2, 3, 4]
    n = [record.n_points for record in records]
    assert n[0] == len(built)
    assert [before - record.n_merged for before, record in zip(n, records, strict=True)] == [*n[1:], len(state)]
    e_before, n_before = explained_score(built.cloud), len(built)
    for record in records:
        kept = 1 - (n_before - record.n_points) / len(built)
        assert record.explained_change == pytest.approx(abs(record.explained - e_before) / kept, rel=1e-12)
        assert 2 / 3 - 1e-9 <= record.explained <= 1 + 1e-9
        assert 0 <= record.solve_error < 1e-4
        assert record.seconds > 0
        e_before, n_before = record.explained, record.n_points
    final = Contractor(stop=never, max_iterations=1)(built)
    assert final.report.iterations[0].explained == pytest.approx(explained_score(final.positions))
    assert final.report.iterations[0].ring_ratio == pytest.approx(final.ring_size.sum() / final.ring_size0.sum())


def test_the_stopping_rule_is_asked_after_every_solve_and_its_reason_kept(built):
    asked = []

    def third(iterations):
        asked.append(len(iterations))
        return "three are enough" if len(iterations) == 3 else None

    reducer = Mock(side_effect=LPRReducer())
    report = Contractor(stop=third, reducer=reducer)(built).report
    assert (asked, report.stop_reason, report.converged) == ([1, 2, 3], "three are enough", True)
    assert report.iterations[-1].n_merged == 0  # nothing is merged after the last solve
    assert reducer.call_count == 2
    seen = []
    state = Contractor(stop=never)(built, on_iteration=lambda record: seen.append(record) or len(seen) < 2)
    assert (len(seen), state.report.stop_reason, state.report.converged) == (2, "stopped by the caller", False)
    assert tuple(seen) == state.report.iterations
    np.testing.assert_array_equal(state.positions, Contractor(stop=never, max_iterations=2)(built).positions)


def same(a, b, rounding=0.0):
    np.testing.assert_array_equal(a.map.survivor_of_row, b.map.survivor_of_row)
    for name in ("survivors", "mass"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name), err_msg=name)
    for name in ("positions", "previous", "ring_size", "laplacian_coordinates"):
        np.testing.assert_allclose(getattr(a, name), getattr(b, name), rtol=0, atol=rounding, err_msg=name)
    assert a.contraction_weight == b.contraction_weight
    for one, other in zip(a.report.iterations, b.report.iterations, strict=True):
        facts, others = (asdict(replace(record, seconds=0, solve_error=0)) for record in (one, other))
        assert facts == pytest.approx(others, rel=0, abs=rounding)


GRID = np.stack(np.meshgrid(*[np.arange(6.0)] * 3), -1).reshape(-1, 3)
GRID += 0.1 * np.random.default_rng(0).normal(size=(216, 3))


def test_a_solve_that_throws_points_out_is_dropped_or_holds_them():
    """A full cube of points has no surface: as published, the second solve runs away."""
    built = BUILDER(GRID)
    held = replace(CAO, retries=3)(built)
    assert len(held.report.iterations) > 1
    assert held.report.iterations[1].n_held > 0
    assert (np.abs(held.positions) <= 1.2 * held.frame.half_extent).all()
    state = CAO(built)
    assert len(state.report.iterations) == 1
    assert "solve 2 refused" in state.report.stop_reason
    assert not state.report.converged
    same(state, replace(CAO, max_iterations=1)(built))
    assert (np.abs(state.positions) <= 1.2 * state.frame.half_extent).all()


@pytest.mark.parametrize("fails_at", [1, 3])
def test_an_unsolvable_system_keeps_the_last_sound_state(built, monkeypatch, fails_at):
    solve, calls = module.solve_contraction, []

    def fail(*system):
        calls.append(system)
        if len(calls) == fails_at:
            raise SolveError("corrections stay at 1e-2")
        return solve(*system)

    expected = Contractor(stop=never, max_iterations=fails_at - 1)(built) if fails_at > 1 else built
    monkeypatch.setattr(module, "solve_contraction", fail)
    state = Contractor(stop=never)(built)
    same(state, expected)
    assert f"solve {fails_at} refused" in state.report.stop_reason
    assert not state.report.converged


@pytest.fixture
def weights(monkeypatch):
    """The weights that are solved with; of some points, thrown out unless they are held, one at a time."""
    solve, thrown, seen = module.solve_contraction, [], []

    def watched(laplacian, row_weight, weight, *others):
        seen.append(weight)
        positions, error = solve(laplacian, row_weight, weight, *others)
        loose = [point for point in thrown if weight[point] < 1e4]
        return np.where((np.arange(len(weight)) == (loose or [-1])[0])[:, None], [0, -40, 0], positions), error

    monkeypatch.setattr(module, "solve_contraction", watched)
    return SimpleNamespace(thrown=thrown, seen=seen)


def test_thrown_points_are_held(built, weights):
    weights.thrown += [7, 3, 250]
    state = Contractor(max_iterations=1)(built)
    assert [record.n_held for record in state.report.iterations] == [3]
    for attempt, weight in enumerate(weights.seen):
        np.testing.assert_array_equal(weight, np.where(np.isin(np.arange(400), [7, 3, 250][:attempt]), 1e4, 1))
    assert len(weights.seen) == 4
    np.testing.assert_allclose(state.positions[[7, 3, 250]], built.positions[[7, 3, 250]], atol=1e-4)


def test_lines_are_held_from_the_second_solve_on(built, weights, monkeypatch):
    filter = Contractor(stop=never, max_iterations=1, line_hold=30, max_attraction=50)
    share = np.linspace(0.5, 1, len(built))
    monkeypatch.setattr(module, "explained_variance", lambda points, rings: share[: len(points)])
    one = filter(built)
    filter(one)
    first, second = weights.seen
    np.testing.assert_array_equal(first, np.ones(len(built)))
    ratio = one.ring_size0 / one.ring_size
    held = ~np.isclose(second, np.minimum(ratio, 50), rtol=1e-12)
    np.testing.assert_allclose(second, np.minimum(np.where(held, 30 * ratio, ratio), 50), rtol=1e-12)
    assert 0.7 < share[~held].max() < share[held].min() < 1


def distance_to_axis(points, sample):
    """In tube radii."""
    share = np.linspace(0, 1, 41)[:, None, None]
    a, b = sample.nodes[sample.edges[:, 0]], sample.nodes[sample.edges[:, 1]]
    return cKDTree((a + share * (b - a)).reshape(-1, 3)).query(points)[0] / sample.radii.mean()


@pytest.mark.slow
def test_conserving_mass_keeps_a_torus_open():
    """Without it the torus falls into its centre: the reason for the multiplicities."""
    sample = samples.torus(n=2048, seed=1)
    built = (Sampler(frame="box") | RingBuilder(k=16))(sample.points)
    kept, lost = (
        distance_to_axis(filter(built).contracted, sample).mean() for filter in (DEFAULT, pipelines.wen2024().stages[2])
    )
    assert kept < 0.4
    assert lost > 1.5
