"""The cross-check of a cloud against a mesh: what agrees, what must not, and what cannot be checked."""

import json
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
    samples,
    skeletonize,
)
from glsk_o3d.crosscheck import cross_check
from glsk_o3d.crosscheck.agreement import compare_rows, compare_skeletons, mesh_fit
from glsk_o3d.crosscheck.mesh import ball_pivoting, spacing
from glsk_o3d.crosscheck.mesh_rings import border_lengths
from glsk_o3d.errors import InvalidCloudError, InvalidParameterError, SkeletonWarning

SPIKY = pytest.mark.filterwarnings("ignore::glsk_o3d.SkeletonWarning")


@pytest.mark.parametrize("shape", ["tube", "helix", "two_rings"])
def test_clean_and_dense_shapes_agree(shape):
    found = cross_check(samples.SAMPLES[shape](3000).points)
    assert (found.verdict, found.reasons, found.surface) == ("agrees", (), "ball_pivoting")
    assert found.rows.one_to_one
    assert found.rows.covered > 0.8
    assert found.rows.same_rings > 0.5
    assert found.rows.angle["median"] < 0.1
    assert found.skeletons.distance_in_radii < 0.05


def test_noise_turns_the_rows_before_it_moves_the_skeleton():
    found = cross_check(samples.torus(2048, noise=0.0025).points)
    assert (found.verdict, found.surface) == ("agrees in part", "poisson")
    assert found.rows.angle["median"] > 15
    assert found.skeletons.distance_in_radii < 0.1
    assert len(found.reasons) == 1
    assert "a quarter of the Laplacian coordinates" in found.reasons[0]


def test_it_tells_where_the_cloud_is_noisy():
    points = samples.torus(3000).points.copy()
    noisy = points[:, 0] < 0
    points[noisy] += np.random.default_rng(0).normal(scale=0.008, size=(noisy.sum(), 3))
    found = cross_check(points)
    assert found.verdict == "agrees in part"
    assert found.doubtful[noisy].mean() > 0.5
    assert found.doubtful[~noisy].mean() < 0.05
    assert np.nanmedian(found.angle[noisy]) > 10 * np.nanmedian(found.angle[~noisy])


@SPIKY
@pytest.mark.parametrize(
    ("verdict", "shape", "n", "noise"),
    [
        ("do not trust", "sheet", 1024, 0),
        ("do not trust", "sauropod", 128, 0),
        ("cannot tell", "torus", 1024, 0.08),
    ],
)
def test_too_sparse_too_noisy_or_without_a_curve(verdict, shape, n, noise):
    assert cross_check(samples.SAMPLES[shape](n, noise=noise).points).verdict == verdict


def test_the_fit_of_meshes_that_are_known(ring, check):
    state = RingBuilder()(ring.points)
    vertices = state.frame.into(check.vertices)
    whole = mesh_fit(state, vertices, check.faces)
    assert (whole.far, whole.pieces, whole.parts, whole.torn) == (0, 1, 1, 0)
    assert whole.open < 0.02
    cut = np.abs(vertices[check.faces].mean(axis=1)[:, 0]) > 0.1  # a slab of the ring is missing, and so two pieces
    fit = mesh_fit(state, vertices, check.faces[cut])
    off = np.abs(vertices[:, 0]) < 0.1 - spacing(vertices)
    assert (fit.pieces, fit.parts) == (2, 1)
    assert 0.4 < fit.torn <= 0.5
    assert off.mean() / 2 < fit.far < off.mean() * 2
    assert fit.open > whole.open + 0.05
    apart = np.abs(ring.points[:, 0]) > 0.1
    fit = mesh_fit(RingBuilder()(ring.points[apart]), vertices, check.faces[cut])
    assert (fit.pieces, fit.parts, fit.torn) == (2, 2, 0)


def test_open_ends_that_the_cloud_has_too_are_not_held_against_a_mesh():
    tube = samples.tube(2000, capped=False)
    found = cross_check(tube.points, "ball_pivoting")
    assert border_lengths(len(found.vertices), found.faces).max() > 12
    assert found.fit.open < 0.05


# -------------------------------------------------------------------------------------------------------- the numbers


def test_flat_rows_have_one_direction(grid):
    x, y = (each.ravel() + 0.0 for each in np.mgrid[:12, :12])
    points = np.column_stack([x, y, 0.4 * x])
    state = RingBuilder()(points)
    faces = np.lexsort(state.points[state.point_of_survivor].T[1::-1])[grid(12, 12, 0, 0)]
    angle, found = compare_rows(state, state.cloud, faces)
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
    assert (told["verdict"], told["skeletons"]["loops"], told["rows"]["one_to_one"]) == ("agrees", [1, 1], True)
    assert told["points"]["not_compared"] == (~compared).sum()


def test_units_place_turn_and_order_do_not_matter(ring, check):
    order = np.random.default_rng(0).permutation(len(ring.points))
    turn = Rotation.from_rotvec([0.3, -1, 2]).as_matrix()
    moved = cross_check(1000 * ring.points[order] @ turn.T + [5e5, 4e6, 300])
    assert moved.verdict == check.verdict
    # ties in Morton order and in the balls' way may fall differently, so not to the last digit
    assert moved.rows.covered == pytest.approx(check.rows.covered, abs=0.03)
    assert moved.rows.same_rings == pytest.approx(check.rows.same_rings, abs=0.05)
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


