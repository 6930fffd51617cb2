"""The cross-check of a cloud against a mesh: what agrees, what must not, and what cannot be checked."""

import json
import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from glsk_o3d import (
    Connector,
    Contractor,
    LPRReducer,
    OutlierRemover,
    Refiner,
    RingBuilder,
    Sampler,
    pipelines,
    samples,
    skeletonize,
)
from glsk_o3d.crosscheck import CrossCheck, cross_check
from glsk_o3d.crosscheck.agreement import compare_rows, compare_skeletons
from glsk_o3d.crosscheck.mesh import ball_pivoting
from glsk_o3d.errors import InvalidCloudError, InvalidParameterError, SkeletonWarning

SPIKY = pytest.mark.filterwarnings("ignore::glsk_o3d.SkeletonWarning")


@pytest.mark.parametrize("shape", ["tube", "helix", "two_rings"])
def test_clean_and_dense_shapes_agree(shape):
    found = cross_check(samples.SAMPLES[shape](3000).points)
    assert (found.verdict, found.reasons) == ("agrees", ())
    assert found.rows.covered > 0.8
    assert found.rows.angle["median"] < 0.1
    assert found.skeletons.distance_in_radii < 0.05


def test_it_tells_where_the_cloud_is_noisy():
    points = samples.torus(3000).points.copy()
    noisy = points[:, 0] < 0
    points[noisy] += np.random.default_rng(0).normal(scale=0.008, size=(noisy.sum(), 3))
    found = cross_check(points)
    assert found.verdict == "agrees in part"
    assert found.doubtful[noisy].mean() > 0.5
    assert found.doubtful[~noisy].mean() < 0.2
    assert np.nanmedian(found.angle[noisy]) > 10 * np.nanmedian(found.angle[~noisy])


@SPIKY
@pytest.mark.parametrize(
    ("verdict", "shape", "n", "noise"), [("do not trust", "sheet", 1024, 0), ("cannot tell", "torus", 1024, 0.08)]
)
def test_too_sparse_too_noisy_or_without_a_curve(verdict, shape, n, noise):
    assert cross_check(samples.SAMPLES[shape](n, noise=noise).points).verdict == verdict


# -------------------------------------------------------------------------------------------------------- the numbers


def test_flat_rows_have_one_direction(grid):
    x, y = (each.ravel() + 0.0 for each in np.mgrid[:12, :12])
    points = np.column_stack([x, y, 0.4 * x])
    state = RingBuilder()(points)
    faces = np.lexsort(state.points[state.point_of_survivor].T[1::-1])[grid(12, 12, 0, 0)]
    angle, found = compare_rows(state, faces)
    compared = np.isfinite(angle)
    assert compared.sum() == found.compared > 50
    assert (angle[compared] == 0).mean() > 0.9


def test_the_unsupported_end_of_either_skeleton_counts(make):
    def path(end):
        line = make(np.column_stack([np.linspace(0, end, 50), np.zeros((50, 2))]), np.arange(49)[:, None] + [0, 1])
        return replace(line, radii=np.full(50, 0.5))

    for ours, theirs in ((1, 3), (3, 1)):
        found = compare_skeletons(path(ours), path(theirs), 0.006)
        # of 3 units the last 2 are up to 2 from the other, whose radius is the same
        assert found.hausdorff95_in_radii == pytest.approx(1.85 / 0.5, rel=0.01)


def test_numbers_of_points_fit_the_numbers_of_all(ring, check):
    np.testing.assert_array_equal(check.skeleton.vertices, skeletonize(ring.points).vertices)
    np.testing.assert_array_equal(check.points, ring.points)
    compared = np.isfinite(check.angle)
    assert check.rows.compared == compared.sum()
    assert check.rows.covered == compared.sum() / check.rows.closed
    assert (check.doubtful == (~compared | (check.angle > 30))).all()
    told = json.loads(json.dumps(check.to_dict(), allow_nan=False))
    assert (told["verdict"], told["skeletons"]["loops"]) == ("agrees", [1, 1])
    assert told["points"]["not_compared"] == (~compared).sum()


def test_units_place_turn_and_order_do_not_matter(ring, check):
    order = np.random.default_rng(0).permutation(len(ring.points))
    turn = Rotation.from_rotvec([0.3, -1, 2]).as_matrix()
    moved = cross_check(1000 * ring.points[order] @ turn.T + [5e5, 4e6, 300])
    assert moved.verdict == check.verdict
    # ties in Morton order and in the balls' way may fall differently, so not to the last digit
    assert moved.rows.covered == pytest.approx(check.rows.covered, abs=0.03)
    assert moved.skeletons.distance_in_radii == pytest.approx(check.skeletons.distance_in_radii, abs=0.01)
    scaled = cross_check(8.0 * ring.points)
    np.testing.assert_allclose(scaled.angle, check.angle, atol=1e-4)
    assert scaled.skeletons.distance_in_radii == pytest.approx(check.skeletons.distance_in_radii, rel=1e-6)


