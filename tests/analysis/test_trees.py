"""Cylinders and measures of trees against tubes with known volumes, and circles through points of stems."""

from dataclasses import asdict, replace

import numpy as np
import pytest

from glsk_o3d import (
    InvalidParameterError,
    Report,
    Skeleton,
    SkeletonWarning,
    analysis,
    pipelines,
    read_skeleton,
    samples,
    save_skeleton,
)
from glsk_o3d.analysis import branch_table, cylinders, diameter_classes, tree_measures
from glsk_o3d.analysis.circles import WAVINESS, fit_circle

quiet = pytest.mark.filterwarnings("ignore::glsk_o3d.SkeletonWarning")
Z = np.array([0, 0, 1.0])
THICK, THIN, HEIGHT = 0.1, 0.05, 2.0
VOLUME = np.pi * THICK**2 * (HEIGHT - THICK / 3), np.pi * THIN**2 * (1 - THICK - THIN / 3)


def limb(start, direction, length, radius, n, rng):
    """Points on a tube along a unit vector, with a round cap at its far end."""
    across = np.linalg.svd(direction[None])[2][1:]
    cap = radius / (length + radius)  # the share of a hemisphere's area
    along, turn = length * rng.random(n), 2 * np.pi * rng.random(n)
    rise = np.where(rng.random(n) < cap, rng.random(n), 0)
    along = np.where(rise > 0, length - radius + radius * rise, along * (length - radius) / length)
    wide = radius * np.sqrt(1 - rise**2)[:, None]
    around = np.cos(turn)[:, None] * across[0] + np.sin(turn)[:, None] * across[1]
    return start + along[:, None] * direction + wide * around


@pytest.fixture(scope="module", params=[0.0, 0.005], ids=["clean", "noisy"])
def tree(request):
    """A stem of two metres, and a branch to one side at half its height."""
    rng = np.random.default_rng(5)
    stem, branch = limb(0 * Z, Z, HEIGHT, THICK, 6000, rng), limb(Z, np.array([1, 0, 0]), 1.0, THIN, 1500, rng)
    branch = branch[np.hypot(branch[:, 0], branch[:, 1]) > THICK]
    stem = stem[np.hypot(stem[:, 1], stem[:, 2] - 1) * (stem[:, 0] > 0) + (stem[:, 0] <= 0) > THIN]
    points = np.concatenate([stem, branch])
    return pipelines.tree()(points + request.param * rng.normal(size=points.shape))


def three_limbs(radius=0.5, edges=((0, 1), (1, 2), (1, 3))):
    places = np.array([[0, 0, 0], [0, 0, 10], [0, 0, 20], [10, 0, 10]], float)
    return Skeleton(places, edges, np.full(4, radius), (), (), ())


def test_measures_of_a_tree(tree):
    measures = tree_measures(tree)
    np.testing.assert_allclose(measures.volume, VOLUME, rtol=0.08)
    np.testing.assert_allclose(measures.length, [HEIGHT - THICK / 3, 1 - THICK - THIN / 3], rtol=0.05)
    assert measures.stem_diameter == pytest.approx(2 * THICK, abs=0.01)
    assert measures.height == pytest.approx(HEIGHT, abs=0.05)
    assert measures.crown_base == pytest.approx(1, abs=0.05)
    assert measures.traced == 0


def test_units_and_directions(tree):
    metres, millimetres = asdict(tree_measures(tree)), asdict(tree_measures(tree, unit=0.001))
    assert np.isnan(millimetres["stem_diameter"])  # a tree of two millimetres
    for name, power in (("height", 1), ("length", 1), ("volume", 3)):
        np.testing.assert_allclose(np.multiply(millimetres[name], 1000**power), metres[name])
    with pytest.warns(SkeletonWarning, match="does -z point up"):
        assert tree_measures(tree, up="-z").height < 0.06
    assert tree_measures(tree, root=(0, 0, 2), up="-z").height > 1.9
    assert (tree_measures(tree).up, tree_measures(tree, "x").up) == ("z", "x")  # by default the axis of the root
    assert tree_measures(pipelines.tree("-x")(samples.tube(1000).points)).up == "-x"


