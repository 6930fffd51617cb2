"""Sample shapes against closed forms and brute force."""

import networkx as nx
import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.stats import chisquare, kstest

from glsk_o3d import samples
from glsk_o3d.errors import InvalidParameterError
from glsk_o3d.samples import SAMPLES, sample_object, signed_distance, tree
from glsk_o3d.samples.capsules import union_sample, visible

TOPOLOGY = {  # components, loops and leaves of the axis
    "sauropod": (1, 1, 6),
    "tube": (1, 0, 2),
    "torus": (1, 1, 0),
    "helix": (1, 0, 2),
    "y_junction": (1, 0, 3),
    "two_rings": (2, 2, 0),
    "tree": (1, 0, 17),
    "sphere": (1, 0, 0),
    "sheet": (0, 0, 0),
}


@pytest.mark.parametrize("name", SAMPLES)
def test_every_sample(name):
    for n in (1, 2, 7, 1000):
        sample = SAMPLES[name](n=n, noise=0.01)
        assert (sample.name, sample.points.shape, sample.points.dtype) == (name, (n, 3), np.float64)
        assert np.isfinite(sample.points).all()
    assert sample.nodes.shape == (len(sample.radii), 3)
    assert (sample.radii > 0).all()
    assert sample.edges.dtype == np.int64
    graph = nx.Graph(sample.edges.tolist())
    graph.add_nodes_from(range(len(sample.nodes)))
    components = nx.number_connected_components(graph)
    leaves = sum(degree == 1 for _, degree in graph.degree)
    assert (components, len(sample.edges) - len(sample.nodes) + components, leaves) == TOPOLOGY[name]
    assert (graph.number_of_nodes(), graph.number_of_edges()) == (len(sample.nodes), len(sample.edges))


@pytest.mark.parametrize("name", SAMPLES)
def test_seed_size_and_noise_of_every_sample(name):
    clean, other = (SAMPLES[name](n=2000, seed=seed).points for seed in (3, 4))
    again = sample_object(2000, 0, 3, name).points
    np.testing.assert_array_equal(clean, again)
    assert not np.isclose(clean, other).all(axis=1).any()
    size = np.ptp(clean, axis=0).max()
    assert 0.5 < (size / 4 if name == "tree" else size) < 2  # a tree is in metres
    noise = SAMPLES[name](n=2000, noise=0.01, seed=3).points - clean
    np.testing.assert_allclose(noise.std(axis=0), 0.01 * np.linalg.norm(np.ptp(clean, axis=0)), rtol=0.06)


def axis_of(sample):
    return sample.nodes, sample.edges, sample.radii


@pytest.mark.parametrize("name", ["sauropod", "tube", "y_junction", "tree"])
def test_points_of_unions_lie_on_the_surface(name):
    sample = SAMPLES[name](n=1000)
    np.testing.assert_allclose(signed_distance(sample.points, *axis_of(sample)), 0, atol=2e-9)


def on_torus(x, y, z, ring_radius=0.3):
    return np.hypot(np.hypot(x, y) - ring_radius, z)


@pytest.mark.parametrize(
    ("sample", "distance", "radius"),
    [
        (samples.torus(5000, ring_radius=0.5, radius=0.2), lambda x, y, z: on_torus(x, y, z, 0.5), 0.2),
        (samples.two_rings(5000), lambda x, y, z: np.minimum(on_torus(x, y, z), on_torus(x - 0.3, z, y)), 0.06),
        (samples.tube(3000, length=2, capped=False), lambda x, y, z: np.hypot(np.hypot(y, z), np.abs(x) > 1), 0.1),
        (samples.sphere(500), lambda x, y, z: np.sqrt(x**2 + y**2 + z**2), 0.5),
    ],
)
def test_points_have_the_distance_of_the_formula(sample, distance, radius):
    np.testing.assert_allclose(distance(*sample.points.T), radius, rtol=1e-12)


def test_two_rings_are_alike_and_do_not_touch():
    sample = samples.two_rings(n=5000)
    x, y, z = sample.points.T
    assert 0.45 < (on_torus(x, y, z) < on_torus(x - 0.3, z, y)).mean() < 0.55
    assert cKDTree(sample.nodes[:128]).query(sample.nodes[128:])[0].min() > 4 * 0.06


