"""The fit to the axis: closed forms of tubes and tori, and what it must not mind."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from glsk_o3d import Skeleton, samples, skeletonize
from glsk_o3d.numerics.polylines import incident_edges, nearest_on_edges
from glsk_o3d.numerics.radii import plane_distance_radii
from glsk_o3d.numerics.vectors import norm
from glsk_o3d.refinement import axis_fit
from glsk_o3d.refinement.axis_fit import FIT_BEYOND, FIT_STAY, HALF_SUPPORT
from glsk_o3d.refinement.sections import measure_sections

R = 0.15  # of the tubes
TURN = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]


def fit_axis(skeleton, passes):
    """Vertices, confidence and radii after a fit."""
    fitted = axis_fit.fit_axis(skeleton, passes)
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


def bent():
    """A helix with points all around it and random signs of the normals; nothing about it is symmetric."""
    rng = np.random.default_rng(3)
    t, angle = rng.uniform(0, 4, 3000), rng.uniform(0, 2 * np.pi, 3000)
    centre, along = (
        np.column_stack([np.cos(t), np.sin(t), t / 4]),
        np.column_stack([-np.sin(t), np.cos(t), 0 * t + 1 / 4]),
    )
    side = np.column_stack([np.cos(t), np.sin(t), 0 * t])
    up = np.cross(along, side) / np.sqrt(17 / 16)
    normals = np.cos(angle)[:, None] * side + np.sin(angle)[:, None] * up
    t = np.linspace(0.1, 3.9, 30)
    vertices = np.column_stack([np.cos(t), np.sin(t), t / 4]) + rng.normal(size=(30, 3)) * 0.02
    return path(vertices, centre + R * normals, rng.choice([-1, 1], (3000, 1)) * normals)


def off_axis(vertices):
    return np.hypot(vertices[:, 1], vertices[:, 2])


# ---- closed forms


@pytest.mark.parametrize("off", [(0, 0.12), (0.05, 0.1), (-0.1, 0)])
def test_first_pass_moves_a_curve_by_the_share_of_the_normals(off):
    """Per point, the normals of a whole tube weigh 1/2, and staying FIT_STAY.

    What is 0 is so within 1e-4 R: places that ten conjugate gradients smooth are not quite symmetric.
    """
    skeleton = tube(off)
    moved = fit_axis(skeleton, 1)[0]
    left = np.tile(off, (20, 1)) * FIT_STAY / (0.5 + FIT_STAY)
    np.testing.assert_allclose(moved[:, 1:], left, rtol=0.03, atol=1e-4 * R)
    np.testing.assert_allclose(moved[:, 0], skeleton.vertices[:, 0], atol=2e-3)


@pytest.mark.parametrize("off", [(0, 0.12), (0.05, 0.1), (0.2, -0.2)])
def test_a_curve_anywhere_comes_to_the_axis_of_a_tube(off):
    distance = [off_axis(fit_axis(tube(off), passes)[0]).max() for passes in range(5)]
    assert distance[0] == pytest.approx(np.hypot(*off))
    # every pass leaves no more than a good third
    assert (np.diff(np.log(distance)) < -1).all()
    assert off_axis(fit_axis(tube(off), 10)[0]).max() < 1e-4 * R


@pytest.mark.parametrize("signs", [False, True])
@pytest.mark.parametrize("side", [0, 0.03])
def test_a_curve_comes_to_the_axis_of_half_a_tube(side, signs):
    """Not to the centroid of its points, 2 / pi of the radius above the axis."""
    skeleton = tube((side, 2 / np.pi * R), arc=np.pi)
    if signs:  # normals are known up to it
        sign = np.random.default_rng(0).choice([-1, 1], (len(skeleton.normals), 1))
        skeleton = replace(skeleton, normals=sign * skeleton.normals)
    lowest = skeleton.points[:, 2].min()
    moved = fit_axis(skeleton, 10)[0]
    assert np.abs(moved[:, 1]).max() < 1e-3 * R
    assert np.abs(moved[:, 2]).max() <= lowest


@pytest.mark.parametrize("turn", [np.eye(3), TURN], ids=["straight", "turned"])
@pytest.mark.parametrize("degrees", [180, 150, 120])
def test_a_curve_comes_to_the_axis_of_an_arc_outside_its_points(degrees, turn, placed):
    """The axis of less than half a tube is beside all of its points."""
    turned, _ = placed(tube((0, R), arc=np.deg2rad(degrees)), turn)
    assert off_axis(fit_axis(turned, 15)[0] @ turn.T).max() < 0.02 * R


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


def test_vertices_at_uneven_distances_do_not_slide_along_the_axis():
    raw = tube()
    x = np.sort(np.random.default_rng(0).uniform(-0.95, 0.95, 20))
    uneven = path(np.column_stack([x, 0 * x, 0 * x]), raw.points, raw.normals)
    np.testing.assert_allclose(fit_axis(uneven, 5)[0], uneven.vertices, atol=1e-9)


def test_vertices_hardly_slide_along_a_bend():
    """However often it is fitted: they move across the curve, not along it."""
    raw = bent()
    x, y, _ = raw.vertices.T
    along = np.column_stack([-y, x, np.full(30, 1 / 4)])
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    moved = fit_axis(raw, 20)[0] - raw.vertices
    assert np.abs(np.einsum("ij,ij->i", moved, along)).max() < 0.2 * R


# ---- flat sections


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


@pytest.mark.parametrize("wiggle", [0, 0.4, 0.8])
def test_the_curve_of_a_flat_bar_is_its_midline(wiggle):
    """Whatever way it took over the width before: the places of the points are smoothed on the surface."""
    moved = fit_axis(strip(wiggle=wiggle), 6)[0][4:-4]
    assert np.abs(moved[:, 1]).max() < 0.1 * 0.3
    assert np.abs(moved[:, 2]).max() < 0.02


def test_two_samples_of_a_flat_bar_come_nearer_as_points_grow():
    apart = []
    for n in (1500, 6000, 24000):
        one, other = (fit_axis(strip(wiggle=0.4, n=n, seed=seed), 3)[0][4:-4] for seed in (1, 2))
        apart.append(norm(one - other).mean())
    assert apart[1] < apart[0] / 1.3
    assert apart[2] < apart[1] / 1.3


BARS = pytest.mark.parametrize(("wide", "thick"), [(0.3, 0.06), (0.2, 0.1)])


@BARS
def test_the_section_of_a_flat_bar_is_its_own_and_its_width_is_doubt(wide, thick):
    fitted = axis_fit.fit_axis(strip(wide, thick), 3)
    sections = measure_sections(fitted)
    np.testing.assert_allclose(sections.half_width[4:-4], wide, rtol=0.02)
    np.testing.assert_allclose(sections.half_thickness[4:-4], thick, rtol=0.02)
    # mean squares over the section, of what the normals do not explain and of the distance
    face, side = wide / (wide + thick), thick / (wide + thick)
    miss = (face * wide**2 + side * thick**2) / 3
    apart = face * (wide**2 / 3 + thick**2) + side * (wide**2 + thick**2 / 3)
    sure = 1 - min(2 * miss / apart, 1)
    count = 6000 / 40 * 3  # the points of three vertices
    assert fitted.confidence[4:-4].mean() == pytest.approx(sure * count / (count + HALF_SUPPORT), abs=0.02)


@BARS
def test_the_radius_of_a_flat_bar_is_that_of_its_area(wide, thick):
    """Hardly less, and up to a half more in places: a part of the width counts as noise."""
    ratio = fit_axis(strip(wide, thick), 3)[2][4:-4] / np.sqrt(wide * thick)
    assert ratio.min() > 0.95
    assert ratio.max() < 1.5
    assert 0.99 < ratio.mean() < 1.25


# ---- noise as wide as the tube


def noisy(noise, seed=0, m=60, known=False):
    """A tube along x whose points are `noise` radii off; normals in random directions unless they are known."""
    rng = np.random.default_rng(seed)
    x, angle = rng.uniform(-1, 1, 3000), rng.uniform(0, 2 * np.pi, 3000)
    normals = np.column_stack([0 * angle, np.cos(angle), np.sin(angle)])
    points = R * (normals + noise * rng.normal(size=(3000, 3))) + x[:, None] * [1, 0, 0]
    if not known:
        normals = rng.normal(size=(3000, 3))
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    off = 0.1 * R * rng.normal(size=(m, 2))
    return path(np.column_stack([np.linspace(-0.95, 0.95, m), off]), points, normals)


def with_and_without(raw, monkeypatch, passes=3):
    found = []
    for stiffness in (axis_fit.FIT_STIFFNESS, 0.1):
        monkeypatch.setattr(axis_fit, "FIT_STIFFNESS", stiffness)
        found.append(fit_axis(raw, passes)[0])
    return found


def bends(vertices):
    return np.linalg.norm(np.diff(vertices, 2, axis=0), axis=1)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("m", [40, 60])
@pytest.mark.parametrize(("noise", "known"), [(0.3, False), (1.0, False), (1.0, True)])
def test_where_noise_is_the_curve_is_smoother_and_nearer_the_axis(monkeypatch, noise, known, m, seed):
    blurred, sharp = with_and_without(noisy(noise, seed, m, known), monkeypatch)
    assert off_axis(blurred).mean() < off_axis(sharp).mean() / 2
    assert bends(blurred).mean() < bends(sharp).mean() / 2
    # across the axis, not along it: it is as long as it was, while the other folds and runs out of the ends
    assert np.ptp(blurred[:, 0]) == pytest.approx(2 * 0.95, rel=0.05)


@pytest.mark.parametrize("noise", [0.3, 1.0])
def test_the_finer_the_curve_the_more_is_smoothed(noise):
    """Over a length that grows with the noise, and not with the spacing: a curve of more vertices is as good."""
    away = [off_axis(fit_axis(noisy(noise, m=m), 3)[0]).mean() for m in (30, 60, 120)]
    assert max(away) < 2 * min(away)
    assert max(away) < 0.25 * R  # the noise is up to a radius wide, its normals point anywhere


@pytest.mark.parametrize("small", [0.1, 0.15])
def test_bending_makes_a_ring_smaller_by_its_closed_form(monkeypatch, small):
    """Per point, (w / h)^4 |x - chord|^2 = w^4 / (4 r^2) on a circle of radius r against 1/2 (r - big)^2 by normals."""
    blurred, sharp = with_and_without(torus(small=small), monkeypatch, 12)
    smaller = np.hypot(*sharp[:, :2].T).mean() - np.hypot(*blurred[:, :2].T).mean()
    assert smaller == pytest.approx(small**4 / (2 * 0.4**3), rel=0.05)


def test_without_noise_bends_stay():
    """Of the helix of 3000 random points, where bending alone is w^4 / (2 r^3) = .0014 R; the ends have one side."""
    t = np.linspace(-1, 5, 20001)
    helix = cKDTree(np.column_stack([np.cos(t), np.sin(t), t / 4]))
    away = helix.query(fit_axis(bent(), 6)[0])[0]
    assert away[3:-3].max() < 0.03 * R
    assert away.max() < 0.15 * R


def test_without_noise_a_curve_is_straight_to_its_ends():
    """It was .24 R off. Three passes leave (1/6)^3 of that, and a little more at the ends."""
    assert off_axis(fit_axis(tube((0.02, 0.03), m=39), 6)[0]).max() < 1e-3 * R


def test_vertices_in_one_place_are_no_noise_without_end():
    """Nor is there a warning."""
    raw = noisy(1.0, m=10)
    vertices = raw.vertices.copy()
    vertices[4] = vertices[5]
    moved = fit_axis(replace(raw, vertices=vertices), 3)[0]
    assert np.isfinite(moved).all()
    assert off_axis(moved).max() < R


# ---- confidence


def nearest_edges(skeleton):
    """The edge each point is nearest to."""
    table = incident_edges(skeleton.edges, len(skeleton.vertices))[skeleton.vertex_of_point]
    return nearest_on_edges(skeleton.vertices, skeleton.edges, table, skeleton.points)[0]


def points_around(skeleton, edge):
    """Halves of points count for either end of the edge they belong to; of a vertex and its neighbours."""
    ends = skeleton.edges
    own = np.bincount(ends[edge].ravel(), minlength=len(skeleton.vertices)) / 2
    near = own.copy()
    for a, b in ends.tolist():
        near[a] += own[b]
        near[b] += own[a]
    return near


@pytest.mark.parametrize("height", [0, 0.05, R, 0.4])
def test_confidence_of_a_curve_off_the_axis(height):
    """Doubt is h^2 / (h^2 + r^2) at the distance h from the axis: the share that the normals do not explain."""
    skeleton = tube((0, height))
    near = points_around(skeleton, nearest_edges(skeleton))
    inner = slice(2, -2)  # beyond the ends the way to the curve has a part along it
    expected = R**2 / (R**2 + height**2) * near / (near + HALF_SUPPORT)
    np.testing.assert_allclose(fit_axis(skeleton, 0)[1][inner], expected[inner], rtol=0.02)


@pytest.mark.parametrize("around", [3, 6, 24])
def test_confidence_is_near_one_on_the_axis_of_a_tube_with_many_points(monkeypatch, around):
    """Points count by their places, which are smoothed: the edges of those that the fit has last."""
    last, real = [], axis_fit._nearest
    monkeypatch.setattr(axis_fit, "_nearest", lambda *given: last.append(real(*given)) or last[-1])
    skeleton = tube(around=around)
    confidence = fit_axis(skeleton, 3)[1]
    near = points_around(skeleton, last[-1].edge)
    np.testing.assert_allclose(confidence, near / (near + HALF_SUPPORT), rtol=1e-3)
    # in the middle, smoothing moves nothing along the tube
    plain = points_around(skeleton, nearest_edges(skeleton))
    np.testing.assert_array_equal(near[8:12], plain[8:12])


@pytest.mark.parametrize(
    "passes",
    [
        1,
        3,
        10,
    ],
)
def test_the_ends_of_a_tube_keep_points(passes):
    """Of a curve on the axis, whose ends are a third of a radius from those of the tube."""
    assert fit_axis(tube(m=39), passes)[1].min() > 0.5


@pytest.mark.parametrize(("across", "explained"), [(True, 0), (False, 1 / 3)])
def test_confidence_of_normals_in_random_directions(across, explained):
    """Across the axis they explain nothing; in all directions, a third as if they were known to be across it."""
    skeleton = tube(around=40)
    normals = np.random.default_rng(0).normal(size=skeleton.normals.shape) * [1 - across, 1, 1]
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    confidence = fit_axis(replace(skeleton, normals=normals), 0)[1]
    assert confidence.mean() == pytest.approx(explained, abs=0.04)


def test_confidence_of_few_points_is_small():
    counts = [2, 5, 50]
    confidence = [fit_axis(tube(m=2, around=8, along=n), 2)[1] for n in counts]
    for n, both in zip(counts, confidence, strict=True):
        np.testing.assert_allclose(both, 8 * n / (8 * n + HALF_SUPPORT), rtol=0.01)


# ---- what does not matter, and what is not there


@pytest.mark.parametrize("passes", [1, 3])
@pytest.mark.parametrize("shape", [bent, torus])
@pytest.mark.parametrize(
    ("turn", "scale", "shift"),
    [(TURN, 1, 0), (-np.eye(3), 1, 0), (np.eye(3), 1, [1e4, -3, 7]), (np.eye(3), 1e-9, 0), (TURN, 1e12, 3e12)],
)
def test_goes_with_the_cloud(shape, passes, turn, scale, shift, placed):
    raw = shape()
    moved, _ = placed(raw, turn, scale, shift)
    (vertices, confidence, _), (expected, sure, _) = fit_axis(moved, passes), fit_axis(raw, passes)
    np.testing.assert_allclose((vertices - shift) / scale, expected @ turn, atol=1e-8)
    np.testing.assert_allclose(confidence, sure, atol=1e-7)


def test_order_of_the_points_and_signs_of_their_normals_do_not_matter(renumbered):
    raw, rng = bent(), np.random.default_rng(4)
    mixed = renumbered(raw, np.arange(30), rng.permutation(len(raw.points)))
    mixed = replace(mixed, normals=rng.choice([-1, 1], (len(raw.points), 1)) * mixed.normals)
    for got, expected in zip(fit_axis(mixed, 3), fit_axis(raw, 3), strict=True):
        np.testing.assert_allclose(got, expected, atol=1e-9)


def test_numbers_of_the_vertices_hardly_matter(renumbered):
    """Points beyond a corner are as near to one of its edges as to the other: they go to that with the lower number."""
    raw = bent()
    name = np.random.default_rng(4).permutation(len(raw.vertices))
    (vertices, confidence, _), (expected, sure, _) = fit_axis(renumbered(raw, name), 3), fit_axis(raw, 3)
    np.testing.assert_allclose(vertices[name], expected, atol=0.01 * R)
    np.testing.assert_allclose(confidence[name], sure, atol=0.01)


def test_no_passes_leave_the_vertices():
    skeleton = bent()
    vertices, confidence, _ = fit_axis(skeleton, 0)
    np.testing.assert_allclose(vertices, skeleton.vertices, atol=1e-15)
    assert confidence.shape == (30,)
    assert (confidence > 0.5).all()


@pytest.mark.parametrize("own", [0, 2])
@pytest.mark.parametrize("place", [(5, 6, 7), (0.3, 0, 0)])
def test_a_vertex_without_edges_stays_and_has_no_confidence(place, own):
    """Its points say nothing about the others, either."""
    raw = tube((0, 0.05))
    points, normals = np.concatenate([raw.points, np.array([place] * own).reshape(-1, 3)]), raw.normals
    lonely = Skeleton(
        np.concatenate([raw.vertices, [place]]), raw.edges, np.full(21, R),
        np.concatenate([raw.vertex_of_point, [20] * own]), points, np.concatenate([normals, np.eye(3)[:own]]),
    )  # fmt: skip
    vertices, confidence, _ = fit_axis(lonely, 2)
    np.testing.assert_allclose(vertices[20], place, atol=1e-12)
    assert confidence[20] == 0
    np.testing.assert_allclose(vertices[:20], fit_axis(raw, 2)[0], atol=1e-3 * R)


def test_points_without_a_normal_or_a_vertex_have_no_say():
    raw = bent()
    rng = np.random.default_rng(5)
    normals, vertex, points = raw.normals.copy(), raw.vertex_of_point.copy(), raw.points.copy()
    silent, lost = np.arange(0, 400), np.arange(400, 700)
    normals[silent], vertex[lost] = np.nan, -1
    points[:700] += rng.normal(size=(700, 3))
    rest = slice(700, None)
    expected = fit_axis(replace(raw, points=points[rest], normals=normals[rest], vertex_of_point=vertex[rest]), 3)
    for got, wanted in zip(
        fit_axis(replace(raw, points=points, normals=normals, vertex_of_point=vertex), 3), expected, strict=True
    ):
        np.testing.assert_allclose(got, wanted, atol=1e-12)


@pytest.mark.parametrize("passes", [0, 1, 3])
def test_without_any_say_vertices_stay_and_there_is_no_confidence(passes):
    raw = bent()
    for skeleton in (
        replace(raw, normals=np.full_like(raw.normals, np.nan)),
        replace(raw, points=(), normals=(), vertex_of_point=()),
        replace(raw, edges=()),
    ):
        vertices, confidence, _ = fit_axis(skeleton, passes)
        np.testing.assert_array_equal(vertices, raw.vertices)
        np.testing.assert_array_equal(confidence, np.zeros(30))


@pytest.mark.parametrize("passes", [6, 30])
def test_vertices_between_points_bridge_them(passes):
    """Where the middle of a tube was not scanned, the curve is straight from one side to the other."""
    raw = tube((0, 0.05), m=39)
    seen = np.abs(raw.points[:, 0]) > 0.3
    gap = replace(raw, points=raw.points[seen], normals=raw.normals[seen], vertex_of_point=raw.vertex_of_point[seen])
    vertices, confidence, _ = fit_axis(gap, passes)
    assert off_axis(vertices).max() < 0.02 * R
    middle = np.abs(raw.vertices[:, 0]) < 0.2
    assert (confidence[middle] == 0).all()
    assert confidence[~middle].max() > 0.9


@settings(max_examples=60)
@given(st.integers(0, 10**6), st.integers(1, 9), st.floats(0.2, 1.5), st.integers(0, 4), st.booleans(), st.booleans())
def test_is_finite_and_in_bounds_whatever_the_graph(random_skeleton, seed, m, reach, passes, every, together):
    raw = random_skeleton(seed, m, reach, n=max(20, m), every=every)
    if together:  # some vertices, and some points on vertices
        vertices, points = raw.vertices.copy(), raw.points.copy()
        vertices[m // 2 :] = vertices[m // 2]
        points[::3] = vertices[0]
        raw = replace(raw, vertices=vertices, points=points)
    vertices, confidence, _ = fit_axis(raw, passes)
    assert np.isfinite(vertices).all()
    assert vertices.shape == (m, 3)
    assert ((confidence >= 0) & (confidence < 1)).all()
    low, high = (getattr(np.concatenate([raw.points, raw.vertices]), end)(axis=0) for end in ("min", "max"))
    slack = 2 * np.linalg.norm(high - low)  # normals that mean nothing may meet far away
    assert (vertices > low - slack).all()
    assert (vertices < high + slack).all()


def test_all_in_one_place():
    flat = Skeleton(
        np.ones((3, 3)), [(0, 1), (1, 2)], np.ones(3), [0, 1, 2, 2], np.ones((4, 3)), np.eye(3)[[0, 1, 2, 0]]
    )
    vertices, confidence, _ = fit_axis(flat, 3)
    np.testing.assert_allclose(vertices, 1, atol=1e-12)
    np.testing.assert_array_equal(confidence, 0)


# ---- edges at vertices, places on edges


@settings(max_examples=60)
@given(st.integers(1, 9), st.sets(st.tuples(st.integers(0, 8), st.integers(0, 8)), max_size=20))
def test_incident_edges_by_their_definition(m, pairs):
    edges = np.array(sorted((a, b) for a, b in pairs if a < b < m), int).reshape(-1, 2)
    table = incident_edges(edges, m)
    most = max(np.bincount(edges.ravel(), minlength=m).max(), 2)  # at least two columns
    assert table.shape == (m, most)
    for v, row in enumerate(table.tolist()):
        here = [e for e, edge in enumerate(edges.tolist()) if v in edge]
        assert row == here + [-1] * (most - len(here))


@settings(max_examples=60)
@given(st.integers(0, 10**6), st.integers(1, 6), st.integers(1, 4))
def test_nearest_on_edges_against_dense_samples(seed, e, columns):
    rng = np.random.default_rng(seed)
    x, p = rng.normal(size=(7, 3)), rng.normal(size=(30, 3))
    edges = rng.integers(0, 7, (e, 2))
    candidates = rng.integers(-1, e, (30, columns))
    candidates[:, 0] = rng.integers(0, e, 30)
    edge, t = nearest_on_edges(x, edges, candidates, p)
    assert ((t >= 0) & (t <= 1)).all()
    found = np.linalg.norm((1 - t)[:, None] * x[edges[edge, 0]] + t[:, None] * x[edges[edge, 1]] - p, axis=1)
    share = np.linspace(0, 1, 2001)[:, None, None]
    samples = (1 - share) * x[edges[:, 0]] + share * x[edges[:, 1]]
    for i, row in enumerate(candidates.tolist()):
        assert edge[i] in row
        allowed = [c for c in row if c >= 0]
        least = np.linalg.norm(samples[:, allowed] - p[i], axis=2).min()
        assert least - 0.01 < found[i] < least + 1e-9


@pytest.mark.parametrize(("place", "t"), [(-3, 0), (0, 0), (0.25, 0.25), (1, 1), (9, 1)])
def test_nearest_on_edges_ends_at_the_ends(place, t):
    edge, found = nearest_on_edges(
        np.array([[0, 0, 0], [1.0, 0, 0]]), np.array([[0, 1]]), np.array([[0]]), np.array([[place, 2.0, 0]])
    )
    assert (edge.tolist(), found.tolist()) == ([0], [t])


def test_nearest_on_edges_of_no_length_is_their_place():
    x = np.array([[1.0, 2, 3], [1, 2, 3], [5, 5, 5]])
    edge, t = nearest_on_edges(
        x, np.array([[0, 1], [1, 2]]), np.array([[0, -1], [1, 0]]), np.array([[0.0, 0, 0], [4, 4, 4]])
    )
    assert edge.tolist() == [0, 1]
    assert np.isfinite(t).all()


def test_nearest_on_edges_takes_the_first_of_equally_near():
    """All points beyond a common vertex are equally near to its edges: the first listed, whatever the rounding."""
    rng = np.random.default_rng(0)
    x = np.concatenate([[[0.1, 0.2, 0.3]], rng.normal(size=(4, 3)) + [9, 0, 0]])
    edges = np.array([[0, i] for i in range(1, 5)])
    p = rng.normal(size=(200, 3)) - [9, 0, 0]
    for row in ([0, 1, 2, 3], [3, 1, 0, 2]):
        edge, t = nearest_on_edges(x, edges, np.tile(row, (200, 1)), p)
        assert set(edge.tolist()) == {row[0]}
        assert not t.any()


# ---- radii


def radii_and_planes(skeleton):
    vertices, _, radii = fit_axis(skeleton, 1)
    return radii, plane_distance_radii(
        vertices, skeleton.vertex_of_point, skeleton.points, skeleton.normals, skeleton.radii
    )


@pytest.mark.parametrize("arc", [2 * np.pi, np.pi])
def test_radii_of_exact_tubes_are_theirs(arc):
    radii, planes = radii_and_planes(tube(arc=arc))
    np.testing.assert_allclose(radii, R, rtol=1e-9)
    np.testing.assert_allclose(planes, R, rtol=1e-9)


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
    away = np.hypot(*cone.points[:, 1:].T) / (R + slope * cone.points[:, 0])
    assert away.min() > 1.004
    assert share.mean() < 1.003


def test_tilted_normals_do_not_make_a_tube_thinner():
    """Normals that point anywhere across the axis: their planes pass at R |cos|, whose median is R / sqrt(2)."""
    skeleton = tube()
    angle = np.random.default_rng(0).uniform(0, 2 * np.pi, len(skeleton.points))
    normals = np.column_stack([0 * angle, np.cos(angle), np.sin(angle)])
    radii, planes = radii_and_planes(replace(skeleton, normals=normals))
    np.testing.assert_allclose(np.median(planes), R / np.sqrt(2), rtol=0.05)
    assert np.median(radii) > 0.9 * R
    assert radii[2:-2].max() < 1.02 * R  # at an open end there are points on one side alone


def test_a_board_of_two_faces_has_a_radius():
    """It is 8 times as wide as thick, which nobody saw: the radius of its area is between both half axes."""
    x, y, side = (part.ravel() for part in np.meshgrid(np.linspace(-1, 1, 120), np.linspace(-0.4, 0.4, 21), [-1, 1]))
    flat = path(tube().vertices, np.column_stack([x, y, 0.05 * side]), np.outer(side, [0.0, 0, 1]))
    radii, _ = radii_and_planes(flat)
    assert radii.min() > 0.05 * (1 - 1e-6)
    assert radii.max() < 0.4


@pytest.mark.parametrize("seed", range(2))
def test_radii_of_a_noisy_fork(seed):
    """Three tubes as thick as each other that meet."""
    sample = samples.y_junction(4096, radii=(0.04, 0.04, 0.04), noise=0.01, seed=seed)
    fork = skeletonize(sample.points)
    planes = plane_distance_radii(fork.vertices, fork.vertex_of_point, fork.points, fork.normals)
    near = np.linalg.norm(fork.vertices, axis=1) < 0.08
    off, before = (np.abs(values / 0.04 - 1) for values in (fork.radii, planes))
    assert near.sum() > 5
    assert off[near].mean() < 0.75 * before[near].mean()
    assert off.mean() < 0.75 * before.mean()
    assert off.mean() < 0.1


def test_a_curve_that_nobody_centred_has_the_distances_to_the_planes():
    skeleton = bent()
    _, _, radii = fit_axis(skeleton, 0)
    expected = plane_distance_radii(skeleton.vertices, skeleton.vertex_of_point, skeleton.points, skeleton.normals)
    np.testing.assert_allclose(radii, expected, rtol=1e-12)


def test_vertices_as_good_as_in_one_place_are_smoothed_at_most_so_much():
    """Three of a tube, nearer than a square can say, among points as far away as a square may be."""
    raw = tube()
    vertices = raw.vertices.copy()
    vertices[9:12, 0] = np.array([-1e-158, 0, 1e-158])
    vertices[9:12, 1:] = 0
    noisy = np.random.default_rng(0).permutation(raw.normals)
    moved = fit_axis(replace(raw, vertices=vertices * 1e3, points=raw.points * 1e3, normals=noisy), 3)[0]
    assert np.isfinite(moved).all()


def test_normals_that_mean_nothing_do_not_lead_far_out_of_the_cloud():
    """A strip that is bent as if its axis were a hundred times as far away as it is wide."""
    raw = tube(arc=0.01, m=8)
    fitted = fit_axis(raw, 3)[0]
    low, high = raw.points.min(axis=0), raw.points.max(axis=0)
    beyond = np.maximum(low - fitted, fitted - high).max() / np.linalg.norm(high - low)
    assert beyond <= FIT_BEYOND * (1 + 1e-9)
    third = tube(arc=2 * np.pi / 3)  # of a tube ten radii long and more has an axis
    assert np.abs(fit_axis(third, 9)[0][:, 1:]).max() < 0.1 * R


@pytest.mark.parametrize("seed", range(30))
def test_points_far_off_along_an_edge_say_no_more_than_they_can(seed):
    """How far they are from its line is a difference of squares, and less than its roundings."""
    rng = np.random.default_rng(seed)
    way = rng.normal(size=3)
    x, p = np.array([0 * way, way]), 1e60 * np.outer([2, 3, 5], way)
    ends = np.array([[0, 1]])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        near = axis_fit._nearest(x, ends, incident_edges(ends, 2)[[1, 1, 1]], p, rng.normal(size=(3, 3)), p, np.ones(2))
    assert ((near.doubt >= 0) & (near.doubt <= 1)).all()