def test_cylinders_grow_from_each_other(tree):
    table = cylinders(tree)
    assert (table.parent < np.arange(len(table))).all()
    assert (table.parent < 0).sum() == 1
    inner = np.flatnonzero(table.parent >= 0)
    same = inner[table.order[inner] == table.order[table.parent[inner]]]
    np.testing.assert_allclose(table.start_point[same], table.end_point[table.parent[same]], atol=1e-9)
    assert set(table.order.tolist()) == {0, 1}
    assert [*next(iter(table))][-1] == "volume"
    np.testing.assert_allclose(table.volume, np.pi * table.radius**2 * table.length)


def test_limbs_with_closed_forms():
    table = cylinders(three_limbs(), root=0)
    assert table.order.tolist() == 10 * [0] + 5 * [1]
    np.testing.assert_allclose(table.volume[:10].sum(), np.pi * 0.25 * 20)
    inside = 4 / (3 * np.pi)  # of the branch in the stem, half a Steinmetz solid over its section
    np.testing.assert_allclose(table.length[10:].sum(), 10 - inside, atol=0.005)
    np.testing.assert_allclose(table.start_point[10], [inside, 0, 10], atol=0.005)
    assert table.parent.tolist() == [-1, *range(9), 4, *range(10, 14)]
    rooted = replace(three_limbs(), report=Report(root=(0.0, 0.0, 20.0)))
    assert cylinders(rooted).start_point[0].tolist() == [0, 0, 20]
    with pytest.warns(SkeletonWarning, match="no points"):
        measures = tree_measures(three_limbs(), root=0)
    assert (measures.height, measures.crown_base) == (20, 10)


@pytest.mark.parametrize("degrees", [30, 45, 90, 135])
@pytest.mark.parametrize("thin", [0.1, 0.6, 1.0])
def test_a_branch_begins_where_it_has_left_its_parent(thin, degrees):
    aside = np.array([np.sin(np.deg2rad(degrees)), 0, np.cos(np.deg2rad(degrees))])
    places = [0 * Z, 20 * Z, 40 * Z, 20 * Z + aside, 20 * Z + 10 * aside]
    tree = Skeleton(places, [(0, 1), (1, 2), (1, 3), (3, 4)], [1, 1, 1, thin, thin], (), (), ())
    table = cylinders(tree, root=0)
    v = thin * np.linspace(-1, 1, 20001)  # a strip of its section at v leaves the stem at sqrt(1 - v^2) / sin
    inside = np.average(np.sqrt(1 - v**2), weights=np.sqrt(thin**2 - v**2)) / aside[0]
    assert table.length[table.order == 1].sum() == pytest.approx(10 - inside, abs=0.06)


@pytest.mark.parametrize("options", [{"up": "w"}, {"up": "--z"}, {"unit": 0}, {"unit": np.nan}, {"unit": "mm"}])
def test_wrong_options(options):
    with pytest.raises(InvalidParameterError, match=r"up = |unit = "):
        tree_measures(three_limbs(), **options)


@pytest.mark.parametrize(
    ("skeleton", "cause"),
    [
        (three_limbs(edges=((0, 1), (1, 2), (0, 2))), "1 loops"),
        (three_limbs(edges=()), "4 components"),
        (Skeleton([[0, 0, 0]], [], [1], [0], [[0, 0, 0]], [[0, 0, 1]]), "no branches"),
        (three_limbs(radius=np.nan), "no radii"),
    ],
)
def test_cylinders_need_a_tree_with_radii(skeleton, cause):
    with pytest.raises(InvalidParameterError, match=cause):
        cylinders(skeleton)


@quiet  # twigs that outliers join are close calls, and most of the length is traced
def test_outliers_do_not_change_the_measures():
    points = samples.tree(4096, forks=6, seed=0).points
    outliers = np.random.default_rng(0).uniform(points.min(axis=0), points.max(axis=0), (5, 3))
    noisy = np.concatenate([points, outliers, [[0, 0, 9]]])
    clean, measures = (tree_measures(pipelines.tree()(cloud)) for cloud in (points, noisy))
    assert sum(measures.volume) == pytest.approx(sum(clean.volume), rel=0.05)
    assert measures.height == pytest.approx(clean.height, rel=0.02)


