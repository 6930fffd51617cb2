"""The table of edge cases, over skeletonize with every named pipeline, and so over every filter of one."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

import glsk_o3d as glsk
from glsk_o3d import InvalidCloudError, SkeletonWarning, pipelines, samples, skeletonize

NAMES = ("default", *(pytest.param(name, marks=pytest.mark.slow) for name in pipelines.PIPELINES if name != "default"))
RNG = np.random.default_rng(0)
Y = samples.y_junction(n=300).points
TORUS = samples.torus(n=300).points
FEW = RNG.normal(size=(12, 3))

CORNERS = np.stack(np.meshgrid([-1.0, 1], [-1.0, 1], [-1.0, 1]), -1).reshape(-1, 3)
READ_ONLY = Y.copy()
READ_ONLY.setflags(write=False)

# Clouds that have a skeleton, be it worth little.
SOUND = {
    "8 points": FEW[:8],
    "corners of a cube": CORNERS,
    "every point twice": np.repeat(TORUS, 2, axis=0),
    "doubled but for rounding": np.concatenate([TORUS, TORUS * (1 + 1e-15)]),
    "collinear": np.outer(np.linspace(0, 1, 100), [1, 2, 3]),
    "two crossing lines": np.concatenate([np.outer(np.arange(-20, 21), axis) for axis in np.eye(3)[:2]]),
    "circle": np.stack([np.cos(a := np.arange(60) / 60 * 2 * np.pi), np.sin(a), 0 * a], axis=1),
    "coplanar": Y * [1, 0, 1],
    "full cubic grid": np.stack(np.meshgrid(*[np.arange(6.0)] * 3), -1).reshape(-1, 3),
    "two components": np.concatenate([Y, Y + [3, 0, 0]]),
    "two distant specks": np.concatenate([Y * 1e-12, Y * 1e-12 + [1, 0, 0]]),
    "an outlier": np.concatenate([Y, [[100.0, 100, 100]]]),
    "a far outlier": np.concatenate([Y, [[1e9, 0, 0]]]),
    "1e-100 as large": Y * 1e-100,
    "1e100 times as large": Y * 1e100,
    "points a subnormal apart": np.concatenate([CORNERS, samples.sphere(n=80).points, Y[:30] * 1e-155]),
    "float32": Y.astype(np.float32),
    "big-endian": Y.astype(">f8"),
    "whole numbers": (Y * 1000).astype(int),
    "bytes": (Y * 100 + 100).astype(np.uint8),
    "list": Y.tolist(),
    "read-only": READ_ONLY,
    "Fortran order": np.asfortranarray(Y),
    "sphere": samples.sphere(n=300).points,
    "sheet": samples.sheet(n=300).points,
}

NAN = Y.copy()
NAN[[2, 7]] = [[np.nan, 0, 0], [0, 0, -np.inf]]
MASKED = np.ma.masked_greater(Y, 0)

# What is refused, and the words that help.
REFUSED = {
    "nothing": (np.empty((0, 3)), "empty"),
    **{f"{n} points": (FEW[:n], rf"{n} .*at least 8") for n in (1, 7)},
    "all equal": (np.full((50, 3), 1e6 + 0.1), "coincide"),
    "7 distinct ones": (np.repeat(FEW[:7], 20, axis=0), "7 distinct"),
    "NaN and infinity": (NAN, "index 2.*drop_invalid"),
    "too wide for float64": (np.concatenate([Y, [[1.5e308, 0, 0], [-1.5e308, 0, 0]]]), "rescale"),
    "two columns": (Y[:, :2], r"\(300, 2\)"),
    "one dimension": (Y.ravel(), r"\(900,\)"),
    "a number": (3.5, "float"),
    "nothing at all": (None, "NoneType"),
    "file name": ("scan.ply", "read_cloud"),
    "complex": (Y * 1j, "complex"),
    "objects": (Y.astype(object), "object"),
    "ragged": ([[1, 2, 3], [4, 5]], "list"),
    "masked": (MASKED, "masked"),
}


def run(cloud, pipeline):
    """The skeleton; only warnings of our own are allowed, and they must be in the report."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        skeleton = skeletonize(cloud, pipeline)
    assert [w for w in caught if w.category is not SkeletonWarning] == []
    assert tuple(str(w.message) for w in caught) == skeleton.report.warnings
    return skeleton