def test_helix_keeps_its_distance_from_its_axis():
    sample = samples.helix(n=3000)
    t = np.linspace(0, 4 * np.pi, 40001)
    axis = np.stack([0.3 * np.cos(t), 0.3 * np.sin(t), 0.35 / (2 * np.pi) * (t - 2 * np.pi)], axis=1)
    np.testing.assert_allclose(cKDTree(axis).query(sample.points)[0], 0.06, atol=1e-6)
    assert cKDTree(axis).query(sample.nodes)[0].max() < 1e-3 * 0.3


@pytest.mark.parametrize("bend", [0, 90, 350])
def test_sheet_is_bent_but_not_stretched(bend):
    sample = samples.sheet(n=4000, bend=bend)
    x, y, z = sample.points.T
    if bend == 0:
        assert (z == 0).all()
        along = x
    else:
        radius = 1 / np.deg2rad(bend)
        np.testing.assert_allclose(np.hypot(x, z + radius), radius, rtol=1e-12)
        along = radius * np.arctan2(x, z + radius)
    assert kstest(along, "uniform", args=(-0.5, 1)).pvalue > 1e-3
    assert kstest(y, "uniform", args=(-0.35, 0.7)).pvalue > 1e-3


def test_tapered_capsule_is_uniform_by_area():
    # density over the axis coordinate is the same on both balls, and falls linearly with the radius on the cone between
    nodes, radii, edges = np.array([[0.0, 0, 0], [1, 0, 0]]), np.array([0.3, 0.1]), np.array([[0, 1]])
    x = union_sample("cone", nodes, edges, radii, 40000, 0, 7).points[:, 0]
    slope = 0.2
    cuts = np.array([-0.3, 0.3 * slope, 1 + 0.1 * slope, 1.1])
    areas = np.pi * np.array([2 * 0.3**2 * (1 + slope), (1 - slope**2) * 0.4, 2 * 0.1**2 * (1 - slope)])
    counts = np.histogram(x, cuts)[0]
    assert chisquare(counts, areas / areas.sum() * len(x)).pvalue > 1e-3
    share = (x[(x > cuts[1]) & (x < cuts[2])] - cuts[1]) / (cuts[2] - cuts[1])
    assert kstest(share, lambda s: (0.3 * s - 0.1 * s**2) / 0.2).pvalue > 1e-3


def test_torus_is_uniform_by_area():
    x, y, z = samples.torus(n=20000, ring_radius=0.4, radius=0.2, seed=2).points.T
    angle = np.arctan2(z, np.hypot(x, y) - 0.4)
    assert kstest(angle, lambda a: (a + np.pi + 0.5 * np.sin(a)) / (2 * np.pi)).pvalue > 1e-3


def test_union_is_uniform_by_area_where_its_parts_overlap():
    # three equal arms, each beyond the middle: the same number of points
    turn = np.deg2rad([0, 120, 240])
    nodes = 0.5 * np.array([[0, 0, 0], *np.column_stack([np.cos(turn), np.sin(turn), 0 * turn])])
    points = union_sample("y", nodes, np.array([[0, 1], [0, 2], [0, 3]]), np.full(4, 0.08), 30000, 0, 0).points
    assert chisquare((points @ nodes[1:].T / 0.5 > 0.2).sum(axis=0)).pvalue > 1e-3


def test_signed_distance_of_a_tapered_capsule_against_brute_force():
    rng = np.random.default_rng(0)
    nodes, radii, edges = np.array([[0.0, 0, 0], [0.6, 0.5, -0.2]]), np.array([0.3, 0.1]), np.array([[0, 1]])
    points = rng.uniform(-1, 1.5, (200, 3))
    share = np.linspace(0, 1, 4001)[:, None]
    centres, sizes = nodes[0] + share * (nodes[1] - nodes[0]), radii[0] + share[:, 0] * (radii[1] - radii[0])
    brute = np.array([(np.linalg.norm(centres - point, axis=1) - sizes).min() for point in points])
    np.testing.assert_allclose(signed_distance(points, nodes, edges, radii), brute, atol=1e-6)


@pytest.mark.parametrize("edge", [[0, 1], [1, 0]])
def test_signed_distance_of_a_ball_in_a_ball_and_of_a_ball_without_an_edge(edge):
    nodes, radii = np.array([[0.0, 0, 0], [0.1, 0, 0], [5, 0, 0]]), np.array([1.0, 0.2, 0.5])
    points = np.array([[2.0, 0, 0], [5, 2, 0], [0, 0, 0]])
    np.testing.assert_allclose(signed_distance(points, nodes, np.array([edge]), radii), [1, 1.5, -1])