def test_a_file_without_a_report_keeps_its_root(tmp_path):
    grown = pipelines.tree("-z")(samples.tree(4000, forks=2, seed=1).points)
    for ending in ("json", "ply", "swc"):
        save_skeleton(grown, tmp_path / f"t.{ending}")
    first = [cylinders(read_skeleton(tmp_path / f"t.{ending}")).start_point[0] for ending in ("json", "ply", "swc")]
    np.testing.assert_allclose(first[1], first[0], atol=0.1)
    np.testing.assert_allclose(first[2], first[1])
    with pytest.warns(SkeletonWarning):
        assert np.isnan(tree_measures(read_skeleton(tmp_path / "t.ply")).traced)


def stem_shell(radius, height, n, rng, degrees=360.0):
    """Points of a stem of 3 m seen over so many degrees, and a skeleton whose radii are half of the true ones."""
    turn = np.radians(degrees) * (rng.random(n) - 0.5)
    points = np.column_stack([np.cos(turn), np.sin(turn), height * rng.random(n)])
    points[:, :2] *= radius
    level = np.linspace(0, height, 31)
    up = np.column_stack([0 * level, 0 * level, level])
    edges = np.column_stack([np.arange(30), np.arange(1, 31)])
    owner = np.abs(points[:, 2:] - level).argmin(axis=1)
    return Skeleton(up, edges, np.full(31, radius / 2), owner, points, 0 * points, confidence=np.ones(31))


@pytest.mark.parametrize("degrees", [360, 180, 130])
def test_the_stem_is_measured_on_its_points(degrees):
    """Not by the radii of the curve, which are wrong here; a third of the circle is enough."""
    measures = tree_measures(stem_shell(0.15, 3.0, 6000, np.random.default_rng(0), degrees), 0, up="z")
    assert measures.stem_diameter == pytest.approx(0.3, abs=1e-9)
    assert measures.stem_arc == pytest.approx(degrees, abs=10)
    assert measures.doubts == ()


@pytest.mark.parametrize(("degrees", "n"), [(40, 6000), (360, 200)])
def test_a_narrow_arc_or_few_points_give_no_diameter(degrees, n):
    with pytest.warns(SkeletonWarning, match="the diameter of the stem at 1.3 m is not known"):
        measures = tree_measures(stem_shell(0.15, 3.0, n, np.random.default_rng(1), degrees), 0, up="z")
    assert np.isnan([measures.stem_diameter, measures.stem_arc]).all()
    assert len(measures.doubts) == 1


def test_more_wood_than_trees_have_is_in_doubt():
    stem = stem_shell(0.15, 3.0, 6000, np.random.default_rng(2))
    with pytest.warns(SkeletonWarning, match="4 times a cylinder as high and 30 cm thick"):
        tree_measures(replace(stem, radii=np.full(31, 0.3)), 0, up="z")


def test_volume_is_that_of_parts_with_a_surface():
    stem = stem_shell(0.15, 3.0, 6000, np.random.default_rng(3))
    upper = replace(stem, confidence=(np.arange(31) < 16).astype(float))
    whole, half = (tree_measures(skeleton, 0, up="z") for skeleton in (stem, upper))
    assert whole.traced == 0
    table = cylinders(upper, 0)
    assert sum(half.volume) == pytest.approx(table.volume[table.confidence > 0].sum())
    assert sum(half.volume) < 0.7 * sum(whole.volume)
    assert half.traced == pytest.approx(0.4)  # one of ten cylinders has both


