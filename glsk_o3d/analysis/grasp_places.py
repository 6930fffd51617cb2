"""Where along a skeleton a gripper could close, and from which directions."""

from __future__ import annotations

import numpy as np


def places_along(skeleton, path, spacing, margin):
    """Places along a branch, (n, 9): position, axis, radius, its slope, confidence."""
    curve, radii = skeleton.vertices[path], skeleton.radii[path]
    along = np.r_[0, np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))]
    length = along[-1]
    if not length > 0:
        return np.empty((0, 9))
    closed = path[0] == path[-1] and skeleton.degree[path[0]] == 2
    usual = np.nanmedian(radii) if np.isfinite(radii).any() else 0.0
    step = spacing or usual or length / 10
    low, high = 0.0, length
    if closed:
        count = max(round(length / step), 1)
        at = length / count * np.arange(count)
    else:
        low, high = margin * np.nan_to_num(radii[0]), length - margin * np.nan_to_num(radii[-1])
        if low > high:
            return np.empty((0, 9))
        count = int((high - low) / step * (1 + 1e-12)) + 1
        at = (low + high) / 2 + step * (np.arange(count) - (count - 1) / 2)

    values = np.column_stack([curve, radii, skeleton.confidence[path]])

    def sample(places):
        period = {"period": length} if closed else {}
        return np.column_stack([np.interp(places, along, column, **period) for column in values.T])

    here = sample(at)
    reach = np.where(here[:, 3] > 0, here[:, 3], step)
    if closed:
        before, behind = at - np.minimum(reach, length / 4), at + np.minimum(reach, length / 4)
    else:
        before, behind = np.maximum(at - reach, 0), np.minimum(at + reach, length)
    chord = sample(behind) - sample(before)
    size = np.linalg.norm(chord[:, :3], axis=1, keepdims=True)
    axis = np.divide(chord[:, :3], size, out=np.full((count, 3), np.nan), where=size > 0)
    slope = chord[:, 3] / (behind - before)
    found = np.column_stack([here[:, :3], axis, here[:, 3], slope, here[:, 4]])
    return found[size[:, 0] > 0]


def directions_around(axis, up, n):
    """Directions perpendicular to each axis, n of each in turn; the first points down as far as it can."""
    side = np.eye(3)[np.argmin(np.abs(up))]
    down = -(up - axis * (axis @ up)[:, None])
    other = side - axis * (axis @ side)[:, None]
    size = np.linalg.norm(down, axis=1, keepdims=True)
    first = np.where(size > 1e-6, down, other)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    turn = 2 * np.pi * np.arange(n)[:, None] / n
    around = np.cos(turn) * first[:, None] + np.sin(turn) * np.cross(axis, first)[:, None]
    return around.reshape(-1, 3)
