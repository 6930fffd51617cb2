"""The fit to the axis: closed forms of tubes and tori, and what it must not mind."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from glsk_o3d import Skeleton
from glsk_o3d.curve.axis import fit as axis_fit
from glsk_o3d.curve.curve import Curve

R = 0.15  # of the tubes
HALF_SUPPORT = 8  # points that support a vertex half
HALF_TUBE_REACH = (2 / np.pi) / np.sqrt(1 - (2 / np.pi) ** 2)


def fit_axis(skeleton, passes, **options):
    """Vertices, confidence and radii after a fit."""
    fitted = axis_fit.fit_axis(Curve.of(skeleton), passes, **options)
    return fitted.vertices, fitted.confidence, fitted.radii


def tube(off=(0, 0), arc=2 * np.pi, m=20, around=24, along=200):
    """Exact points and normals of a tube along x, or of an arc of it that is scanned from above; a curve off its axis.

    Arc and curve are centred on the z axis; the lowest points of a half tube are a little above its axis.
    """
    angle = np.pi / 2 + arc * ((np.arange(around) + 0.5) / around - 0.5)
    angle, x = (part.ravel() for part in np.meshgrid(angle, (np.arange(along) + 0.5) / along * 2 - 1))
    normals = np.column_stack([0 * angle, np.cos(angle), np.sin(angle)])
    points = R * normals + x[:, None] * [1, 0, 0]
    x = np.linspace(-0.95, 0.95, m)
    return path(np.column_stack([x, 0 * x + off[0], 0 * x + off[1]]), points, normals)


def path(vertices, points, normals, closed=False):
    m = len(vertices)
    edges = [(i, i + 1) for i in range(m - 1)] + [(0, m - 1)] * closed
    vertex = cKDTree(vertices).query(points)[1]
    return Skeleton(vertices, sorted(edges), np.full(m, R), vertex, points, normals)


def torus(big=0.4, small=0.1, m=48, shift=(0.03, 0.02)):
    """A polygon beside the centre circle of a torus in the xy plane: wider by shift[0], higher by shift[1]."""
    a, b = (part.ravel() for part in np.meshgrid(*[(np.arange(n) + 0.5) / n * 2 * np.pi for n in (6 * m, 20)]))
    out = np.column_stack([np.cos(a), np.sin(a), 0 * a])
    normals = np.cos(b)[:, None] * out + np.sin(b)[:, None] * [0, 0, 1]
    t = np.arange(m) / m * 2 * np.pi
    vertices = np.column_stack([np.cos(t), np.sin(t), 0 * t]) * (big + shift[0]) + [0, 0, shift[1]]
    return path(vertices, big * out + small * normals, normals, closed=True)


def off_axis(vertices):
    return np.hypot(vertices[:, 1], vertices[:, 2])


@pytest.mark.parametrize("off", [(0, 0.12), (0.05, 0.1), (0.2, -0.2)])
def test_a_curve_anywhere_comes_to_the_axis_of_a_tube(off):
    distance = [off_axis(fit_axis(tube(off), passes)[0]).max() for passes in range(5)]
    assert distance[0] == pytest.approx(np.hypot(*off))
    # every pass leaves no more than a good third
    assert (np.diff(np.log(distance)) < -1).all()
    assert off_axis(fit_axis(tube(off), 10)[0]).max() < 1e-4 * R


@pytest.mark.parametrize("degrees", [180, 150, 120])
def test_a_curve_comes_to_the_axis_of_an_arc_outside_its_points(degrees, placed):
    """Not to the centroid; the axis of less than half a tube is beside all of its points."""
    turned, turn = placed(tube((0, R), arc=np.deg2rad(degrees)))
    assert off_axis(fit_axis(turned, 15)[0] @ turn.T).max() < 0.02 * R


@pytest.mark.parametrize("degrees", [20, 40, 60])
def test_a_leaf_seen_from_one_side_keeps_its_curve(degrees):
    """It is as thick as its arc is deep, and the normals meet far behind it."""
    half = np.deg2rad(degrees) / 2
    leaf = tube(arc=2 * half)
    assert off_axis(fit_axis(leaf, 3)[0]).max() < R / 2  # near where they meet: it may not leave its points farther
    place = fit_axis(leaf, 12, settle=True)[0][2:-2, 2]
    # of the squared normals `across` stand across the others; the doubt, since they do not meet there, pulls as well
    centroid, across = R * np.sin(half) / half, (1 - np.sin(2 * half) / (2 * half)) / 2
    pull = 1 - across / (0.5 - 1 / np.pi)
    assert (place < centroid).all()
    assert (place > centroid * pull / (pull + across)).all()


def test_a_polygon_comes_to_the_centre_circle_of_a_torus():
    skeleton = torus()
    moved, confidence, _ = fit_axis(skeleton, 6)
    sagitta = 0.4 * (1 - np.cos(np.pi / 48))  # of a chord: the circle is between corners and middles
    assert np.abs(np.hypot(moved[:, 0], moved[:, 1]) - 0.4).max() < sagitta
    assert np.abs(moved[:, 2]).max() < 1e-4
    assert confidence.min() > 0.9
    # corners keep their places along the circle
    turn = np.arctan2(moved[:, 1], moved[:, 0]) - np.arctan2(skeleton.vertices[:, 1], skeleton.vertices[:, 0])
    assert np.abs((turn + np.pi) % (2 * np.pi) - np.pi).max() < 1e-3


def strip(wide=0.3, thick=0.06, wiggle=0.0, n=6000, seed=0):
    """A bar along x with a rectangular section of these half axes, and a curve that winds over its width."""
    rng = np.random.default_rng(seed)
    x, u = rng.uniform(-2, 2, n), rng.uniform(-1, 1, n)
    face, sign = rng.random(n) < wide / (wide + thick), rng.choice([-1.0, 1.0], n)
    y, z = np.where(face, wide * u, wide * sign), np.where(face, thick * sign, thick * u)
    normals = np.where(face[:, None], [0, 0, 1], [0, 1, 0]) * sign[:, None]
    along = np.linspace(-1.9, 1.9, 40)
    curve = np.column_stack([along, wiggle * wide * np.sin(4 * along), 0 * along])
    return path(curve, np.column_stack([x, y, z]), normals)


def test_the_curve_of_a_flat_bar_is_its_midline():
    """Whatever way it took over the width before: the places of the points are smoothed on the surface."""
    moved = fit_axis(strip(wiggle=0.8), 6)[0][4:-4]
    assert np.abs(moved[:, 1]).max() < 0.1 * 0.3
    assert np.abs(moved[:, 2]).max() < 0.02


@pytest.mark.parametrize("thick", [0.15, 0.06, 0.025])
def test_the_sides_of_a_bar_centre_its_curve_if_half_of_its_faces_belongs_to_another_bar(thick):
    bar = strip(thick=thick)
    own = (np.abs(bar.points[:, 1]) > 0.29) | (bar.points[:, 1] < 0)
    half = path(bar.vertices, bar.points[own], bar.normals[own])
    assert np.abs(fit_axis(half, 6)[0][4:-4, 1]).min() > 0.25 * 0.3  # in the middle of what is left
    assert np.abs(fit_axis(half, 6, settle=True)[0][4:-4, 1]).max() < 0.1 * 0.3


@pytest.mark.parametrize(("noise", "known"), [(0.3, False), (1.0, False), (1.0, True)])
def test_the_curve_of_noise_is_smooth_and_near_the_axis(noise, known):
    """The noise is up to a radius wide, and its normals may point anywhere."""
    rng, given = np.random.default_rng(0), tube(m=60, around=20, along=150)
    points, normals = given.points + noise * R * rng.normal(size=given.points.shape), given.normals
    if not known:
        normals = rng.normal(size=normals.shape)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    curve = given.vertices + 0.1 * R * rng.normal(size=(60, 3)) * [0, 1, 1]
    moved = fit_axis(path(curve, points, normals), 3)[0]
    assert off_axis(moved).mean() < 0.25 * R
    # across the axis, not along it: it is as long as it was
    assert np.ptp(moved[:, 0]) == pytest.approx(2 * 0.95, rel=0.05)


@pytest.mark.parametrize("height", [0, 0.05, R, 0.4])
def test_confidence_of_a_curve_off_the_axis(height):
    """Doubt is h^2 / (h^2 + r^2) at the distance h from the axis: the share that the normals do not explain."""
    near = 3 * 24 * 200 / 20  # the points of three vertices
    inner = slice(2, -2)  # beyond the ends the way to the curve has a part along it
    expected = R**2 / (R**2 + height**2) * near / (near + HALF_SUPPORT)
    np.testing.assert_allclose(fit_axis(tube((0, height)), 0)[1][inner], expected, rtol=0.02)


@pytest.mark.parametrize(
    ("case", "low", "high"),
    [("bar", 0.7, 1), ("sheet", 0, 0.05), ("two sheets near each other", 0, 0.05), ("fog", 0, 0.4)],
)
def test_a_bar_has_two_sides_and_a_sheet_one(case, low, high):
    """All points of its faces are as far from the curve as its half thickness; before it settles no fit is sure."""
    bar = strip(thick=0.003 if "near" in case else 0.06)
    if case == "sheet":
        bar = path(bar.vertices, bar.points * [1, 1, 0], np.tile([0.0, 0, 1], (len(bar.points), 1)))
    elif case == "fog":
        normals = np.random.default_rng(1).normal(size=bar.normals.shape)
        bar = path(bar.vertices, bar.points, normals / np.linalg.norm(normals, axis=1)[:, None])
    sure = np.median(fit_axis(bar, 2, settle=True)[1])
    assert low <= sure <= high
    if case == "bar":
        assert sure > 0.5 + np.median(fit_axis(bar, 2)[1])


def test_points_without_a_normal_or_a_vertex_do_not_count():
    raw, rest = torus(), slice(700, None)
    normals, vertex, points = raw.normals.copy(), raw.vertex_of_point.copy(), raw.points.copy()
    normals[:400], vertex[400:700] = np.nan, -1
    points[:700] += np.random.default_rng(5).normal(size=(700, 3))
    spoilt = replace(raw, points=points, normals=normals, vertex_of_point=vertex)
    clean = replace(raw, points=points[rest], normals=normals[rest], vertex_of_point=vertex[rest])
    for got, wanted in zip(fit_axis(spoilt, 3), fit_axis(clean, 3), strict=True):
        np.testing.assert_allclose(got, wanted, atol=1e-12)
    silent = replace(raw, normals=np.full_like(raw.normals, np.nan))
    for nobody in (silent, replace(raw, points=(), normals=(), vertex_of_point=()), replace(raw, edges=())):
        vertices, confidence, _ = fit_axis(nobody, 3)
        np.testing.assert_array_equal(vertices, raw.vertices)
        np.testing.assert_array_equal(confidence, 0)


def test_vertices_between_points_bridge_them():
    """Where the middle of a tube was not scanned, the curve is straight from one side to the other."""
    raw = tube((0, 0.05), m=39)
    seen = np.abs(raw.points[:, 0]) > 0.3
    vertices, confidence, _ = fit_axis(replace(raw, vertex_of_point=np.where(seen, raw.vertex_of_point, -1)), 6)
    assert off_axis(vertices).max() < 0.02 * R
    middle = np.abs(raw.vertices[:, 0]) < 0.2
    assert (confidence[middle] == 0).all()
    assert confidence[~middle].max() > 0.9


@settings(max_examples=60)
@given(st.integers(0, 10**6), st.integers(1, 8), st.booleans())
def test_detached_vertices_are_pulled_back_to_the_reach_of_half_a_tube(random_skeleton, seed, m, every):
    raw = random_skeleton(seed, m, n=40, every=every)
    normals = raw.normals.copy()
    normals[::7] = np.nan
    raw = replace(raw, vertices=3 * raw.vertices, normals=normals)
    skeleton = axis_fit.pull_back_detached(Curve.of(raw))
    for v, (before, after) in enumerate(zip(raw.vertices, skeleton.vertices, strict=True)):
        own = raw.points[[p for p in raw.supporting_points if raw.vertex_of_point[p] == v]]
        if len(own) == 0:
            np.testing.assert_array_equal(after, before)
            continue
        mean = own.mean(axis=0)
        reach = HALF_TUBE_REACH * np.sqrt(((own - mean) ** 2).sum(axis=1).mean())
        away = np.linalg.norm(before - mean)
        np.testing.assert_allclose(after, mean + (before - mean) * min(1, reach / max(away, 1e-300)), atol=1e-12)


def test_radii_of_a_cone_are_those_of_the_balls_in_it():
    """The distance of its points is more.

    Those of a vertex and of the vertices beside it are one section: at the ends it is that of places two edges away.
    """
    skeleton, slope = tube(), 0.1
    normals = np.sqrt(1 - slope**2) * skeleton.normals - slope * np.array([1.0, 0, 0])
    x = skeleton.points[:, :1]
    cone = path(skeleton.vertices, x * [1, 0, 0] + (R + slope * x) * normals, normals)
    radii = fit_axis(cone, 1)[2]
    expected = R + slope * cone.vertices[:, 0]
    np.testing.assert_allclose(radii, expected, atol=slope * 2 * 0.1)
    share = (radii / expected)[4:-4]
    np.testing.assert_allclose(share, 1, atol=0.01)  # rings of points are a tenth of an edge apart
    assert share.mean() < 1.003