def log(length, thin, ends, n, seed=0):
    """Points of a log with radii 1 and `thin`, even by area, and its volume."""
    rng = np.random.default_rng(seed)
    radii = np.array([1.0, thin])
    side = np.pi * radii.sum() * np.hypot(length, 1 - thin)
    caps = {"flat": 1, "open": 0, "round": 2}[ends] * np.pi * radii**2
    areas = np.array([side, *caps])
    part, u, turn = rng.choice(3, n, p=areas / areas.sum()), rng.random(n), 2 * np.pi * rng.random(n)
    radius = np.sqrt(1 + u * (thin**2 - 1))
    height = length * ((1 - radius) / (1 - thin) if thin < 1 else u)
    for k, (r, up, out) in enumerate(zip(radii, (0, length), (-1, 1), strict=True), 1):
        cap = part == k
        radius = np.where(cap, r * (np.sqrt(u) if ends == "flat" else np.sqrt(1 - u**2)), radius)
        height = np.where(cap, up + (out * r * u if ends == "round" else 0), height)
    volume = np.pi * length * (1 + thin + thin**2) / 3 + (2 / 3 * np.pi * (radii**3).sum() if ends == "round" else 0)
    return np.column_stack([radius * np.cos(turn), radius * np.sin(turn), height]), volume


@quiet
@pytest.mark.parametrize("ends", ["flat", "open", "round"])
@pytest.mark.parametrize("thin", [1.0, 0.7, 0.5])
@pytest.mark.parametrize("length", [6, 10, 24])
def test_the_volume_of_a_log(length, thin, ends):
    points, volume = log(length, thin, ends, 3000)
    assert cylinders(pipelines.tree()(points)).volume.sum() == pytest.approx(volume, rel=0.03)


def flared(seed, lean):
    """A stem from z = 0.7 to 6.7 whose foot runs aside along a root, cut at that height."""
    rng = np.random.default_rng(seed)
    height, turn = 6 * rng.random(4000) ** 1.5, 2 * np.pi * rng.random(4000)
    radius = 0.25 + 0.15 * np.exp(-height / 0.3)
    aside = -lean * np.exp(-height / 0.4)
    return np.column_stack([aside + radius * np.cos(turn), radius * np.sin(turn), 0.7 + height])


@quiet
@pytest.mark.parametrize("lean", [0, 0.6, 1.0])
@pytest.mark.parametrize("seed", range(2))
def test_a_tree_begins_where_its_points_do(lean, seed):
    points = flared(seed, lean)
    skeleton = pipelines.tree()(points)
    measures, table = tree_measures(skeleton), cylinders(skeleton)
    assert measures.height == pytest.approx(np.ptp(points[:, 2]), abs=1e-9)
    lowest = points[:, 2].min()
    assert lowest - 1e-9 <= measures.root[2] <= lowest + 0.1
    assert table.start_point[:, 2].min() >= lowest - 1e-9
    assert measures.stem_diameter == pytest.approx(0.5, rel=0.05)


@quiet
@pytest.mark.parametrize("up", ["x", "z", "-z"])
def test_a_lying_stem_begins_at_its_foot(up):
    """Not at the lowest place of its side."""
    skeleton = pipelines.tree("x")(log(10, 1.0, "flat", 3000)[0][:, [2, 0, 1]])
    assert cylinders(skeleton, up=up).start_point[0] == pytest.approx([0, 0, 0], abs=0.06)


def distance_to_line(points, a, b):
    """From points to the line between two places."""
    share = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
    return np.linalg.norm(points - a - share[:, None] * (b - a), axis=1)


@quiet
@pytest.mark.parametrize("degrees", [30, 40, 50, 60, 75])
@pytest.mark.parametrize("thin", [0.3, 0.6, 1.0])
def test_the_angle_of_a_branch_is_read_beyond_the_stem(thin, degrees):
    rng, fork = np.random.default_rng(1), 9 * Z
    direction = np.array([np.sin(np.radians(degrees)), 0, np.cos(np.radians(degrees))])
    stem, branch = limb(0 * Z, Z, 20, 1.0, 6000, rng), limb(fork, direction, 10, thin, int(3000 * thin), rng)
    stem = stem[distance_to_line(stem, fork, fork + (10 - thin) * direction) > thin]
    branch = branch[np.hypot(branch[:, 0], branch[:, 1]) > 1]
    table = branch_table(pipelines.tree()(np.concatenate([stem, branch])))
    lateral = np.flatnonzero(table.order == 1)
    assert table.angle[lateral[table.length[lateral].argmax()]] == pytest.approx(degrees, abs=4)


