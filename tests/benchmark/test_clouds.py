"""Clouds: what every variant promises, and that seeds give the same ones for ever."""

import numpy as np
import pytest
from glsk_bench.clouds import VARIANTS, cloud
from glsk_bench.scanning import camera_places, cast, depth_image, seen_cosines
from glsk_bench.shapes import Shape
from glsk_bench.shapes.curves import generator
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from glsk_o3d.errors import InvalidParameterError
from glsk_o3d.samples.capsules import signed_distance, visible

FINGERPRINTS = {
    "clean": "2c7e01348b00a337",
    "density": "0b63bc157f9a3998",
    "holes": "a599036cc4428c01",
    "outliers": "42279e702f94584b",
    "noise05": "a725a0bc93cdfc3c",
    "noise1": "f59de0747cb0a47d",
    "noise2": "fcc8fd19250a0743",
    "scan2": "a88e80f6626c512a",
    "depth2": "3fdce3eb70b16715",
    "misreg": "f316f05cdaa5a4af",
    "lidar": "01dd43b22db34b71",
}
"""Of clouds, to six decimals."""


def distances(one, points):
    return signed_distance(points, one.nodes, one.edges, one.radii)


def rows(one, points):
    """The row of the surface that each point is; -1 where it is none."""
    off, row = cKDTree(one.points).query(points)
    return np.where(off < 1e-12, row, -1)


def cosines(points, normals, eye):
    towards = eye - points
    return (towards * normals).sum(axis=1) / np.linalg.norm(towards, axis=1)


@pytest.fixture(scope="module")
def ball():
    """A ball of diameter 1 with its axis of no length."""
    normals = np.random.default_rng(0).normal(size=(50_000, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    nodes, edges, radii = np.array([[0, 0, 0], [0, 0, 1e-3]]), np.array([[0, 1]]), np.array([0.5, 0.5])
    return Shape("ball_0", "ball", 0, nodes, edges, radii, 0.5 * normals, normals, {"area": np.pi})


# ---------------------------------------------------------------------------------------------------------- all of them


@pytest.mark.parametrize("variant", VARIANTS)
def test_a_cloud_follows_from_its_names_and_numbers(variant, drawn, fingerprint):
    one = drawn("figures", 0)
    before = one.points.copy()
    first = cloud(one, variant, 1000, 5)
    assert (first.shape, first.dtype) == ((1000, 3), np.float64)
    assert fingerprint(first) == FINGERPRINTS[variant]
    np.testing.assert_array_equal(first, cloud(one, variant, 1000, 5))
    np.testing.assert_array_equal(one.points, before)
    assert len(np.unique(first, axis=0)) == 1000
    for other in (cloud(one, variant, 1000, 6), cloud(one, variant, 1001, 5)[:1000]):
        assert not np.allclose(first, other)


@pytest.mark.parametrize("variant", VARIANTS)
def test_tiny_clouds(variant, drawn):
    assert cloud(drawn("handles", 0), variant, 1).shape == (1, 3)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("scan",), "no variant of clouds is called 'scan': did you mean 'scan2'"),
        ((["clean"],), "no variant of clouds is called"),
        (("clean", 0), "n = 0: must be an int of at least 1"),
        (("clean", 10, -1), "seed = -1: must be an int of at least 0"),
        (("clean", 50_001), "handles_0 has 50000 points for a cloud of 50001: ask for fewer points"),
        (("depth2", 100_000), "handles_0: 50000 points of its surface are too few for 50000 rays .* ask for fewer"),
    ],
)
def test_what_makes_no_cloud_is_refused(arguments, message, drawn):
    with pytest.raises(InvalidParameterError, match=message):
        cloud(drawn("handles", 0), *arguments)


# ----------------------------------------------------------------------------------------------------------- one by one


def test_clean_clouds_are_uniform(ball):
    points = cloud(ball, "clean", 4000)
    for axis in range(3):  # equal slices of a sphere have equal areas
        counts = np.histogram(points[:, axis], 10, (-0.5, 0.5))[0]
        assert np.abs(counts - 400).max() < 5 * np.sqrt(400)


def test_density_is_ten_times_higher_at_one_end(drawn):
    one = drawn("figures", 0)
    picked = np.zeros(len(one.points))
    picked[rows(one, cloud(one, "density", 2000))] = 1
    centred = one.points - one.points.mean(axis=0)
    along = centred @ np.linalg.svd(centred, full_matrices=False)[2][0]
    share = (along - along.min()) / np.ptp(along)
    # of what is there, a share of w * c is picked, c the same everywhere; few of many, so that none is used up
    bins = np.minimum((5 * share).astype(int), 4)
    chance = np.bincount(bins, picked) / np.bincount(bins)
    ratio = max(chance[4] / chance[0], chance[0] / chance[4])
    assert ratio == pytest.approx(10**0.8, rel=0.3)
    assert (np.diff(chance) > 0).all() or (np.diff(chance) < 0).all()


