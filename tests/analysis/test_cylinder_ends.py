"""Cylinders of logs with flat, open and round ends, the foot of a stem, and the angles at which branches leave it."""

import numpy as np
import pytest

from glsk_o3d import pipelines, samples
from glsk_o3d.analysis import branch_table, cylinders, tree_measures

pytestmark = pytest.mark.filterwarnings("ignore::glsk_o3d.SkeletonWarning")
Z = np.array([0, 0, 1.0])


def log(length, thin, ends, n, seed=0):
    """Points of a log with radii 1 and `thin`, even by area, and its volume."""
    rng = np.random.default_rng(seed)
    radii = np.array([1.0, thin])
    side = np.pi * radii.sum() * np.hypot(length, 1 - thin)
    caps = {"flat": 1, "open": 0, "round": 2}[ends] * np.pi * radii**2
    areas = np.array([side, *caps])
    part, u, turn = rng.choice(3, n, p=areas / areas.sum()), rng.random(n), 2 * np.pi * rng.random(n)
    radius = np.sqrt(1 + u * (thin**2 - 1))
    height = length * ((1 - radius) / (1 - thin) if thin < 1 else u)
    for k, (r, up, out) in enumerate(zip(radii, (0, length), (-1, 1), strict=True), 1):
        cap = part == k
        radius = np.where(cap, r * (np.sqrt(u) if ends == "flat" else np.sqrt(1 - u**2)), radius)
        height = np.where(cap, up + (out * r * u if ends == "round" else 0), height)
    volume = np.pi * length * (1 + thin + thin**2) / 3 + (2 / 3 * np.pi * (radii**3).sum() if ends == "round" else 0)
    return np.column_stack([radius * np.cos(turn), radius * np.sin(turn), height]), volume


@pytest.mark.parametrize("ends", ["flat", "open", "round"])
@pytest.mark.parametrize("thin", [1.0, 0.7, 0.5])
@pytest.mark.parametrize("length", [6, 10, 24])
def test_the_volume_of_a_log(length, thin, ends):
    points, volume = log(length, thin, ends, 3000)
    assert cylinders(pipelines.tree()(points)).volume.sum() == pytest.approx(volume, rel=0.03)


def test_the_volume_of_a_sample():
    stem = pipelines.tree("x")(samples.tube(4000, length=1, radius=0.1).points)
    assert cylinders(stem).volume.sum() == pytest.approx(np.pi * 0.1**2 * (1 + 0.4 / 3), rel=0.03)


def flared(seed, lean=0.6, noise=0.0):
    """A stem from z = 0.7 to 6.7 whose foot runs aside along a root, cut at that height."""
    rng = np.random.default_rng(seed)
    height, turn = 6 * rng.random(4000) ** 1.5, 2 * np.pi * rng.random(4000)
    radius = 0.25 + 0.15 * np.exp(-height / 0.3)
    aside = -lean * np.exp(-height / 0.4)
    points = np.column_stack([aside + radius * np.cos(turn), radius * np.sin(turn), 0.7 + height])
    return points + noise * rng.normal(size=points.shape)


@pytest.mark.parametrize("lean", [0, 0.3, 0.6, 1.0])
@pytest.mark.parametrize("seed", range(2))
def test_a_tree_begins_where_its_points_do(lean, seed):
    points = flared(seed, lean)
    skeleton = pipelines.tree()(points)
    measures, table = tree_measures(skeleton), cylinders(skeleton)
    assert measures.height == pytest.approx(np.ptp(points[:, 2]), abs=1e-9)
    lowest = points[:, 2].min()
    assert lowest - 1e-9 <= measures.root[2] <= lowest + 0.1
    assert table.start_point[:, 2].min() >= lowest - 1e-9
    assert measures.stem_diameter == pytest.approx(0.5, rel=0.05)


def test_a_lying_stem_begins_where_it_did():
    """Its lowest side says nothing of where it begins."""
    points = log(10, 1.0, "flat", 3000)[0][:, [2, 0, 1]]
    skeleton = pipelines.tree("x")(points)
    for up in ("x", "z", "-z"):
        assert cylinders(skeleton, up=up).start_point[0] == pytest.approx([0, 0, 0], abs=0.06)
    assert tree_measures(skeleton, up="z").height == pytest.approx(2, abs=0.6)


def tube(start, way, length, radius, n, rng):
    """Points on the side of a tube, and on a round cap at its far end."""
    across = np.linalg.svd(way[None])[2][1:]
    along, turn = length * rng.random(n), 2 * np.pi * rng.random(n)
    rise = np.clip((along - length + radius) / radius, 0, 1)
    wide = radius * np.sqrt(1 - rise**2)[:, None]
    return start + along[:, None] * way + wide * (np.cos(turn)[:, None] * across[0] + np.sin(turn)[:, None] * across[1])


def beside(points, a, b):
    """How far points are from the line between two places."""
    share = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
    return np.linalg.norm(points - a - share[:, None] * (b - a), axis=1)


@pytest.mark.parametrize("degrees", [30, 40, 50, 60, 75])
@pytest.mark.parametrize("thin", [0.3, 0.6, 1.0])
def test_the_angle_of_a_branch_is_read_beyond_the_stem(thin, degrees):
    rng, fork = np.random.default_rng(1), 9 * Z
    way = np.array([np.sin(np.radians(degrees)), 0, np.cos(np.radians(degrees))])
    stem, branch = tube(0 * Z, Z, 20, 1.0, 6000, rng), tube(fork, way, 10, thin, int(3000 * thin), rng)
    stem = stem[beside(stem, fork, fork + (10 - thin) * way) > thin]
    branch = branch[np.hypot(branch[:, 0], branch[:, 1]) > 1]
    table = branch_table(pipelines.tree()(np.concatenate([stem, branch])))
    lateral = np.flatnonzero(table.order == 1)
    assert table.angle[lateral[table.length[lateral].argmax()]] == pytest.approx(degrees, abs=4)


@pytest.mark.parametrize("seed", range(3))
def test_twigs_of_single_points_have_cylinders_with_a_radius_and_some_length(seed):
    """Most of a slice has one point, through which the curve runs."""
    rng = np.random.default_rng(seed)
    lines = [(0 * Z, 2 * Z), *((2 * Z, 2 * Z + 3 * np.array([np.cos(t), np.sin(t), 0.7])) for t in (0, 2, 4))]
    points = np.concatenate([a + np.sort(rng.random((120, 1)), axis=0) * (b - a) for a, b in lines])
    points += 0.01 * rng.normal(size=points.shape)
    skeleton = pipelines.tree()(points)
    assert skeleton.report.n_traced > 400
    table = cylinders(skeleton)
    assert table.radius.min() > 0.001
    assert np.quantile(skeleton.radii, 0.9) < 0.03
    assert np.bincount(table.branch).max() <= 60
