"""Traced twigs that are the scatter of points go, those that reach farther stay."""

from dataclasses import replace

import numpy as np
import pytest

from glsk_o3d import Skeleton, pipelines, samples
from glsk_o3d.refinement import tracing
from glsk_o3d.refinement.tracing import drop_spurious, spread_around


def drop(skeleton, radii, root=None):
    """Without spurious twigs, all of no confidence being traced."""
    left, stays = drop_spurious(skeleton, skeleton.confidence == 0, radii, root)
    np.testing.assert_array_equal(left.vertices, skeleton.vertices[stays])
    return left


RNG = np.random.default_rng(0)
SCATTER = 0.1  # root mean square distance
MEDIAN = np.sqrt(np.log(2))  # over that


def limb(*twigs, confidence=0.0, n=2000):
    """A straight limb of 41 vertices along x, points that scatter around it, and twigs (place, length) along y."""
    vertices = [(x, 0, 0) for x in np.linspace(0, 10, 41)]
    edges = [(i, i + 1) for i in range(40)]
    for place, length in twigs:
        first = len(vertices)
        vertices += [(vertices[place][0], y, 0) for y in (length / 2, length)]
        edges += [(place, first), (first, first + 1)]
    points = np.column_stack([RNG.random(n) * 10, RNG.normal(size=(n, 2)) * SCATTER / np.sqrt(2)])
    vertex = np.abs(points[:, :1] - np.linspace(0, 10, 41)).argmin(axis=1)
    sure = np.where(np.arange(len(vertices)) < 41, confidence, 0.0)
    radius = SCATTER if confidence else MEDIAN * SCATTER
    return Skeleton(vertices, edges, np.full(len(vertices), radius), vertex, points, points, confidence=sure)


def test_spread_is_the_median_distance():
    np.testing.assert_allclose(spread_around(limb())[2:-2], MEDIAN * SCATTER, rtol=0.2)


def test_outliers_have_little_say_in_it():
    raw = limb()
    points = raw.points.copy()
    points[::20, 1] += 99
    np.testing.assert_allclose(spread_around(replace(raw, points=points))[2:-2], MEDIAN * SCATTER, rtol=0.3)


@pytest.mark.parametrize(("length", "stays"), [(1.5, False), (2.4, False), (3.2, True), (20, True)])
def test_a_twig_must_leave_the_scatter_of_its_limb(length, stays):
    """Of 2000 points one is expected beyond 2.76 times the root mean square distance."""
    left = drop(limb((20, length * SCATTER)), 1.3)
    assert len(left.leaves) == (3 if stays else 2)
    assert len(left.vertices) == (43 if stays else 41)
    assert (left.vertex_of_point >= 0).all()


def test_points_of_a_twig_belong_to_where_it_grew_from():
    raw = limb((20, 1.5 * SCATTER))
    vertex = raw.vertex_of_point.copy()
    vertex[vertex == 20] = 42
    left = drop(replace(raw, vertex_of_point=vertex), 1.3)
    np.testing.assert_array_equal(left.vertex_of_point, raw.vertex_of_point)


def test_many_at_one_fork_go_one_after_another():
    left = drop(limb((20, SCATTER), (20, -1.5 * SCATTER), (20, 2 * SCATTER), (30, 9 * SCATTER)), 1.3)
    assert len(left.leaves) == 3
    np.testing.assert_array_equal(left.vertices[:41], limb().vertices)


@pytest.mark.parametrize(("length", "stays"), [(1.2, False), (1.4, True)])
def test_beside_a_surface_its_radius_counts(length, stays):
    left = drop(limb((20, length * SCATTER), confidence=1.0), 1.3)
    assert len(left.leaves) == (3 if stays else 2)


def test_what_has_a_surface_stays_and_so_does_the_root():
    short = limb((20, SCATTER))
    sure = replace(short, confidence=np.ones(43))
    assert drop(sure, 1.3) is sure
    assert drop(short, 1.3, root=42) is short
    assert drop(short, 1.3, root=41) is short  # inside the twig


def test_without_branches_there_is_nothing_to_drop():
    line = limb()
    assert drop(line, 1.3) is line


@pytest.mark.parametrize("seed", range(3))
def test_noise_as_wide_as_twigs_makes_half_as_many_false_tips(seed, monkeypatch):
    points, true = samples.tree(8192, forks=5, noise=0.002, seed=seed).points, 33
    left = pipelines.tree()(points)
    assert left.report.n_traced > 1000
    monkeypatch.setattr(tracing, "drop_spurious", lambda skeleton, *_: (skeleton, np.arange(len(skeleton.vertices))))
    assert true < len(left.leaves) < true + 0.6 * (len(pipelines.tree()(points).leaves) - true)