def held_bytes(cloud):
    return np.asarray(cloud).tobytes()


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("case", SOUND)
def test_a_sound_cloud_has_a_sound_skeleton(case, name, assert_sound):
    cloud = SOUND[case]
    before = held_bytes(cloud)
    skeleton = run(cloud, name)
    assert held_bytes(cloud) == before
    points = np.asarray(cloud, float)
    assert_sound(skeleton, len(points))
    np.testing.assert_array_equal(skeleton.points, points)
    # nothing runs away: the contraction may use 1.2 times the box, of a uniform bar as wide as the points are spread
    low, high = points.min(axis=0), points.max(axis=0)
    spread = 0.6 * 12**0.5 * points.std(axis=0).max() - np.ptp(points, axis=0).max() / 2
    slack = max(0.1 * np.linalg.norm(high - low), spread) + 1e-15 * np.abs(points).max()
    assert (skeleton.vertices >= low - slack).all()
    assert (skeleton.vertices <= high + slack).all()


@pytest.mark.parametrize("case", REFUSED)
def test_an_unusable_cloud_is_refused(case):
    cloud, message = REFUSED[case]
    with pytest.raises(InvalidCloudError, match=message):
        run(cloud, "default")


PLAIN = ("float32", "whole numbers", "bytes", "list", "Fortran order", "big-endian")


@pytest.mark.parametrize("name", NAMES)
def test_invalid_points_can_be_dropped(name, assert_sound):
    builder, *others = pipelines.PIPELINES[name]().stages
    dropping = glsk.Pipeline(replace(builder, drop_invalid=True), *others)
    skeleton = run(NAN, dropping)
    assert_sound(skeleton, 300, n_dropped=2)
    np.testing.assert_array_equal(np.flatnonzero(skeleton.vertex_of_point < 0), [2, 7])
    assert np.isnan(skeleton.normals[[2, 7]]).all()
    clean = run(np.delete(Y, [2, 7], axis=0), name)
    np.testing.assert_array_equal(skeleton.vertices, clean.vertices)
    np.testing.assert_array_equal(skeleton.edges, clean.edges)
    np.testing.assert_array_equal(np.delete(skeleton.vertex_of_point, [2, 7]), clean.vertex_of_point)
    few = NAN.copy()
    few[7:] = np.inf
    with pytest.raises(InvalidCloudError, match="6 "):
        run(few, dropping)


@pytest.mark.parametrize("name", NAMES)
def test_balls_and_sheets_are_warned_of(name):
    for case, kind in (("sphere", "-like"), ("sheet", "sheet-like")):
        assert any(kind in message for message in run(SOUND[case], name).report.warnings)


@pytest.mark.parametrize("kind", ["noisy sphere", "solid ball", "surface of a cube"])
def test_objects_as_thick_as_long_are_warned_of(kind):
    rng = np.random.default_rng(0)
    out = rng.normal(size=(1024, 3))
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    cloud = {
        "noisy sphere": out + 0.07 * rng.normal(size=(1024, 3)),
        "solid ball": out * rng.random((1024, 1)) ** (1 / 3),
        "surface of a cube": out / np.abs(out).max(axis=1, keepdims=True),
    }[kind]
    assert [text.partition(":")[0] for text in run(cloud, "default").report.warnings] == ["sphere-like"]


@pytest.mark.parametrize("name", [*pipelines.PIPELINES])
def test_copies_count_once(name):
    single, doubled = run(TORUS, name), run(SOUND["every point twice"], name)
    assert_equal_curves(doubled, single)
    np.testing.assert_array_equal(doubled.vertex_of_point, np.repeat(single.vertex_of_point, 2))


@pytest.mark.parametrize("distance", [1e-15, 1e-11, 1e-8])
def test_copies_are_points_much_nearer_than_the_spacing(distance):
    """Copies moved by much less than the points are apart; and a small object beside a large one is none."""
    rng, cloud = np.random.default_rng(0), samples.sauropod(2500).points
    moved = [cloud + distance * rng.normal(size=cloud.shape) for _ in range(4)]
    several, single = run(np.concatenate([cloud, *moved]), "default"), run(cloud, "default")
    assert several.report.n_distinct == len(cloud)
    assert [several.n_components, several.n_loops, len(several.leaves)] == [1, single.n_loops, len(single.leaves)]
    beside = glsk.Sampler(size="all")(np.concatenate([1e-6 * cloud, cloud + [5, 0, 0]]))
    assert len(beside.cloud) == 5000
    assert len(glsk.Sampler(size="all")(np.outer(np.logspace(-9, 0, 3000), [1, 2, 3])).cloud) == 3000


def assert_equal_curves(one, other):
    for name in ("vertices", "edges", "radii"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


@pytest.mark.parametrize("case", PLAIN)
def test_layout_and_type_do_not_matter(case):
    given, plain = run(SOUND[case], "default"), run(np.array(SOUND[case], float), "default")
    np.testing.assert_array_equal(given.vertices, plain.vertices)
    np.testing.assert_array_equal(given.edges, plain.edges)
