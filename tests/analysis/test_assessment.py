"""`assess` on closed forms, and what it refuses."""

from dataclasses import replace

import numpy as np
import pytest

from glsk_o3d.analysis import assess
from glsk_o3d.analysis.assessment import cross_sections
from glsk_o3d.errors import InvalidCloudError, InvalidParameterError
from glsk_o3d.samples import helix, sample_object, torus, tube, two_rings, y_junction

LINE = [[0, 0, 0], [1, 0, 0]]


@pytest.mark.parametrize(
    ("d", "lowest", "centredness", "boundedness"),
    [(0, -1, 1, 1), (0, 0, 1, 1), (0.05, -1, 0.5, 1), (0.05, 0, 0.5, 1), (0.1, -1, 0, 1), (0.14, -1, 0, 0)],
)
def test_a_tube_or_half_of_it_and_a_line_beside_its_axis(pipe, axis_of, d, lowest, centredness, boundedness):
    """Every point of an open tube lies on the circle that is fitted: exact however few points there are."""
    assessment = assess(axis_of(pipe, shift=[0, 0, d]), pipe.points[pipe.points[:, 2] > lowest])
    assert assessment.centredness == pytest.approx(centredness, abs=1e-12)
    assert (assessment.boundedness, assessment.topology) == (boundedness, 1)


def test_the_visible_share_of_a_tube_from_outside(pipe):
    """arcsin(r / x) / pi of all directions."""
    for x in (0.11, 0.2, 0.4):
        sections = cross_sections(pipe.nodes + [0, 0, x], [np.array([0, 1])], pipe.points, shortest=0.1)
        visible = 1 - np.average(sections.open_angles, weights=sections.counts) / (2 * np.pi)
        assert visible == pytest.approx(np.arcsin(0.1 / x) / np.pi, rel=0.01)
        np.testing.assert_allclose(sections.radii, 0.1, rtol=1e-9)
        np.testing.assert_allclose(sections.offsets, x, rtol=1e-9)


@pytest.mark.parametrize(("ring_radius", "centredness"), [(0.4, 1), (0.35, 0.5), (0.5, 0)])
def test_a_torus_and_circles_beside_its_axis(ring, axis_of, ring_radius, centredness):
    assessment = assess(axis_of(ring, scale=ring_radius / 0.4), ring.points)
    assert assessment.centredness == pytest.approx(centredness, abs=2e-3)  # a section is a little longer than thin
    assert (assessment.loops, assessment.wide_loops, assessment.topology) == (1, 1, 1)


@pytest.mark.parametrize("make", [tube, torus, helix, y_junction, two_rings, sample_object])
def test_the_axis_of_every_sample_is_good(make, axis_of):
    sample = make(1000)
    assessment = assess(axis_of(sample), sample.points)
    assert assessment.centredness > (0.85 if make is sample_object else 0.97)  # two cameras did not see all of it
    assert assessment.boundedness > 0.94
    assert assessment.topology == 1
    assert assessment.components == assessment.clusters == (2 if make is two_rings else 1)
    assert assessment.loops == assessment.wide_loops == {torus: 1, two_rings: 2, sample_object: 1}.get(make, 0)


def test_a_bridge_through_empty_space_is_outside(pipe, curve):
    """Two tubes end to end, one tube's length apart."""
    both = np.concatenate([pipe.points - [1, 0, 0], pipe.points + [1, 0, 0]])
    assessment = assess(curve([[-1.5, 0, 0], [1.5, 0, 0]]), both)
    assert assessment.boundedness == pytest.approx(2 / 3, abs=0.02)
    assert assessment.centredness == pytest.approx(1, abs=0.02)
    assert (assessment.components, assessment.clusters, assessment.topology) == (1, 2, 0.5)


def test_false_loops_open_less_than_their_tube(pipe, curve):
    square = [[-0.5, 0, 0], [0, -0.03, 0], [0, 0.03, 0], [0.06, 0.03, 0], [0.06, -0.03, 0], [0.5, 0, 0]]
    assessment = assess(curve(square, [[0, 1], [1, 2], [2, 3], [3, 4], [1, 4], [4, 5]]), pipe.points)
    assert (assessment.loops, assessment.wide_loops, assessment.topology) == (1, 0, 0)


def test_narrow_loops_on_the_medial_axis_are_those_of_the_solid(axis_of):
    ring = torus(4000, ring_radius=0.4, radius=0.37)
    inner = axis_of(ring, scale=0.9)
    for on_medial_axis in (False, True):
        assessment = assess(inner.with_facts(on_medial_axis=on_medial_axis), ring.points)
        assert (assessment.loops, assessment.wide_loops, assessment.topology) == (1, 0, on_medial_axis)


def test_assessments_have_no_unit(axis_of):
    sample, scale = sample_object(1000), 1e6
    axis = axis_of(sample)
    large = replace(axis, vertices=axis.vertices * scale + scale)
    near, far = assess(axis, sample.points), assess(large, sample.points * scale + scale)
    assert near.clusters == far.clusters == 1
    for name in ("centredness", "boundedness", "topology"):
        assert getattr(far, name) == pytest.approx(getattr(near, name), rel=1e-6)


def test_outliers_and_points_that_are_not_finite(pipe, axis_of):
    assessment = assess(axis_of(pipe), np.concatenate([pipe.points, [[0, 3, 0], [np.nan, 0, 0], [0, 0, -np.inf]]]))
    assert assessment.centredness == pytest.approx(1, abs=1e-12)
    assert assessment.boundedness == assessment.topology == 1


@pytest.mark.parametrize(("offset", "centredness"), [(0, 1), (1, 0)])
def test_points_in_a_row_have_sections_without_a_radius(offset, centredness, curve):
    row = np.linspace(*LINE, 200) + np.cross(np.subtract(*LINE), [1, 2, 3]) * offset
    assert assess(curve(LINE), row).centredness == centredness


@pytest.mark.parametrize(
    ("vertices", "cloud", "error"),
    [
        *((LINE, cloud, InvalidCloudError) for cloud in (np.zeros((20, 3)), np.full((20, 3), np.nan), np.eye(3))),
        *((LINE, cloud, InvalidCloudError) for cloud in (1e200 * np.eye(3), 1e-200 * np.eye(3), [[1e200, 0, 0]])),
        *((nodes, np.eye(3), InvalidParameterError) for nodes in ([[0, 0, 0]], [[1, 1, 1]] * 2, np.empty((0, 3)))),
    ],
)
def test_clouds_that_are_elsewhere_or_too_large_and_curves_without_length_are_refused(vertices, cloud, error, curve):
    with pytest.raises(error):
        assess(curve(vertices), np.array(cloud))