def test_rows_of_a_mesh_of_other_points(ring, grid):
    """A fine regular mesh of the same torus: curvature normals are compared, interpolated."""
    radius, width = np.linalg.norm(ring.nodes[0]), ring.radii[0]
    u, v = (each.ravel() * 2 * np.pi / m for each, m in zip(np.mgrid[:160, :40], (160, 40), strict=True))
    out = radius + width * np.cos(v)
    state = RingBuilder()(ring.points)
    vertices = state.frame.into(np.stack([out * np.cos(u), out * np.sin(u), width * np.sin(v)], axis=1))
    angle, found = compare_rows(state, vertices, grid(160, 40, 1, 1))
    assert (found.one_to_one, found.same_rings, found.covered) == (False, None, 1)
    assert found.angle["median"] == pytest.approx(np.nanmedian(angle))
    assert found.angle["median"] < 5


def test_rows_beside_a_hole_and_a_fin_are_not_compared(ring):
    state = RingBuilder()(ring.points)
    vertices, whole = ball_pivoting(state)
    hole = vertices[:, 0] > 0.6 * vertices[:, 0].max()
    faces = whole[~hole[whole].any(axis=1)]
    i, j = faces[0, :2]
    fin = [i, j, np.flatnonzero(~hole & ~np.isin(np.arange(len(hole)), faces[:50]))[0]]
    before, _ = compare_rows(state, vertices, whole)
    angle, found = compare_rows(state, vertices, np.vstack([faces, [fin]]))
    assert found.one_to_one
    assert np.isnan(angle[hole]).all()
    assert np.isnan(angle[fin]).all()
    assert np.isnan(angle).sum() < np.isnan(before).sum() + 1.5 * hole.sum() + 20
    kept = np.isfinite(angle)
    np.testing.assert_allclose(angle[kept], before[kept], atol=1e-6)


def test_poisson_and_a_single_method(ring):
    found = cross_check(ring.points, "poisson")
    assert (found.surface, found.verdict, found.rows.one_to_one) == ("poisson", "agrees", False)
    noisy = cross_check(samples.torus(1500, noise=0.02).points, "ball_pivoting")
    assert noisy.surface == "ball_pivoting"
    assert noisy.rows.covered < 0.7


def test_an_unknown_method(ring):
    with pytest.raises(InvalidParameterError, match="method = 'alpha': must be 'auto' or 'ball_pivoting' or 'poisson'"):
        cross_check(ring.points, "alpha")


# ---------------------------------------------------------------------------------------------------------- the clouds


def test_large_clouds_are_thinned_and_the_user_is_told(ring):
    with pytest.warns(SkeletonWarning, match="1000 of 1500 points .*max_points") as caught:
        found = cross_check(ring.points, max_points=1000)
    assert caught[0].filename == __file__
    assert (found.n_input, len(found.points)) == (1500, 1000)
    assert len(np.unique(found.points, axis=0)) == 1000
    assert {tuple(point) for point in found.points} <= {tuple(point) for point in ring.points}
    assert found.skeletons.loops == (1, 1)
    assert cross_check(ring.points, max_points=None).n_input == 1500
    for wrong in (7, 0, 1.5, "all"):
        with pytest.raises(InvalidParameterError, match="max_points"):
            cross_check(ring.points, max_points=wrong)


def test_points_that_are_not_finite_and_outliers(ring, check):
    spoilt = np.vstack([ring.points, [[np.nan, 0, 0], [0.45, 0.4, 0.4]]])
    with pytest.raises(InvalidCloudError, match="1 of 1502 points"):
        cross_check(spoilt)
    prepare = Sampler(drop_invalid=True) | OutlierRemover() | RingBuilder()
    pipeline = prepare | Contractor(reducer=LPRReducer()) | Connector() | Refiner()
    found = cross_check(spoilt, pipeline=pipeline)
    assert np.isnan(found.angle[1500:]).all()
    np.testing.assert_allclose(found.angle[:1500], check.angle, atol=1e-3)
    with pytest.warns(SkeletonWarning):
        thinned = cross_check(spoilt, pipeline=pipeline, max_points=1000)
    assert np.isnan(thinned.points).any(axis=1).sum() == 1
    assert len(thinned.points) == 1001


@SPIKY
def test_where_poisson_fails_the_balls_surface_is_better_than_none():
    ring = samples.torus(500).points
    far = np.vstack([ring, ring + [300, 0, 0]])  # cells as wide as a ring
    found = cross_check(far)
    assert found.surface == "ball_pivoting"
    assert found.rows.compared > 200
    assert found.skeletons.components == (2, 2)
    with pytest.raises(InvalidCloudError, match="1000 points: poisson"):
        cross_check(far, "poisson")


def test_duplicates_share_their_row(ring, check):
    found = cross_check(np.vstack([ring.points, ring.points[:10]]))
    np.testing.assert_array_equal(found.angle[1500:], found.angle[:10])


@SPIKY
def test_clouds_without_a_surface():
    line = np.column_stack([np.linspace(0, 1, 50), np.zeros(50), np.zeros(50)])
    with pytest.raises(InvalidCloudError, match="50 points"):
        cross_check(line, "ball_pivoting")
    found = cross_check(np.column_stack([np.linspace(0, 1, 500), np.zeros((500, 2))]))  # Poisson invents one
    assert found.rows.compared == 0
    assert found.verdict == "cannot tell"
    assert "no Laplacian coordinates could be compared" in found.reasons
    for wrong in (np.eye(3), np.empty((0, 3))):
        with pytest.raises(InvalidCloudError):
            cross_check(wrong)


@pytest.mark.parametrize(
    "pipeline",
    [Contractor() | Connector(), RingBuilder() | Contractor(), RingBuilder() | Connector() | Refiner(), "none", None],
)
def test_useless_pipelines(ring, pipeline):
    with pytest.raises(InvalidParameterError, match=r"pipeline|lead from a cloud"):
        cross_check(ring.points, pipeline=pipeline)