def test_nothing_is_in_front_of_a_visible_point():
    whole, along = samples.sauropod(n=300, cameras=None), np.linspace(0, 0.995, 400)[:, None, None]
    for camera in np.array([samples.TWO_CAMERAS[0], (2, 0.1, 0.4), (0.01, -2, 0.02)]):
        seen = visible(whole.points, camera, *axis_of(whole))
        rays = camera + along * (whole.points - camera)
        least = signed_distance(rays.reshape(-1, 3), *axis_of(whole)).reshape(400, -1).min(axis=0)
        assert seen.sum() > 30
        assert (least[seen] > -1e-3).all()
        assert (least[~seen] < 2e-3).all()


def test_the_animal_and_its_scan():
    whole, scan = samples.sauropod(n=8000, cameras=None), samples.sauropod(n=8000)
    hidden = ~np.any([visible(whole.points, np.array(c), *axis_of(whole)) for c in samples.TWO_CAMERAS], axis=0)
    assert 0.1 < hidden.mean() < 0.3
    to_scan = cKDTree(scan.points).query(whole.points)[0]
    assert np.quantile(to_scan[~hidden], 0.999) < 0.05 < to_scan[hidden].max()
    x, y, z = whole.points.T
    below = (np.abs(x) < 0.1) & (np.abs(y) < 0.02) & (z < 0.3)
    assert below.sum() > 10
    assert hidden[below].all()
    assert abs(z.min()) < 2e-3  # it stands on its feet
    # a ball of four handle radii across goes through the opening of the handle
    assert signed_distance(np.array([[0.0, 0, 0.6]]), *axis_of(scan))[0] > 2 * 0.03


@pytest.mark.parametrize("wrong", [dict(n=0), dict(n=2.5), dict(n=True), dict(noise=-1)])
@pytest.mark.parametrize("make", SAMPLES.values())
def test_impossible_numbers_are_refused(make, wrong):
    with pytest.raises(InvalidParameterError):
        make(**wrong)


@pytest.mark.parametrize(
    ("make", "wrong"),
    [
        *((samples.sauropod, dict(cameras=cameras)) for cameras in ((), [(0, 0, 0.36)])),
        *((samples.tube, wrong) for wrong in (dict(radius=0), dict(length=-1), dict(length=np.inf))),
        (samples.torus, dict(radius=0.5, ring_radius=0.4)),
        (samples.y_junction, dict(radii=(0.1, 0.1, 0.7))),
        (samples.sheet, dict(bend=360)),
        (sample_object, dict(name="teapot")),
        *((tree, dict(forks=forks)) for forks in (-1, 9, 2.0, True)),
    ],
)
def test_impossible_shapes_are_refused(make, wrong):
    with pytest.raises(InvalidParameterError):
        make(**wrong)


@pytest.mark.parametrize("forks", [0, 1, 3, 5])
def test_a_tree_forks_in_two_and_tapers_from_its_foot(forks):
    drawn = tree(64, forks=forks, radius=0.2, length=2.0, seed=forks)
    ends = np.bincount(drawn.edges.ravel())
    assert (np.count_nonzero(ends == 1), np.count_nonzero(ends == 3)) == (2**forks + 1, 2**forks - 1)
    assert ends.max() == (3 if forks else 2)
    np.testing.assert_array_equal(drawn.nodes[0], 0)
    assert drawn.nodes[1, 2] > 0.9 * 2.0 / 6  # upright
    assert (drawn.edges[:, 0] < drawn.edges[:, 1]).all()
    assert (np.diff(drawn.radii[drawn.edges], axis=1) < 0).all()
    tips = np.flatnonzero(ends == 1)[1:]
    np.testing.assert_allclose(drawn.radii[tips], 0.2 / 2 ** ((forks + 1) / 2), rtol=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_no_tip_of_a_tree_is_inside_another_limb(seed):
    drawn = tree(64, forks=5, seed=seed)
    tips = np.flatnonzero(np.bincount(drawn.edges.ravel()) == 1)[1:]
    gap = cKDTree(drawn.nodes[tips]).query(drawn.nodes[tips], 2)[0][:, 1]
    assert (gap > 2 * drawn.radii[tips]).all()