def test_holes_are_four_balls(drawn):
    one = drawn("figures", 1)
    points = cloud(one, "holes", 4096, seed=2)
    look = generator("eyes", one.name, "holes", 2)
    for middle in one.points[look.choice(len(one.points), 4, replace=False)]:
        radius = one.radii[np.abs(np.linalg.norm(one.nodes - middle, axis=1) - one.radii).argmin()]
        assert np.linalg.norm(points - middle, axis=1).min() > min(1.3 * radius, 0.15)
    far = cKDTree(points).query(one.points)[0].max()
    assert far > 2 * cKDTree(cloud(one, "clean", 4096, seed=2)).query(one.points)[0].max()


@pytest.mark.parametrize(("variant", "size"), [("noise05", 0.005), ("noise1", 0.01), ("noise2", 0.02)])
def test_noise_is_gaussian_and_as_large_as_said(variant, size, drawn):
    one = drawn("handles", 0)
    points = cloud(one, variant, seed=4)
    rng = generator("cloud", one.name, variant, 4096, 4)
    rng.gumbel(size=len(one.points))  # which points are picked
    noise = rng.normal(0, size, (4096, 3))
    assert (rows(one, points - noise) >= 0).all()
    assert distances(one, points).std() == pytest.approx(size, rel=0.1)


def test_two_cameras_leave_out_what_is_hidden(drawn):
    one = drawn("figures", 1)
    points, axis = cloud(one, "scan2"), (one.nodes, one.edges, one.radii)
    eyes = camera_places(generator("eyes", one.name, "scan2", 0), 2)
    normals = one.normals[rows(one, points)]
    assert np.max([cosines(points, normals, eye) for eye in eyes], axis=0).min() > 0.1
    assert np.any([visible(points, eye, *axis) for eye in eyes], axis=0).mean() > 0.93  # the rest within a few spacings


def test_a_camera_sees_the_front_of_a_ball(ball):
    eye = np.array([0, -2.2, 0])
    cosine = seen_cosines(ball, eye)
    exact = cosines(ball.points, ball.normals, eye)
    np.testing.assert_allclose(cosine, np.where(exact > 0.1, exact, 0), atol=1e-12)


def test_rays_make_a_grid_and_hit_the_surface_and_know_the_background(ball):
    eye = np.array([0, -2.7, 0])
    rays = cast(ball, eye, 2000, (0.5, 2.0), generator("rays"))
    assert len(rays.ranges) >= 2000
    np.testing.assert_allclose(np.linalg.norm(rays.directions, axis=1), 1)
    hit = eye + rays.directions * rays.ranges[:, None]
    off = np.abs(np.linalg.norm(hit, axis=1) - 0.5)
    assert np.median(off) < 1e-4
    assert off[rays.cosines > 0.3].max() < 2e-3
    exact = -(rays.directions * hit).sum(axis=1) / 0.5
    np.testing.assert_allclose(rays.cosines, np.maximum(exact, 0.15), atol=0.06)
    image = rays.directions[:, [0, 2]] / rays.directions[:, 1:2]
    pitch = [np.median(np.diff(np.unique(np.round(column, 9)))) for column in image.T]
    assert pitch[1] / pitch[0] == pytest.approx(4, rel=1e-3)


def test_depth_noise_is_along_the_ray_and_grows_at_grazing_angles(ball):
    eye = np.array([0, -2.7, 0])
    points = np.concatenate([depth_image(ball, eye, 1000, generator("depth", seed)) for seed in range(12)])
    ray = points - eye
    far = np.linalg.norm(ray, axis=1)
    ray /= far[:, None]
    nearest, passing = -ray @ eye, eye @ eye - (ray @ eye) ** 2
    half = np.sqrt(np.maximum(0.25 - passing, 0))
    error, cosine = far - (nearest - half), half / 0.5
    for low, high in ((0.9, 1), (0.6, 0.7), (0.3, 0.4)):
        ring = (cosine > low) & (cosine < high) & (np.abs(error) < 0.02)
        expected = 0.0015 * np.sqrt(np.mean(cosine[ring] ** -2))
        assert error[ring].std() == pytest.approx(expected, rel=0.12)
    flying = error > 0.02
    assert 40 <= flying.sum() <= 60  # half a percent are, some of them less far
    assert np.median(cosine[flying]) < 0.5 < np.median(cosine)  # beside the rim
    assert error[flying].max() < 0.2


def test_views_that_do_not_fit_are_moved_and_turned_as_a_whole(drawn):
    one = drawn("figures", 0)
    points = cloud(one, "misreg", 3000, seed=1)
    look = generator("eyes", one.name, "misreg", 1)
    eyes, errors = camera_places(look, 3), look.normal(size=(3, 2, 3))
    errors /= np.linalg.norm(errors, axis=2, keepdims=True)
    for k, view in enumerate(np.split(points, 3)):
        turn = Rotation.from_rotvec(np.radians(0.5) * errors[k, 0])
        where = rows(one, turn.inv().apply(view - 0.005 * errors[k, 1]) if k else view)
        assert (where >= 0).all()
        assert (seen_cosines(one, eyes[k])[where] > 0.1).all()


def test_laser_scans_are_near_the_surface(drawn):
    one = drawn("handles", 0)
    off = distances(one, cloud(one, "lidar"))
    assert np.abs(off).max() < 0.012
    assert 0.0012 < off.std() < 0.0025
