"""The cross-check of a cloud against a mesh: what agrees, what must not, and what cannot be checked."""

import json

import numpy as np
import open3d as o3d
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
from glsk_o3d.apps.crosscheck import cross_check
from glsk_o3d.errors import InvalidCloudError, InvalidParameterError

SPIKY = pytest.mark.filterwarnings("ignore::glsk_o3d.SkeletonWarning")


@pytest.mark.parametrize("shape", ["tube", "helix", "two_rings", "y_junction", "sauropod"])
def test_clean_and_dense_shapes_agree(shape):
    actual = cross_check(samples.SAMPLES[shape](4096).points)
    assert (actual.verdict, actual.reasons) == ("agrees", ())
    assert actual.probability > 0.9
    assert actual.rows.angle["median"] < 10
    assert actual.rows.ratio["median"] == pytest.approx(1, abs=0.1)
    assert actual.rows.eigenvalue_ratio == pytest.approx(1, abs=0.15)
    assert actual.skeletons.distance_in_radii < 0.1


def test_the_angle_shows_where_the_cloud_is_noisy():
    points = samples.torus(4000).points.copy()
    noisy = points[:, 0] < 0
    points[noisy] += np.random.default_rng(0).normal(scale=0.008, size=(noisy.sum(), 3))
    actual = cross_check(points)
    assert np.nanmedian(actual.angle[noisy]) > 3 * np.nanmedian(actual.angle[~noisy])
    assert actual.doubtful[noisy].mean() > 5 * actual.doubtful[~noisy].mean()


@SPIKY
def test_the_solid_has_a_handle_that_the_skeleton_lacks():
    rng = np.random.default_rng(0)  # a washer with a narrow hole
    around, across = rng.uniform(0, 2 * np.pi, (2, 9000))
    kept = rng.uniform(0, 1.6, 9000) < 1 + 0.6 * np.cos(across)
    ring = 0.45 + 0.37 * np.cos(across)
    points = np.column_stack([ring * np.cos(around), ring * np.sin(around), 0.37 * np.sin(across)])[kept]
    actual = cross_check(points, pipeline=pipelines.default().with_options(handle=1.0))  # which closes all loops
    assert (actual.skeleton.n_loops, actual.solid.genus, actual.verdict) == (0, 1, "do not trust")
    assert "loops: 0 in the skeleton, 1 in the mesh" in actual.reasons


# -------------------------------------------------------------------------------------------------------- the numbers


def test_numbers_of_points_fit_the_numbers_of_all(ring, check):
    np.testing.assert_array_equal(check.skeleton.vertices, skeletonize(ring.points).vertices)
    np.testing.assert_array_equal(check.points, ring.points)
    assert np.isfinite(check.angle).all()
    assert check.rows.compared == check.rows.points == len(check.ours.places)
    assert (check.doubtful == (check.angle > 30)).all()
    assert check.theirs.laplacian.shape == (len(check.solid.vertices),) * 2
    facts = json.loads(json.dumps(check.to_dict(), allow_nan=False))
    assert (facts["verdict"], facts["skeletons"]["loops"], facts["mesh"]["genus"]) == ("agrees", [1, 1], 1)
    assert facts["points"] == {"given": 2000, "doubtful": int(check.doubtful.sum())}
    assert len(facts["rows"]["eigenvalues"]) == 50


def test_units_place_turn_and_order_do_not_matter(ring, check):
    order = np.random.default_rng(0).permutation(len(ring.points))
    turn = Rotation.from_rotvec([0.3, -1, 2]).as_matrix()
    moved = cross_check(1000 * ring.points[order] @ turn.T + [5e5, 4e6, 300])
    assert moved.verdict == check.verdict
    # the octree of the reconstruction lies along the axes
    assert moved.rows.eigenvalue_ratio == pytest.approx(check.rows.eigenvalue_ratio, abs=0.02)
    assert moved.skeletons.distance_in_radii == pytest.approx(check.skeletons.distance_in_radii, abs=0.02)
    scaled = cross_check(8.0 * ring.points)
    np.testing.assert_allclose(scaled.angle, check.angle, atol=1e-3)
    assert scaled.solid.parts[0].volume == pytest.approx(512 * check.solid.parts[0].volume, rel=1e-6)


