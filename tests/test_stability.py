"""The topology does not hang on roundings: points that move by next to nothing give the same graph."""

import warnings

import numpy as np
import pytest

import glsk_o3d as glsk
from glsk_o3d import samples

JITTER = 1e-7  # of the diagonal


def topology(points):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", glsk.SkeletonWarning)
        skeleton = glsk.skeletonize(points)
    return skeleton.n_components, skeleton.n_loops, len(skeleton.leaves)


@pytest.mark.parametrize("name", ["torus", "helix", "y_junction", "two_rings", "tube", "sauropod"])
def test_jitter_changes_nothing(name):
    points = getattr(samples, name)(2000).points
    size = JITTER * np.linalg.norm(np.ptp(points, axis=0))
    found = {topology(points)}
    for seed in range(3):
        found.add(topology(points + size * np.random.default_rng(seed).normal(size=points.shape)))
    assert len(found) == 1