@quiet
@pytest.mark.parametrize("seed", range(3))
def test_twigs_of_single_points_have_cylinders_with_a_radius_and_some_length(seed):
    """Most of a slice has one point, through which the curve runs."""
    rng = np.random.default_rng(seed)
    lines = [(0 * Z, 2 * Z), *((2 * Z, 2 * Z + 3 * np.array([np.cos(t), np.sin(t), 0.7])) for t in (0, 2, 4))]
    points = np.concatenate([a + np.sort(rng.random((120, 1)), axis=0) * (b - a) for a, b in lines])
    points += 0.01 * rng.normal(size=points.shape)
    skeleton = pipelines.tree()(points)
    assert skeleton.report.n_traced > 400
    table = cylinders(skeleton)
    assert table.radius.min() > 0.001
    assert np.quantile(skeleton.radii, 0.9) < 0.03
    assert np.bincount(table.branch).max() <= 60


def arc(degrees, n, noise, rng, radius=1.0, centre=(5.0, 7.0)):
    turn = np.radians(degrees) * (rng.random(n) - 0.5) + rng.uniform(0, 2 * np.pi)
    wide = radius + noise * rng.normal(size=n)
    return centre + wide[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])


@pytest.mark.parametrize("degrees", [360, 180, 90, 30])
def test_points_on_a_circle(degrees):
    fit = fit_circle(arc(degrees, 100, 0, np.random.default_rng(0), 0.2))
    assert fit.radius == pytest.approx(0.2, rel=1e-9)
    assert fit.arc == pytest.approx(degrees, abs=15)
    assert fit.points == 100


def test_outliers_and_clumps_do_not_move_a_circle():
    """A shrub beside the stem, or two twigs hardly off the circle opposite to an arc, which would weigh most."""
    rng = np.random.default_rng(1)
    wood = arc(200, 120, 0, rng)
    fit = fit_circle(np.concatenate([wood, wood.mean(axis=0) + rng.uniform(-3, 3, (60, 2))]))
    assert fit.radius == pytest.approx(1, rel=0.01)
    shrub = wood.mean(axis=0) + [2, 0] + 0.1 * rng.normal(size=(80, 2))
    assert fit_circle(np.concatenate([wood, shrub])).radius == pytest.approx(1, rel=1e-6)
    wood = arc(120, 60, 0.02, rng, centre=(0, 0))
    middle = np.arctan2(*wood.mean(axis=0)[::-1])
    twigs = 1.09 * np.array([[np.cos(middle + turn), np.sin(middle + turn)] for turn in (2.9, 3.1)])
    plain, fit = fit_circle(wood), fit_circle(np.concatenate([wood, twigs]))
    assert (fit.radius, fit.points) == (pytest.approx(plain.radius, rel=1e-6), plain.points)


@pytest.mark.parametrize("degrees", [360, 180, 120])
def test_the_error_of_a_radius_is_that_of_many_circles(degrees):
    """Of noise alone, besides which waves of the section count, too."""
    rng, n, noise = np.random.default_rng(degrees), 50, 0.05
    fits = [fit_circle(arc(degrees, n, noise, rng)) for _ in range(300)]
    spread = np.quantile([abs(fit.radius - 1) for fit in fits], 0.683)
    said = np.median([fit.error for fit in fits]) * np.sqrt(noise**2 / (noise**2 + n * WAVINESS**2))
    assert spread == pytest.approx(said, rel=0.2)


@pytest.mark.parametrize("degrees", [180, 120, 80])
def test_ovals_are_within_twice_the_error(degrees):
    rng, wrong = np.random.default_rng(degrees), []
    for _ in range(200):
        points = arc(degrees, 300, 0.01, rng, centre=(0, 0))
        turn = np.arctan2(*points.T[::-1]) + rng.uniform(0, 7)
        fit = fit_circle(points * (1 + rng.uniform(0, 0.03) * np.cos(2 * turn))[:, None])
        wrong.append(abs(fit.radius - 1) > 2 * fit.error)
    assert 1 - np.mean(wrong) > 0.95