def test_another_pipeline(ring):
    pipeline = (
        RingBuilder() | Contractor(reducer=LPRReducer()) | LPRReducer() | Connector() | Refiner(collapse="degree")
    )
    actual = cross_check(ring.points, pipeline=pipeline)
    np.testing.assert_array_equal(actual.skeleton.vertices, skeletonize(ring.points, pipeline).vertices)
    mesh = actual.mesh_skeleton.report.stages
    assert not any("LPRReducer" in stage for stage in mesh)  # without reductions
    assert mesh[-1].startswith("Refiner(collapse='degree'")


# ---------------------------------------------------------------------------------------------------------- the meshes


def test_a_cloud_that_is_a_mesh_is_checked_against_itself(even_ball):
    vertices, faces = even_ball(3000)
    vertices = vertices * [0.4, 0.4, 3]
    mesh = o3d.geometry.TriangleMesh(o3d.utility.Vector3dVector(vertices), o3d.utility.Vector3iVector(faces))
    actual = cross_check(mesh)
    assert (actual.verdict, actual.solid.made_by) == ("agrees", "given")
    assert actual.solid.parts[0].volume == pytest.approx(0.4 * 0.4 * 3 * np.pi / 6, rel=0.01)
    assert cross_check(mesh, mesh="poisson").solid.made_by == "poisson"
    actual = cross_check(vertices, mesh=(vertices, faces))
    assert (actual.verdict, actual.solid.made_by) == ("agrees", "given")


@SPIKY
def test_a_coarse_mesh_of_the_users_is_refined_or_refused():
    bar = o3d.geometry.TriangleMesh.create_box(1, 1, 6)
    actual = cross_check(bar)
    assert (actual.verdict, actual.solid.made_by, actual.solid.parts[0].volume) == ("agrees", "given", pytest.approx(6))
    comb = [o3d.geometry.TriangleMesh.create_box(0.01, 1, 0.01).translate((i / 100, 0, 0)) for i in range(600)]
    coarse = sum(comb, o3d.geometry.TriangleMesh())
    cloud = np.asarray(coarse.sample_points_uniformly(20000).points)
    with pytest.raises(InvalidParameterError, match=r"^mesh: it has no triangles, or edges too long"):
        cross_check(cloud, mesh=coarse)


@pytest.mark.parametrize(
    ("wrong", "why"),
    [
        ("marching_cubes", "mesh = 'marching_cubes': must be one of"),
        (np.eye(3), "mesh: it has no triangles"),
        ((np.eye(3), [[0, 1, 2, 0]]), r"mesh: must be vertices \(V, 3\) and faces \(F, 3\)"),
        ((np.eye(3),), "mesh: must be vertices"),
    ],
)
def test_meshes_that_are_none(ring, wrong, why):
    with pytest.raises(InvalidParameterError, match=why):
        cross_check(ring.points, mesh=wrong)


@pytest.mark.parametrize("moved", [lambda v: v + 5, lambda v: 1000 * v, lambda v: v / 1000])
def test_a_mesh_of_something_else(ring, moved):
    mesh = o3d.geometry.TriangleMesh.create_torus(0.4, 0.1, 200, 100)
    with pytest.raises(InvalidParameterError, match="same units and place"):
        cross_check(ring.points, mesh=(moved(np.asarray(mesh.vertices)), np.asarray(mesh.triangles)))


# ---------------------------------------------------------------------------------------------------------- the clouds


def test_points_that_are_not_finite_and_outliers(ring):
    spoilt = np.vstack([ring.points, [[np.nan, 0, 0], [0.45, 0.4, 0.4]]])
    with pytest.raises(InvalidCloudError, match="1 of 2002 points"):
        cross_check(spoilt)
    prepare = Sampler(drop_invalid=True) | OutlierRemover() | RingBuilder()
    pipeline = prepare | Contractor(reducer=LPRReducer()) | Connector() | Refiner()
    actual = cross_check(spoilt, pipeline=pipeline)
    assert np.isnan(actual.angle[2000])
    assert actual.verdict == "agrees"


def test_duplicates_share_their_row(ring):
    actual = cross_check(np.vstack([ring.points, ring.points[:10]]))
    np.testing.assert_array_equal(actual.angle[2000:], actual.angle[:10])


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
