"""Lengths have no unit of their own: a cloud that is a power of two larger has the same skeleton, to the last bit."""

import numpy as np
import pytest

import glsk_o3d as glsk
from glsk_o3d import samples

LENGTHS = ("vertices", "radii", "half_width", "half_thickness")
pytestmark = pytest.mark.filterwarnings("ignore::glsk_o3d.SkeletonWarning")


def with_hole(points):
    """Without what is near a place on the surface, so that parts end where they should go on."""
    place = points[len(points) // 3]
    away = np.linalg.norm(points - place, axis=1)
    return points[away > np.quantile(away, 0.06)]


CLOUDS = {
    "ring with a gap": with_hole(samples.torus(1500).points),
    "animal": samples.sauropod(1500, noise=0.01).points,
    "animal with a hole": with_hole(samples.sauropod(1500).points),
    "two rings with a gap": with_hole(samples.two_rings(1500).points),
    "crown": samples.tree(800, forks=3, noise=0.005).points,
}


@pytest.mark.parametrize("cloud", CLOUDS)
@pytest.mark.parametrize("pipeline", ["default", "tree", "fast"])
def test_a_scaled_cloud_has_the_scaled_skeleton(cloud, pipeline):
    points = CLOUDS[cloud]
    skeleton = glsk.skeletonize(points, pipeline)
    for scale in (2.0**-10, 2.0**10):
        scaled = glsk.skeletonize(points * scale, pipeline)
        np.testing.assert_array_equal(scaled.edges, skeleton.edges)
        np.testing.assert_array_equal(scaled.vertex_of_point, skeleton.vertex_of_point)
        np.testing.assert_array_equal(scaled.confidence, skeleton.confidence)
        for name in LENGTHS:
            np.testing.assert_array_equal(getattr(scaled, name), getattr(skeleton, name) * scale)
        for decision, other in zip(skeleton.report.decisions, scaled.report.decisions, strict=True):
            assert (other.about, other.probability, other.changed) == (
                decision.about,
                decision.probability,
                decision.changed,
            )


@pytest.mark.parametrize("scale", [1e-115, 1e115])
def test_limbs_of_the_smallest_and_the_largest_have_the_same_probabilities(scale):
    points = samples.sauropod(1500).points
    one, other = ([it.probability for it in glsk.skeletonize(points * by).report.decisions] for by in (1, scale))
    np.testing.assert_allclose(other, one, rtol=1e-6)