def test_a_whole_circle_of_many_points_is_known_as_well_as_it_is_round():
    fit = fit_circle(arc(360, 400, 0.1, np.random.default_rng(2)))
    assert fit.error == pytest.approx(np.hypot(0.1 / np.sqrt(400), 0.01), rel=0.1)


@quiet
@pytest.mark.parametrize(("degrees", "noise", "doubted"), [(150, 0, 0), (360, 0.01, 0), (100, 0, 1), (130, 0.03, 1)])
def test_a_diameter_that_few_degrees_or_much_noise_show_is_in_doubt(degrees, noise, doubted):
    rng = np.random.default_rng(0)
    shell = stem_shell(0.15, 3.0, 6000, rng, degrees)
    noisy = replace(shell, points=shell.points + noise * rng.normal(size=(6000, 3)))
    measures = tree_measures(noisy, 0, up="z")
    assert [
        f"standard deviation of {100 * measures.stem_error:.0f} %" in text for text in measures.doubts
    ] == doubted * [True]
    assert measures.stem_diameter == pytest.approx(0.3, rel=3 * measures.stem_error)


def test_the_arc_is_where_points_are():
    angles = np.radians(np.r_[np.arange(0, 91), np.arange(180, 241)])
    assert fit_circle(np.column_stack([np.cos(angles), np.sin(angles)])).arc == pytest.approx(150, abs=1)


@pytest.mark.parametrize(
    "points", [np.eye(3)[:, :2], np.empty((0, 2)), np.ones((20, 2)), np.arange(50.0)[:, None] * [1, 0]]
)
def test_few_points_and_lines_have_no_circle(points):
    assert fit_circle(points) is None


def cone(height, radius, n, rng):
    """Points on the side of a cone that stands on the ground, even by area, with a curve to its tip as skeleton."""
    level = height * (1 - np.sqrt(rng.random(n)))
    turn = 2 * np.pi * rng.random(n)
    wide = radius * (1 - level / height)
    points = np.column_stack([wide * np.cos(turn), wide * np.sin(turn), level])
    axis = np.linspace(0, height, 101)
    edges = np.column_stack([np.arange(100), np.arange(1, 101)])
    owner = np.abs(points[:, 2:] - axis).argmin(axis=1)
    up = np.column_stack([0 * axis, 0 * axis, axis])
    radii = radius * (1 - axis / height)
    return Skeleton(up, edges, radii, owner, points, 0 * points, confidence=np.ones(101))


@quiet
def test_taper_volume_and_classes_of_a_cone():
    """D = 2 r (1 - z / h), V = pi r^2 h / 3, and as much between two diameters as between two heights."""
    height, radius = 10.0, 0.3
    skeleton = cone(height, radius, 40000, np.random.default_rng(0))
    trunk, measures = analysis.stem(skeleton, 0, up="z"), tree_measures(skeleton, 0, up="z")
    for level in (0.5, 1.3, 4.0, 8.0):
        assert trunk.diameter_at(level) == pytest.approx(2 * radius * (1 - level / height), rel=0.005)
    assert np.isnan(trunk.diameter_at(11))
    heights = [section["height"] for section in measures.taper]
    np.testing.assert_allclose(heights, 0.5 * np.arange(1, 20))
    for section in measures.taper[:18]:
        assert section["diameter"] == pytest.approx(2 * radius * (1 - section["height"] / height), rel=0.01)
        assert section["cylinder_diameter"] == pytest.approx(section["diameter"], abs=2 * radius * 0.12)
    volume = np.pi * radius**2 * height / 3
    assert measures.volume_with_traced == measures.volume_without_traced == pytest.approx(volume, rel=0.02)
    fine = diameter_classes(cylinders(skeleton, 0), width=0.2)
    assert [round(each["low"], 9) for each in fine] == [0, 0.2, 0.4]
    share = np.array([each["volume_with_traced"] for each in fine]) / volume
    np.testing.assert_allclose(share, np.diff([0, 1 / 27, 8 / 27, 1]), atol=0.12)  # cylinders are four radii long
    assert sum(each["length_with_traced"] for each in measures.classes) == pytest.approx(measures.length_with_traced)


