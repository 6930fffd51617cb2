"""Connector: contracted cloud -> graph, as far as the outside can see."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.distance import cdist

from glsk_o3d import Connector, Contractor, InvalidParameterError, LPRReducer, RingBuilder, Skeleton, pipelines, samples
from glsk_o3d.connector import local_thickness

VARIANTS = {name: make().stages[2] for name, make in pipelines.PIPELINES.items()}
ONE_RADIUS = VARIANTS["cao2010"]


def contracted(points, reducer=None):
    return Contractor(reducer=reducer, max_iterations=3)(RingBuilder(drop_invalid=True)(points))


@pytest.fixture(scope="module", params=[None, LPRReducer()], ids=["all points", "reduced"])
def state(request):
    return contracted(samples.y_junction(n=800).points, request.param)


@pytest.mark.parametrize("name", VARIANTS)
@pytest.mark.parametrize("shape", ["tube", "torus", "two_rings", "sheet"])
def test_gives_a_sound_skeleton(name, shape, assert_sound):
    points = samples.SAMPLES[shape](n=500).points
    skeleton = VARIANTS[name](contracted(points, LPRReducer()))
    assert isinstance(skeleton, Skeleton)
    assert_sound(skeleton, 500, triangles=True)
    np.testing.assert_array_equal(skeleton.points, points)
    assert (np.bincount(skeleton.vertex_of_point, minlength=len(skeleton.vertices)) > 0).all()


def test_points_belong_where_their_survivor_belongs(state):
    skeleton = Connector()(state)
    owner = np.full(len(state), -1)
    owner[state.survivor_of_point] = skeleton.vertex_of_point
    np.testing.assert_array_equal(owner[state.survivor_of_point], skeleton.vertex_of_point)


def test_vertices_are_the_weighted_means_of_their_points(state):
    skeleton = Connector()(state)
    owner = np.full(len(state), -1)
    owner[state.survivor_of_point] = skeleton.vertex_of_point
    total = np.zeros_like(skeleton.vertices)
    np.add.at(total, owner, state.mass[:, None] * state.contracted)
    mass = np.bincount(owner, state.mass)
    np.testing.assert_allclose(skeleton.vertices, total / mass[:, None], atol=1e-12)


def test_edges_join_what_rings_join(state):
    skeleton = Connector()(state)
    owner = np.full(len(state), -1)
    owner[state.survivor_of_point] = skeleton.vertex_of_point
    a, b = np.sort([owner[state.rings.owners], owner[state.rings.indices]], axis=0)
    possible = {(i, j) for i, j in zip(a.tolist(), b.tolist(), strict=True) if i != j}
    nearest = {tuple(edge) for edge in ONE_RADIUS(state).edges.tolist()}
    assert {tuple(edge) for edge in skeleton.edges.tolist()} <= possible
    assert nearest
    # a vertex with a neighbour in another one is never left alone
    assert (skeleton.degree > 0).all()


@pytest.mark.parametrize("share", [0.5, 2, 5])
def test_percentages_and_units_agree(share):
    sample = samples.y_junction(n=800).points * 250
    state = contracted(sample)
    diagonal = np.linalg.norm(np.ptp(sample, axis=0))
    a, b = (replace(ONE_RADIUS, radius=radius)(state) for radius in (f"{share}%", share / 100 * diagonal))
    np.testing.assert_array_equal(a.vertices, b.vertices)
    np.testing.assert_array_equal(a.edges, b.edges)


def test_balls_of_one_radius_cover_and_keep_apart():
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


def test_radius_wider_than_the_cloud_leaves_one_vertex(state):
    skeleton = replace(ONE_RADIUS, radius=100.0)(state)
    assert len(skeleton.vertices) == 1
    assert skeleton.edges.shape == (0, 2)
    assert (skeleton.vertex_of_point == 0).all()


def test_components_stay_apart():
    one = samples.torus(n=400).points
    skeleton = Connector()(contracted(np.concatenate([one, one + [5, 0, 0]])))
    side = skeleton.vertices[:, 0] > 2.5
    assert side.any()
    assert not side.all()
    assert (side[skeleton.edges[:, 0]] == side[skeleton.edges[:, 1]]).all()
    np.testing.assert_array_equal(side[skeleton.vertex_of_point], np.repeat([False, True], 400))


def test_dropped_points_have_no_vertex(assert_sound):
    points = samples.tube(n=300).points
    points[[3, 4]] = np.nan
    skeleton = Connector()(contracted(points))
    assert_sound(skeleton, 300, n_dropped=2, triangles=True)
    np.testing.assert_array_equal(np.flatnonzero(skeleton.vertex_of_point < 0), [3, 4])
    assert np.isnan(skeleton.normals[[3, 4]]).all()


def test_radii_are_those_of_the_tube():
    skeleton = Connector()(Contractor()(RingBuilder()(samples.tube(n=2000, radius=0.1).points)))
    middle = np.abs(skeleton.vertices[:, 0]) < 0.4
    np.testing.assert_allclose(skeleton.radii[middle], 0.1, rtol=0.05)


@pytest.mark.parametrize("radius", ["0%", 0, -1, "fat", np.nan, None])
def test_bad_radius(state, radius):
    with pytest.raises(InvalidParameterError, match=r"Connector\.radius"):
        Connector(radius=radius)(state)


# ---- local thickness


def slow_thickness(state, k=16):
    n = len(state)
    distance = np.linalg.norm(state.cloud - state.positions[state.owner], axis=1)
    own = np.array([np.median(distance[state.owner == i]) for i in range(n)])
    near = np.argsort(cdist(state.positions, state.positions), axis=1)[:, :k]
    return np.median(own[near], axis=1)


def test_local_thickness_is_a_median_over_sixteen(state):
    """Of the medians of what each survivor speaks for; itself is one of the 16."""
    np.testing.assert_allclose(local_thickness(state), slow_thickness(state), atol=1e-12)
    assert np.abs(slow_thickness(state, 15) - slow_thickness(state)).max() > 1e-4


def test_local_thickness_of_a_tube_is_its_radius():
    state = Contractor()(RingBuilder()(samples.tube(n=2000, radius=0.1).points))
    middle = np.abs(state.contracted[:, 0]) < 0.4
    np.testing.assert_allclose(local_thickness(state)[middle] * state.frame.scale, 0.1, rtol=0.1)


def test_local_thickness_ignores_a_few_points_gone_astray(state):
    cloud = state.cloud.copy()
    cloud[state.survivors[::40]] += 100
    astray = replace(state, cloud=cloud)
    assert local_thickness(astray).max() < 1


def test_local_thickness_of_fewer_points_than_neighbours():
    points = np.random.default_rng(0).normal(size=(10, 3))
    state = RingBuilder(outlier_factor=0)(points)
    moved = replace(state, positions=0.5 * state.positions)
    expected = np.median(np.linalg.norm(state.cloud, axis=1)) / 2
    np.testing.assert_allclose(local_thickness(moved), expected)
