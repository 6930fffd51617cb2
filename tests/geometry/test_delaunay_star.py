"""The ring kernel against convex hulls in exact arithmetic; test_ring_builder.py has SciPy's Delaunay."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glsk_o3d.geometry.delaunay_star import delaunay_star


def star(offsets, valid=None):
    """Ring of one neighbourhood as a list, and whether it is closed."""
    valid = None if valid is None else np.asarray(valid)[None]
    ring, closed = delaunay_star(np.asarray(offsets, float)[None], valid)
    return ring[0][ring[0] >= 0].tolist(), bool(closed[0])


def exact_star(offsets, valid):
    """The documented star in rational arithmetic, as offsets: counter-clockwise, a fan from its first border neighbour.

    Strict corners of the convex hull of the images 1 / x, and the origin wherever it is not strictly inside.
    """
    used = {point for point, use in zip(offsets, valid, strict=True) if use and any(point)}
    images = {(Fraction(x, x * x + y * y), Fraction(y, x * x + y * y)): (x, y) for x, y in used}
    origin = (Fraction(0), Fraction(0))
    points = sorted([*images, origin])

    def turn(a, b, c):
        return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])

    def chain(path):
        hull = []
        for p in path:  # the origin stays a corner where it lies on an edge
            while (
                len(hull) > 1
                and turn(hull[-2], hull[-1], p) <= 0
                and not (hull[-1] == origin and turn(hull[-2], hull[-1], p) == 0)
            ):
                hull.pop()
            hull.append(p)
        return hull

    if all(turn(points[0], points[-1], p) == 0 for p in points):
        ends = [p for p in (points[0], points[-1]) if p != origin]
        return [images[p] for p in ends], False
    lower, upper = chain(points), chain(points[::-1])
    hull = lower[:-1] + upper[:-1]
    if origin in hull:
        at = hull.index(origin)
        return [images[p] for p in hull[at + 1 :] + hull[:at]], False
    return [images[p] for p in hull], True


def turned(sequence):
    """A cyclic sequence from its least element."""
    at = sequence.index(min(sequence))
    return sequence[at:] + sequence[:at]


# ---- degenerate neighbourhoods, by the thousand: small integers are often collinear, cocircular, doubled

WHOLE = st.integers(-4, 4)


@pytest.mark.slow
@settings(max_examples=800)
@given(st.lists(st.tuples(WHOLE, WHOLE, st.booleans() | st.just(True)), min_size=1, max_size=14))
def test_a_star_is_that_of_exact_arithmetic(rows):
    offsets, valid = [row[:2] for row in rows], [row[2] for row in rows]
    expected, closed = exact_star(offsets, valid)
    ring, is_closed = star(offsets, valid)
    actual = [offsets[j] for j in ring]
    assert is_closed == closed
    assert all(valid[j] for j in ring)
    if closed:
        assert turned(actual) == turned(expected)
        assert sum(c * c for c in actual[0]) == min(sum(c * c for c in p) for p in actual)
    else:
        straight = len(expected) == 2 and expected[0][0] * expected[1][1] == expected[0][1] * expected[1][0]
        assert actual == expected or (straight and actual == expected[::-1])


def test_a_star_in_a_hardly_disturbed_grid_is_that_of_exact_arithmetic():
    """Squares with corners off by 1e-8 of their side: four neighbours are nearly, but not, on one circle."""
    rng, side = np.random.default_rng(0), np.arange(-2, 3) * 10**12
    grid = np.stack(np.meshgrid(side, side), -1).reshape(-1, 2)
    grid = grid[np.abs(grid).sum(axis=1) > 0]
    for _ in range(50):
        offsets = [tuple(row) for row in (grid + rng.integers(-(10**4), 10**4, grid.shape)).tolist()]
        expected, closed = exact_star(offsets, [True] * len(offsets))
        ring, is_closed = star(offsets)
        assert is_closed == closed
        assert turned([offsets[j] for j in ring]) == turned(expected)
