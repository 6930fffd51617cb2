"""Farthest-point sampling against brute force."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.distance import cdist

from glsk_o3d.geometry.farthest_point import farthest_point_sampling


def brute_force(points, radius):
    """The definition, with every distance: O(n m)."""
    sample = int(np.argmax(((points - points.mean(axis=0)) ** 2).sum(axis=1)))
    nearest, representative, samples = np.full(len(points), np.inf), np.zeros(len(points), int), []
    while nearest[sample] > 1:
        distance = np.linalg.norm(points - points[sample], axis=1) / radius[sample]
        representative[distance < nearest] = len(samples)
        nearest = np.minimum(nearest, distance)
        samples.append(sample)
        sample = int(np.argmax(nearest))
    return samples, representative


@pytest.mark.parametrize("size", [0.02, 0.1, 0.5])
def test_against_brute_force(size):
    rng = np.random.default_rng(1)
    points = rng.normal(size=(700, 3))
    reach = size * np.linalg.norm(np.ptp(points, axis=0))
    for radius in (np.full(len(points), reach), reach * rng.uniform(0.3, 3, len(points))):
        samples, representative = farthest_point_sampling(points, radius)
        expected, expected_owner = brute_force(points, radius)
        assert samples.tolist() == expected
        np.testing.assert_array_equal(representative, expected_owner)


@settings(max_examples=100)
@given(arrays(float, st.tuples(st.integers(1, 30), st.just(3)), elements=st.integers(-3, 3)), st.data())
def test_every_point_lies_in_the_ball_of_its_sample(points, data):
    radius = data.draw(arrays(float, len(points), elements=st.sampled_from([0.25, 0.5, 1.0, 2.0, 3.0])))
    samples, representative = farthest_point_sampling(points, radius)
    expected, expected_owner = brute_force(points, radius)
    assert samples.tolist() == expected
    np.testing.assert_array_equal(representative, expected_owner)
    distance = cdist(points, points[samples]) / radius[samples]
    own = distance[np.arange(len(points)), representative]
    assert (own <= 1).all()
    np.testing.assert_array_equal(own, distance.min(axis=1))
