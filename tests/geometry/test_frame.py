"""The working frame and the Morton order."""

import numpy as np
import pytest

from glsk_o3d.errors import InvalidCloudError
from glsk_o3d.geometry.frame import FRAME_SIDE, Frame, check_extent
from glsk_o3d.geometry.morton import morton_order

CLOUD = np.random.default_rng(0).normal(size=(500, 3)) * [1, 3, 0.2]


@pytest.mark.parametrize("scale", [1e-300, 1.0, 1e300])
@pytest.mark.parametrize("offset", [0, 1e6])
def test_a_frame_is_centred_and_1_6_wide(scale, offset):
    points = (CLOUD + offset) * scale
    frame = Frame.of(points)
    inside = frame.into(points)
    digits = 4e-16 * max(1, abs(offset))
    np.testing.assert_allclose(inside.max(axis=0), frame.half_extent, atol=digits)
    np.testing.assert_allclose(inside.min(axis=0), -frame.half_extent, atol=digits)
    assert 2 * frame.half_extent.max() == pytest.approx(FRAME_SIDE, rel=1e-15)
    assert frame.diagonal == pytest.approx(np.linalg.norm(np.ptp(inside, axis=0)), rel=1e-9)
    np.testing.assert_allclose(frame.out_of(inside), points, atol=digits * scale * 10, rtol=0)


def test_a_frame_of_a_large_offset_costs_no_digits():
    exact = np.round(CLOUD * 2**20) / 2**20  # sums with the offset are exact
    near, far = Frame.of(exact), Frame.of(exact + 1e6)
    np.testing.assert_array_equal(far.into(exact + 1e6), near.into(exact))
    np.testing.assert_allclose(far.out_of(near.into(exact)), exact + 1e6, atol=3e-10, rtol=0)


# ---- the box with the spread of the points


def size(frame):
    """Longest side and diagonal in the user's units."""
    return np.array([FRAME_SIDE, frame.diagonal]) * frame.scale


@pytest.mark.parametrize("sides", [(1, 3, 2), (7, 0.5, 0), (0, 0, 2)])
def test_the_spread_of_an_evenly_filled_box_is_that_box(sides):
    """Middles of n^3 equal cells of it: n points to a side have 1 - 1 / n^2 of its variance."""
    n = 5
    share = (np.arange(n) + 0.5) / n - 0.5
    points = np.stack(np.meshgrid(share, share, share), axis=-1).reshape(-1, 3) * sides
    expected = np.array([max(sides), np.linalg.norm(sides)])
    np.testing.assert_allclose(size(Frame.of(points, "spread")), expected * np.sqrt(1 - 1 / n**2), rtol=1e-12)
    # the bounding box of the middles lacks half a cell on every side
    np.testing.assert_allclose(size(Frame.of(points)), expected * (1 - 1 / n), rtol=1e-12)


@pytest.mark.parametrize("scale", [1e-12, 1e12])
def test_the_spread_turns_and_scales_with_the_cloud(scale):
    rng, shift = np.random.default_rng(0), 1e4
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    moved = (rng.permutation(CLOUD) @ turn + shift) * scale
    frame, expected = Frame.of(moved, "spread"), Frame.of(CLOUD, "spread")
    np.testing.assert_allclose(size(frame), size(expected) * scale, rtol=1e-12)
    assert frame.diagonal == pytest.approx(expected.diagonal, rel=1e-12)
    # unlike those of the bounding box
    assert np.abs(size(Frame.of(moved)) / size(Frame.of(CLOUD)) / scale - 1).max() > 0.01


# ---- Morton order


def test_the_morton_order_is_that_of_interleaved_integers():
    """Bits of x, y, z, x lowest."""

    def code(cell):
        return sum(((int(c) >> bit) & 1) << (3 * bit + axis) for bit in range(21) for axis, c in enumerate(cell))

    cells = np.random.default_rng(0).integers(0, 2**21, (300, 3))
    cells[:2] = [0, 0, 0], [2**21 - 1] * 3  # these span the box, so that cells are what they are
    expected = sorted(range(300), key=lambda i: code(cells[i]))
    assert morton_order(cells.astype(float)).tolist() == expected


@pytest.mark.parametrize(("offset", "fine"), [(1e12, True), (1e13, True), (2e14, False), (1e15, False)])
def test_a_cloud_that_rounding_destroys_is_refused(offset, fine):
    points = CLOUD + [0, offset, 0]
    if fine:
        return check_extent(points)
    with pytest.raises(InvalidCloudError, match="rounding"):
        check_extent(points)
