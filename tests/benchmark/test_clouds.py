"""Clouds: what every variant promises, how much of the axis they show, and that seeds give the same ones for ever."""

import numpy as np
import pytest
from glsk_bench.clouds import VARIANTS, cloud, coverage
from glsk_bench.scanning import depth_image, mixed_image, seen_cosines
from glsk_bench.shapes import Shape
from glsk_bench.shapes.axis import Axis, joined
from glsk_bench.shapes.curves import generator
from glsk_bench.shapes.surface import surface
from scipy.spatial import cKDTree

from glsk_o3d.errors import InvalidParameterError
from glsk_o3d.samples.capsules import signed_distance

FINGERPRINTS = {
    "clean": "44331912be921827",
    "density": "1b904d77f3bb1486",
    "holes": "34d70f61e063a3fb",
    "outliers": "a9c8af257d7cb147",
    "noise05": "0f1a43c6cae37cdb",
    "noise1": "a4024cfd02c39785",
    "noise2": "9998480a9590a656",
    "scan2": "67a7d956762822f5",
    "depth2": "0b1d579a4a066bdf",
    "misreg": "ee9b329a110f654a",
    "lidar": "53f15c38965978d9",
    "flying": "928b72c105c69e82",
}
"""Of clouds, to four decimals."""


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


@pytest.mark.parametrize(("variant", "size"), [("noise05", 0.005), ("noise1", 0.01), ("noise2", 0.02)])
def test_noise_is_gaussian_and_as_large_as_said(variant, size, drawn):
    one = drawn("handles", 0)
    points = cloud(one, variant, seed=4)
    rng = generator("cloud", one.name, variant, 4096, 4)
    rng.gumbel(size=len(one.points))  # which points are picked
    noise = rng.normal(0, size, (4096, 3))
    assert (rows(one, points - noise) >= 0).all()
    assert distances(one, points).std() == pytest.approx(size, rel=0.1)


def test_a_camera_sees_the_front_of_a_ball(ball):
    eye = np.array([0, -2.2, 0])
    cosine = seen_cosines(ball, eye)
    exact = cosines(ball.points, ball.normals, eye)
    np.testing.assert_allclose(cosine, np.where(exact > 0.1, exact, 0), atol=1e-12)


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


@pytest.mark.parametrize("share", [0.02, 0.08])
def test_mixed_pixels_hang_between_the_rim_and_the_wall(share, ball):
    eye = np.array([0, -2.2, 0])
    points = mixed_image(ball, eye, 2000, generator("mixed", 0), share, 0.1)
    wall = 0.1 + ball.points[:, 1].max()
    step = (wall + 2.2 - np.linalg.norm(ball.points - eye, axis=1).min()) / 500
    depth = (points[:, 1] + 2.2) / step
    np.testing.assert_allclose(depth, np.round(depth), atol=1e-9)
    off = np.linalg.norm(points, axis=1) - 0.5
    mixed = off > 0.02
    assert 0.2 * share < mixed.mean() <= share  # others hang near the rim, or between places of the ball
    assert points[mixed, 1].min() > -0.2
    assert points[mixed, 1].max() < wall
    ray = (points - eye) / np.linalg.norm(points - eye, axis=1)[:, None]
    aside = np.sqrt(eye @ eye - (ray @ eye) ** 2)
    np.testing.assert_allclose(aside[mixed], 0.5, atol=0.05)  # at the outline


def test_mixed_pixels_form_veils(ball):
    points = mixed_image(ball, np.array([0, -2.2, 0]), 2000, generator("mixed", 0), 0.05, 0.1)
    mixed = points[np.linalg.norm(points, axis=1) > 0.52]
    angle = np.sort(np.arctan2(mixed[:, 2], mixed[:, 0]))
    gaps = np.diff(angle)
    assert gaps.max() > 5 * 2 * np.pi / len(mixed)  # stretches of the outline have none
    assert np.median(gaps) < 0.7 * 2 * np.pi / len(mixed)


def test_a_single_point_before_a_wall(drawn):
    assert cloud(drawn("handles", 0), "flying", 1).shape == (1, 3)


def tubes(*offsets):
    """Straight tubes of length 1 and radius 0.05 along x, so far aside."""
    parts = []
    for y in offsets:
        part = Axis()
        part.path(np.array([[0, y, 0], [1, y, 0.0]]), 0.05)
        parts.append(part)
    whole = joined(parts)
    found = surface(whole.nodes, whole.edges, whole.radii, 20_000, generator("tubes"))
    facts = {"area": found.area}
    return Shape("tube_0", "tube", 0, whole.nodes, whole.edges, whole.radii, found.points, found.normals, facts)


@pytest.mark.parametrize("family", ["trees", "groups"])
def test_clouds_of_the_whole_surface_show_the_whole_axis(family, drawn):
    one = drawn(family, 0)
    assert coverage(one, one.points[::5]) == 1
    assert coverage(one, cloud(one, "clean")) == 1
    assert coverage(one, cloud(one, "noise05")) > 0.99


@pytest.mark.parametrize(("gap", "least", "most"), [(0.05, 1, 1), (0.15, 0.9, 0.96), (0.3, 0.7, 0.8)])
def test_long_gaps_count_more_than_their_length(gap, least, most):
    one = tubes(0)
    found = coverage(one, one.points[np.abs(one.points[:, 0] - 0.5) > gap / 2])
    assert least <= found <= most


def test_points_of_a_part_nearby_show_nothing_of_this_one():
    one = tubes(0, 0.14)
    assert coverage(one, one.points[one.points[:, 1] < 0.07]) == 0.5


@pytest.mark.parametrize("points", [np.empty((0, 3)), np.zeros(3), np.zeros((4, 2)), np.full((4, 3), np.nan)])
def test_what_is_no_cloud_is_refused(points):
    with pytest.raises(InvalidParameterError, match=r"points must be an \(n, 3\) array of finite numbers"):
        coverage(tubes(0), points)
