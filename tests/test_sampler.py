"""Sampler: cloud -> points."""

import numpy as np

from glsk_o3d import (
    Connector,
    Contractor,
    Denoiser,
    LPRReducer,
    OutlierRemover,
    Points,
    Refiner,
    RingBuilder,
    Sampler,
    Thinner,
    samples,
)

TORUS = samples.torus(n=600).points


def in_order(points):
    """The working cloud in the user's order and units."""
    return points.frame.out_of(points.cloud)[points.representative_of_point]


def test_a_filter_of_points_takes_a_cloud_too():
    plain = Sampler()(TORUS)
    assert isinstance(plain, Points)
    np.testing.assert_allclose(np.sort(plain.to_point_cloud().points, axis=0), np.sort(TORUS, axis=0), atol=1e-15)
    np.testing.assert_array_equal(RingBuilder()(TORUS).rings.indices, (Sampler() | RingBuilder())(TORUS).rings.indices)


def test_a_large_cloud_is_sampled_and_every_point_has_its_place():
    points = samples.torus(8000, noise=0.001).points
    points[17] = [np.nan, 0, 0]
    points[4000] = [0, 0, 3]
    prepared = Sampler(size=1600, drop_invalid=True) | OutlierRemover() | Denoiser() | Thinner(thin_to=800)
    state = (prepared | RingBuilder())(points)
    assert 800 < state.report.n_sampled < 3 * 1600
    assert state.report.n_contracted <= 800
    assert state.sampled.sum() == state.report.n_distinct
    assert (state.representative_of_point[17], state.outlier[4000]) == (-1, True)
    assert not state.sampled[[17, 4000]].any()
    away = np.linalg.norm(in_order(state) - points, axis=1)
    assert away[state.sampled].max() < 1e-12
    assert np.delete(away, [17, *np.flatnonzero(state.outlier)]).max() < 0.1
    skeleton = (Contractor(reducer=LPRReducer()) | Connector() | Refiner())(state)
    assert skeleton.n_loops == 1
    assert (skeleton.vertex_of_point >= 0).sum() == 7999
    assert len(skeleton.supporting_points) == state.sampled.sum()
    # who says where the surface is has a normal, nobody else
    np.testing.assert_array_equal(np.isfinite(skeleton.normals[:, 0]), state.sampled)
