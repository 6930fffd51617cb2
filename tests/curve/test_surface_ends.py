"""With ends = "surface" lengths are those of objects; by default ends stop inside."""

import numpy as np
import pytest

from glsk_o3d import pipelines

pytestmark = pytest.mark.filterwarnings("ignore::glsk_o3d.SkeletonWarning")
TO_SURFACE = pipelines.default().with_options(ends="surface")


def even(n, areas, rng):
    """A part of the surface for every point."""
    return rng.choice(len(areas), n, p=np.array(areas, float) / np.sum(areas))


def square_bar(n, rng, length=20.0, wide=1.0):
    part, (x, y), z = even(n, [length] * 2 + [wide * length] * 2 + [wide] * 2, rng), rng.uniform(-1, 1, (2, n)), None
    x, z = wide * x, length * rng.random(n)
    x = np.where(part < 2, np.where(part == 0, wide, -wide), x)
    y = np.where((part == 2) | (part == 3), np.where(part == 2, 1, -1), y)
    return np.column_stack([x, y, np.where(part > 3, np.where(part == 4, 0, length), z)])


def round_bar(n, rng, length=20.0, ends="flat"):
    cap = {"flat": 1, "open": 0, "round": 2}[ends]
    part, u, turn = even(n, [2 * length, cap, cap], rng), rng.random(n), 2 * np.pi * rng.random(n)
    inner = np.sqrt(u) if ends == "flat" else np.sqrt(1 - u**2)
    radius, out = np.where(part > 0, inner, 1), np.where(part > 0, u * (ends == "round"), 0)
    height = np.choose(part, [length * u, -out, length + out])
    return np.column_stack([radius * np.cos(turn), radius * np.sin(turn), height])


def cone(n, rng, length=10.0):
    part, u, turn = even(n, [np.hypot(length, 1), 1], rng), np.sqrt(rng.random(n)), 2 * np.pi * rng.random(n)
    return np.column_stack([u * np.cos(turn), u * np.sin(turn), np.where(part == 0, length * (1 - u), 0)])


SHAPES = {  # what draws it, its length, and what may be short or long of it without noise
    "round bar": (round_bar, 20, 0.01),
    "square bar": (square_bar, 20, 0.01),
    "open tube": (lambda n, rng: round_bar(n, rng, ends="open"), 20, 0.01),
    "short pin": (lambda n, rng: round_bar(n, rng, 8, ends="round"), 10, 0.015),
    "flat bar": (lambda n, rng: square_bar(n, rng, wide=2.0), 20, 0.01),
    "cone": (cone, 10, 0.06),  # hardly any points are near the apex
}


def drawn(name, n, noise, seed=0):
    draw, length, error = SHAPES[name]
    rng = np.random.default_rng(seed)
    points = draw(n, rng)
    return points + noise * np.linalg.norm(np.ptp(points, axis=0)) * rng.normal(size=points.shape), length, error


@pytest.mark.parametrize(("n", "noise"), [(1000, 0), (4000, 0.005)])
@pytest.mark.parametrize("name", SHAPES)
def test_a_curve_to_the_surface_is_as_long_as_its_object(name, n, noise):
    """Noise of half a percent of the diagonal makes a face somewhat round: it is a tenth of the radius of a bar."""
    points, length, error = drawn(name, n, noise)
    skeleton = TO_SURFACE(points)
    assert len(skeleton.leaves) == 2
    assert skeleton.length == pytest.approx(length, rel=error + noise)
    # among few points the axis turns a little
    assert noise or skeleton.vertices[:, 2].max() < points[:, 2].max() + 0.1


def test_a_curve_to_the_surface_changes_at_its_ends_alone():
    points = drawn("round bar", 4000, 0.0)[0]
    inside, outside = pipelines.default()(points), TO_SURFACE(points)
    assert inside.length == pytest.approx(19, rel=0.01)
    middle = [skeleton.vertices[np.abs(skeleton.vertices[:, 2] - 10) < 7] for skeleton in (inside, outside)]
    np.testing.assert_array_equal(*(places[np.argsort(places[:, 2])] for places in middle))