def test_another_pipeline(ring):
    pipeline = (
        RingBuilder() | Contractor(reducer=LPRReducer()) | LPRReducer() | Connector() | Refiner(collapse="degree")
    )
    found = cross_check(ring.points, pipeline=pipeline)
    np.testing.assert_array_equal(found.skeleton.vertices, skeletonize(ring.points, pipeline).vertices)
    mesh, cloud = found.mesh_skeleton.report.stages, found.skeleton.report.stages
    assert mesh[0].startswith("Contractor(reducer=None, ")  # without reductions
    assert mesh[1] == cloud[-2]
    assert mesh[2].startswith("Refiner(collapse='degree'")


# ---------------------------------------------------------------------------------------------------------- the meshes


def test_rows_beside_a_hole_and_a_fin_are_not_compared(ring):
    state = RingBuilder()(ring.points)
    vertices, whole = state.cloud, ball_pivoting(state)
    hole = vertices[:, 0] > 0.6 * vertices[:, 0].max()
    faces = whole[~hole[whole].any(axis=1)]
    i, j = faces[0, :2]
    fin = [i, j, np.flatnonzero(~hole & ~np.isin(np.arange(len(hole)), faces[:50]))[0]]
    before, _ = compare_rows(state, whole)
    angle, _ = compare_rows(state, np.vstack([faces, [fin]]))
    assert np.isnan(angle[hole]).all()
    assert np.isnan(angle[fin]).all()
    assert np.isnan(angle).sum() < np.isnan(before).sum() + 1.5 * hole.sum() + 20
    kept = np.isfinite(angle)
    np.testing.assert_allclose(angle[kept], before[kept], atol=1e-6)


# ---------------------------------------------------------------------------------------------------------- the clouds


def test_large_clouds_are_thinned_and_the_user_is_told(ring, monkeypatch):
    monkeypatch.setattr(sys.modules[CrossCheck.__module__], "MOST_POINTS", 1000)
    spoilt = np.vstack([ring.points, [[np.nan, 0, 0]]])
    with pytest.warns(SkeletonWarning, match="1000 of 1500 points are checked") as caught:
        found = cross_check(spoilt, pipeline=pipelines.default().with_options(drop_invalid=True))
    assert caught[0].filename == __file__
    assert (found.n_input, len(found.points), np.isnan(found.points).any(axis=1).sum()) == (1501, 1001, 1)
    assert len(np.unique(found.points[:-1], axis=0)) == 1000
    assert {tuple(point) for point in found.points[:-1]} <= {tuple(point) for point in ring.points}
    assert found.skeletons.loops == (1, 1)


def test_points_that_are_not_finite_and_outliers(ring, check):
    spoilt = np.vstack([ring.points, [[np.nan, 0, 0], [0.45, 0.4, 0.4]]])
    with pytest.raises(InvalidCloudError, match="1 of 1502 points"):
        cross_check(spoilt)
    prepare = Sampler(drop_invalid=True) | OutlierRemover() | RingBuilder()
    pipeline = prepare | Contractor(reducer=LPRReducer()) | Connector() | Refiner()
    found = cross_check(spoilt, pipeline=pipeline)
    assert np.isnan(found.angle[1500:]).all()
    np.testing.assert_allclose(found.angle[:1500], check.angle, atol=1e-3)


def test_duplicates_share_their_row(ring, check):
    found = cross_check(np.vstack([ring.points, ring.points[:10]]))
    np.testing.assert_array_equal(found.angle[1500:], found.angle[:10])


@SPIKY
def test_clouds_without_a_surface():
    line = np.column_stack([np.linspace(0, 1, 50), np.zeros(50), np.zeros(50)])
    for wrong in (line, np.eye(3), np.empty((0, 3))):
        with pytest.raises(InvalidCloudError):
            cross_check(wrong)


@pytest.mark.parametrize(
    "pipeline",
    [Contractor() | Connector(), RingBuilder() | Contractor(), RingBuilder() | Connector() | Refiner(), "none", None],
)
def test_useless_pipelines(ring, pipeline):
    with pytest.raises(InvalidParameterError, match=r"pipeline|lead from a cloud"):
        cross_check(ring.points, pipeline=pipeline)
