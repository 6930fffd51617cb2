"""Traced twigs that are the scatter of points go, those that reach farther stay."""

from dataclasses import replace

import numpy as np
import pytest

from glsk_o3d import Skeleton
from glsk_o3d.curve.curve import Curve
from glsk_o3d.curve.thin.trace import drop_spurious

SCATTER = 0.1  # root mean square distance
MEDIAN = np.sqrt(np.log(2))  # over that


def limb(*twigs, confidence=0.0, n=2000):
    """A straight limb of 41 vertices along x, points that scatter around it, and twigs (place, length) along y."""
    rng = np.random.default_rng(0)
    vertices = [(x, 0, 0) for x in np.linspace(0, 10, 41)]
    edges = [(i, i + 1) for i in range(40)]
    for place, length in twigs:
        first = len(vertices)
        vertices += [(vertices[place][0], y, 0) for y in (length / 2, length)]
        edges += [(place, first), (first, first + 1)]
    points = np.column_stack([rng.random(n) * 10, rng.normal(size=(n, 2)) * SCATTER / np.sqrt(2)])
    vertex = np.abs(points[:, :1] - np.linspace(0, 10, 41)).argmin(axis=1)
    sure = np.where(np.arange(len(vertices)) < 41, confidence, 0.0)
    radius = SCATTER if confidence else MEDIAN * SCATTER
    return Curve.of(Skeleton(vertices, edges, np.full(len(vertices), radius), vertex, points, (), confidence=sure))


def drop(skeleton, root=None):
    """Without spurious twigs, all of no confidence being traced."""
    kept, stays = drop_spurious(skeleton, skeleton.confidence == 0, 1.3, root)
    np.testing.assert_array_equal(kept.vertices, skeleton.vertices[stays])
    return kept


@pytest.mark.parametrize(
    ("confidence", "length", "stays"),
    [(0, 1.5, False), (0, 2.4, False), (0, 3.2, True), (0, 20, True), (1, 1.2, False), (1, 1.4, True)],
)
def test_a_twig_stays_if_it_leaves_the_scatter_of_its_limb(confidence, length, stays):
    """Of 2000 points one is expected beyond 2.76 times the root mean square; beside a surface its radius counts."""
    kept = drop(limb((20, length * SCATTER), confidence=confidence))
    assert len(kept.leaves) == (3 if stays else 2)
    assert len(kept.vertices) == (43 if stays else 41)
    assert (kept.vertex_of_point >= 0).all()


def test_spurious_twigs_at_one_fork_go_one_after_another():
    kept = drop(limb((20, SCATTER), (20, -1.5 * SCATTER), (20, 2 * SCATTER), (30, 4 * SCATTER)))
    assert len(kept.leaves) == 3
    np.testing.assert_array_equal(kept.vertices[:41], limb().vertices)


def test_a_twig_with_a_surface_or_the_root_stays():
    short = limb((20, SCATTER))
    sure = replace(short, confidence=np.ones(43))
    assert drop(sure) is sure
    assert drop(short, root=42) is short
    assert drop(short, root=41) is short  # inside the twig
