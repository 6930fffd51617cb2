"""Points in rows: neighbourhoods reach into the next ones."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from glsk_o3d import RingBuilder, Sampler, samples, skeletonize
from glsk_o3d.data.points import default_k
from glsk_o3d.geometry.neighbourhoods import reach_next_rows

RADIUS = 0.3


def scan_lines(lines, each, seed=0, length=3.0):
    """Circles around a tube, turned by chance."""
    height, turn = np.meshgrid(np.linspace(0, length, lines), np.linspace(0, 2 * np.pi, each, endpoint=False))
    turn = turn + 6 * np.random.default_rng(seed).random(lines)
    return np.stack([RADIUS * np.cos(turn), RADIUS * np.sin(turn), height], axis=-1).reshape(-1, 3)


def spiral(n, rho, length=3.0):
    """One row that winds around a tube, its turns rho times as far apart as its points."""
    step = np.sqrt(2 * np.pi * RADIUS * length / (n * rho))
    turn = np.arange(n) * step / RADIUS
    return np.stack([RADIUS * np.cos(turn), RADIUS * np.sin(turn), turn / (2 * np.pi) * rho * step], axis=-1)


def sliced(points, normal, away):
    """Points in planes across a direction, `away` apart, as voxels an eighth as large."""
    height = points @ normal
    near = np.abs(height / away - np.round(height / away)) < 1 / 16
    flat = points[near] + np.outer(np.round(height[near] / away) * away - height[near], normal)
    return np.unique(np.round(flat / (away / 8), 9).round(), axis=0) * (away / 8)


def nearest(points):
    return cKDTree(points).query(points, default_k(len(points)))[1]


@pytest.mark.parametrize("rho", [5, 8, 16])
def test_neighbourhoods_of_rows_reach_into_both_next_ones(rho):
    cloud = spiral(6000, rho)
    near, more = nearest(cloud), reach_next_rows(cloud, nearest(cloud))
    turn = np.round(RADIUS * 2 * np.pi / np.linalg.norm(cloud[1] - cloud[0]))
    rows = np.arange(1000, 5000)  # whose next rows are there
    away = (more[rows] - rows[:, None]) / turn
    assert (np.abs(near[rows] - rows[:, None]) < turn / 2).mean() > 0.4
    assert ((away.min(axis=1) < -0.8) & (away.max(axis=1) > 0.8)).all()
    assert more.shape[1] < 6 * rho + 16


@pytest.mark.parametrize("name", ["torus", "tree", "sauropod"])
def test_neighbourhoods_without_rows_stay(name):
    cloud = getattr(samples, name)(2000).points
    near = nearest(cloud)
    assert reach_next_rows(cloud, near) is near


def test_twigs_are_no_rows():
    """Each is a row of points, and others are near, but they lie on no surface."""
    rng = np.random.default_rng(0)
    start, way = rng.random((60, 3)), rng.normal(size=(60, 3))
    t = np.sort(rng.random((60, 50, 1)), axis=1)
    cloud = (start[:, None] + t * (way / np.linalg.norm(way, axis=1, keepdims=True))[:, None]).reshape(-1, 3)
    near = nearest(cloud)
    assert reach_next_rows(cloud, near) is near


def test_rings_take_the_neighbours_that_the_points_have():
    cloud = scan_lines(40, 200)
    points = Sampler()(cloud)
    assert points.neighbours.shape[1] > 16
    np.testing.assert_array_equal(
        RingBuilder()(cloud).rings.indices, RingBuilder(k=points.neighbours.shape[1])(cloud).rings.indices
    )


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(5))
def test_scan_lines_sixteen_times_denser_than_they_are_apart_give_a_tube(seed):
    skeleton = skeletonize(scan_lines(44, 450, seed))
    assert skeleton.report.n_contracted < 3000
    assert (skeleton.n_components, skeleton.n_loops, len(skeleton.leaves), skeleton.report.warnings) == (1, 0, 2, ())
    inner = skeleton.vertices[(skeleton.vertices[:, 2] > 0.3) & (skeleton.vertices[:, 2] < 2.7)]
    assert np.linalg.norm(inner[:, :2], axis=1).max() < 0.1 * RADIUS


@pytest.mark.parametrize("normal", [(1, 0, 0), (0.6, 0.48, 0.64)])
@pytest.mark.parametrize(("name", "away", "counts"), [("y_junction", 0.05, (1, 0, 3)), ("torus", 0.03, (1, 1, 0))])
def test_slices_of_a_tomograph_keep_the_topology(name, away, counts, normal):
    """Of the points of one slice none says where the surface goes on."""
    skeleton = skeletonize(sliced(getattr(samples, name)(300_000).points, np.array(normal), away))
    assert (skeleton.n_components, skeleton.n_loops, len(skeleton.leaves), skeleton.report.n_traced) == (*counts, 0)
