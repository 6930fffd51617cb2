"""Farthest-point sampling against brute force."""

import numpy as np
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


@settings(max_examples=100)
@given(arrays(float, st.tuples(st.integers(1, 30), st.just(3)), elements=st.integers(-3, 3)), st.data())
def test_samples_are_those_of_brute_force_and_their_balls_hold_all_points(points, data):
    radius = data.draw(arrays(float, len(points), elements=st.sampled_from([0.25, 0.5, 1.0, 2.0, 3.0])))
    samples, representative = farthest_point_sampling(points, radius)
    expected, expected_owner = brute_force(points, radius)
    assert samples.tolist() == expected
    np.testing.assert_array_equal(representative, expected_owner)
    distance = cdist(points, points[samples]) / radius[samples]
    own = distance[np.arange(len(points)), representative]
    assert (own <= 1).all()
    np.testing.assert_array_equal(own, distance.min(axis=1))
