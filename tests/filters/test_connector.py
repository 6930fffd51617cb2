"""Connector: contracted cloud -> graph, as far as the outside can see."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.distance import cdist

from glsk_o3d import Connector, Contractor, LPRReducer, RingBuilder, Sampler, Skeleton, pipelines, samples

VARIANTS = {
    name: next(stage for stage in make().stages if isinstance(stage, Connector))
    for name, make in pipelines.PIPELINES.items()
}
ONE_RADIUS = VARIANTS["cao2010"]


def contracted(points, reducer=None):
    return Contractor(reducer=reducer, max_iterations=3)((Sampler(drop_invalid=True) | RingBuilder())(points))


@pytest.fixture(scope="module", params=[None, LPRReducer()], ids=["all points", "reduced"])
def state(request):
    return contracted(samples.y_junction(n=800).points, request.param)


@pytest.mark.parametrize("name", VARIANTS)
@pytest.mark.parametrize("shape", ["tube", "torus", "two_rings", "sheet"])
def test_a_connected_cloud_is_a_sound_skeleton(name, shape, assert_sound):
    points = samples.SAMPLES[shape](n=500).points
    skeleton = VARIANTS[name](contracted(points, LPRReducer()))
    assert isinstance(skeleton, Skeleton)
    assert_sound(skeleton, 500, triangles=True)
    np.testing.assert_array_equal(skeleton.points, points)
    assert (np.bincount(skeleton.vertex_of_point, minlength=len(skeleton.vertices)) > 0).all()


def test_vertices_are_the_weighted_means_of_their_points_and_rings_join_them(state):
    skeleton = Connector()(state)
    owner = np.full(len(state), -1)
    owner[state.survivor_of_point] = skeleton.vertex_of_point
    np.testing.assert_array_equal(owner[state.survivor_of_point], skeleton.vertex_of_point)  # of a survivor one vertex
    total = np.zeros_like(skeleton.vertices)
    np.add.at(total, owner, state.mass[:, None] * state.contracted)
    np.testing.assert_allclose(skeleton.vertices, total / np.bincount(owner, state.mass)[:, None], atol=1e-12)
    a, b = np.sort([owner[state.rings.centres], owner[state.rings.indices]], axis=0)
    possible = {(i, j) for i, j in zip(a.tolist(), b.tolist(), strict=True) if i != j}
    assert {tuple(edge) for edge in skeleton.edges.tolist()} <= possible
    assert len(ONE_RADIUS(state).edges)
    # a vertex with a neighbour in another one is never left alone
    assert (skeleton.degree > 0).all()


def test_balls_of_one_radius_hold_their_points():
    state = contracted(samples.y_junction(n=800).points)
    sizes = []
    for radius in (0.01, 0.03, 0.1, 0.3):
        skeleton = replace(ONE_RADIUS, radius=radius)(state)
        sizes.append(len(skeleton.vertices))
        at = state.contracted[state.survivor_of_point]
        for vertex in range(len(skeleton.vertices)):
            own = at[skeleton.vertex_of_point == vertex]
            assert cdist(own, own).max() <= 2 * radius
    assert sizes == sorted(sizes, reverse=True)
    assert sizes[0] > 3 * sizes[-1]


def test_points_with_a_ring_and_noisy_points_show_the_surface():
    """Of a dense clean part the points that the thinner left, even if they were merged since, of noise all."""
    rng = np.random.default_rng(0)
    clean, noisy = samples.tube(n=6000).points, samples.tube(n=1500).points + [0, 0, 3]
    points = np.concatenate([clean, noisy + rng.normal(scale=0.04, size=noisy.shape)])
    noisy_rings = pipelines.rings()(points)
    assert (noisy_rings.noise[noisy_rings.map.row_of_point[6000:]] > 0).mean() > 0.9
    state = Contractor(reducer=LPRReducer(), max_iterations=3)(noisy_rings)
    assert len(state) < len(noisy_rings)
    shown = Connector()(state).surface_points
    spoilt = np.flatnonzero(noisy_rings.map.sampled & (noisy_rings.noise[noisy_rings.map.row_of_point] > 0))
    np.testing.assert_array_equal(shown, np.union1d(noisy_rings.map.point_of_survivor, spoilt))
    assert (shown < 6000).sum() < 4000 < 6000
    assert np.isin(shown, Connector()(state).supporting_points).all()