@pytest.mark.parametrize("unit", [1.0, 0.001])
@quiet
def test_the_hull_of_a_crown_that_is_a_cone(unit):
    """Branches in a circle reach down from the top: the hull is a cone, and only the stem is below it."""
    turn = 2 * np.pi * np.arange(64) / 64
    ends = np.column_stack([2 * np.cos(turn), 2 * np.sin(turn), 0 * turn + 5])
    places = np.concatenate([[[0, 0, 0], [0, 0, 8.0], [0, 0, 8.1]], ends]) / unit
    edges = [(0, 1), (1, 2), *((1, 3 + k) for k in range(64))]
    skeleton = Skeleton(places, edges, np.full(67, 0.01) / unit, np.arange(67), places, 0 * places)
    measures = tree_measures(skeleton, 0, up="z", unit=unit)
    assert measures.crown_base == pytest.approx(8, abs=0.1)
    area = 32 * 4 * np.sin(2 * np.pi / 64)
    assert measures.crown_area == pytest.approx(area)
    assert measures.crown_volume == pytest.approx(area * 3.1 / 3, rel=1e-6)


def test_lengths_and_volumes_with_and_without_traced_parts():
    trunk = stem_shell(0.15, 3.0, 6000, np.random.default_rng(3))
    upper = replace(trunk, confidence=(np.arange(31) < 16).astype(float))
    measures, table = tree_measures(upper, 0, up="z"), cylinders(upper, 0)
    assert measures.length_with_traced == pytest.approx(table.length.sum())
    assert measures.volume_with_traced == pytest.approx(table.volume.sum())
    assert measures.length_without_traced == pytest.approx(0.6 * measures.length_with_traced)
    assert measures.volume_without_traced == pytest.approx(sum(measures.volume))
    assert {"stem_diameter", "crown_area", "volume_with_traced", "doubts"} <= measures.sums().keys()
    assert np.isnan(tree_measures(replace(trunk, confidence=np.full(31, np.nan)), 0, up="z").length_without_traced)


def test_a_tree_that_is_mostly_traced_needs_leaf_off():
    trunk = stem_shell(0.15, 3.0, 6000, np.random.default_rng(3))
    with pytest.warns(SkeletonWarning, match="60 % of the length has no surface.* needs leaf-off"):
        tree_measures(replace(trunk, confidence=(np.arange(31) < 10).astype(float)), 0, up="z")


def with_leaves(bare, size, share, seed):
    """Points of discs at random places up to 20 cm from the thinner half of a tree, so many for each of its own."""
    rng = np.random.default_rng(seed)
    thin = bare.edges[bare.radii[bare.edges].max(axis=1) < np.median(bare.radii)]
    n, k = int(share * len(bare.points)), int(share * len(bare.points) / 20)
    a, b = bare.nodes[thin[rng.integers(len(thin), size=k)]].swapaxes(0, 1)
    middle = a + rng.random((k, 1)) * (b - a) + 0.1 * rng.normal(size=(k, 3))
    axes = np.linalg.qr(rng.normal(size=(k, 3, 3)))[0][:, :2]
    leaf, turn, far = rng.integers(k, size=n), 2 * np.pi * rng.random(n), size * np.sqrt(rng.random(n))
    across = np.stack([far * np.cos(turn), far * np.sin(turn)], axis=1)
    return np.concatenate([bare.points, middle[leaf] + (across[:, :, None] * axes[leaf]).sum(axis=1)])


@quiet
@pytest.mark.parametrize(("forks", "seed"), [(2, 1), (4, 2)])
@pytest.mark.parametrize(("size", "share"), [(0.03, 0), (0.03, 0.4), (0.02, 1), (0.05, 2)])
def test_leaves_are_told_from_bare_twigs(size, share, forks, seed):
    bare = samples.tree(12000, forks=forks, length=2, radius=0.1, seed=seed, noise=0.0005 * seed)
    points = with_leaves(bare, size, share, seed) if share else bare.points
    doubts = tree_measures(pipelines.tree()(points)).doubts
    assert any("needs leaf-off" in doubt for doubt in doubts) == (share > 0)
