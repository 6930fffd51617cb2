"""Where limbs meet: their lines, and the surface around, weighted by how well they say it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..numerics.polylines import arc_lengths, place_at, relative_distance
from ..numerics.vectors import TINY, dot

# All fitted, but for the steps.
AXIS_LEAVES = 1.3  # distance from the other limbs, over that from them to the surface, where half a limb is undisturbed
AXIS_LENGTH = 2.5  # radii from there over which its line is taken
LINE_NOISE = 0.05  # radii that a line is off at its middle, on a straight limb
LINE_STEP = 0.1  # derived: radii from one place on a limb to the next that is asked
LINE_STEPS = 400  # derived: places at most
SURFACE_WEIGHT = 12.0  # of the surface that fits a sphere, over that of a line that says exactly where it is
SURFACE_FIT = 0.25  # distance from the sphere, over the radius, at which a point counts half
MEETING_HOLD = 0.02  # weight of where the junction was: a straight tube says nothing of where along it
MEETING_ROUNDS = 10  # measured: from then on hardly anything moves


class Line(NamedTuple):
    """What a limb says of where it comes from."""

    middle: np.ndarray  # (3,) of the part that nothing disturbs
    way: np.ndarray  # (3,) unit vector towards the junction, or zero
    spread: float  # standard deviation along the line of that part
    bend: float  # root mean square distance from the line
    start: float  # length along the limb that is disturbed
    anchor: np.ndarray  # (3,) where that ends
    radius: float  # of the limb


def limb_line(
    vertices: np.ndarray, surface: np.ndarray, path: np.ndarray, radius: float, others: Sequence[np.ndarray]
) -> Line:
    """The straight line through the part of a limb that is undisturbed by others, and nearest to its junction.

    Nothing is decided: every place counts by how far it has left the others, from 0 at their surface on, and less and
    less from `AXIS_LENGTH` radii on. The half towards the limb's other end counts as undisturbed, whatever is there.

    Parameters
    ----------
    vertices : (M, 3) float array
    surface : (M,) float array
        Distance from each vertex to the surface.
    path : (p,) int array
        The limb's vertices, from its junction.
    radius : float
    others : sequence of (p,) int array
        The limbs that meet it.
    """
    places = vertices[path]
    along = arc_lengths(places)
    step = max(LINE_STEP * radius, along[-1] / LINE_STEPS, TINY)
    n = max(int(np.ceil(along[-1] / step)), 8)
    step, half = along[-1] / n, n // 2
    at = (np.arange(n) + 0.5) * step
    curve = place_at(places, along, at)
    clear = np.ones(n)
    if others:
        left, _ = relative_distance(curve, vertices, surface, others)
        clear = np.clip((left - 1) / (2 * (AXIS_LEAVES - 1)), 0, 1)
        clear[:half] = np.minimum.accumulate(clear[:half][::-1])[::-1]  # what left and came back had not left
    start = float((1 - clear[:half]).sum() * step)
    anchor = place_at(places, along, start)
    weight = clear * np.clip(1.5 - np.cumsum(clear) * step / max(AXIS_LENGTH * radius, TINY), 0, 1)
    total = weight.sum()
    if total * step <= 0:
        return Line(anchor, np.zeros(3), 0.0, 0.0, start, anchor, radius)
    weight /= total
    middle, mean = weight @ curve, weight @ at
    way = (weight * (mean - at)) @ (curve - middle)
    way /= max(np.linalg.norm(way), TINY)
    off = curve - middle - (mean - at)[:, None] * way
    spread, bend = np.sqrt(weight @ (at - mean) ** 2), np.sqrt(weight @ dot(off, off))
    return Line(middle, way, float(spread), float(bend), start, anchor, radius)


def meet(
    lines: Sequence[Line], near: np.ndarray, radius: float, points: np.ndarray, normals: np.ndarray
) -> tuple[np.ndarray, float]:
    r"""The place that some lines and the surface around agree on, in the sense of least squares.

    .. math:: \sum_i w_i |(x - m_i)_{\perp i}|^2 + W \sum_p u_p (|n_p \cdot (p - x)| - r)^2 / \sum_p g_p
        + \epsilon |x - x_0|^2

    over x and r. A line counts by how far it may be off at x, as far ahead of the middle of its part as D: the bend b
    of the part, and a twentieth of the limb's radius, grow with the square of that over the part's spread s, so that
    :math:`w = 1 / (1 + ((b / r_i + 0.05) (1 + D^2 / s^2))^2)`, and by how far aside of x it passes. The rest says what
    is the middle of the surface there, the centre of a sphere that touches as many tangent planes as possible, where
    limbs are too short to say anything: :math:`g_p` falls like a Gaussian with the distance of a point, and
    :math:`u_p` with how far its plane is from the sphere, too, so that a surface without such a sphere has no say.

    Parameters
    ----------
    lines : sequence of Line
    near : (3,) float array
        Where the junction is.
    radius : float
        Of the thickest limb there.
    points, normals : (n, 3) float array
        Of the surface of the limbs.

    Returns
    -------
    (3,) float array
    float
        Radius of the sphere; `radius` if there are no points.
    """
    place, touching, radius = near, radius, max(radius, TINY)
    for _ in range(MEETING_ROUNDS):
        matrix, right = np.diag([MEETING_HOLD] * 3 + [1e-6]), np.zeros(4)
        right[:3] = MEETING_HOLD * (near - place)
        right[3] = 1e-6 * touching
        for line in lines:
            if line.spread <= 0 or line.radius <= 0:
                continue
            offset = line.middle - place
            aside = offset - (offset @ line.way) * line.way
            error = (line.bend / line.radius + LINE_NOISE) * (1 + (offset @ line.way / line.spread) ** 2)
            weight = 1 / ((1 + error**2) * (1 + aside @ aside / radius**2))
            matrix[:3, :3] += weight * (np.eye(3) - np.outer(line.way, line.way))
            right[:3] += weight * aside
        if len(points):
            offset = points - place
            window = np.exp(-dot(offset, offset) / (2 * radius**2))
            height = dot(offset, normals)
            fits = window / (1 + ((np.abs(height) - touching) / (SURFACE_FIT * radius)) ** 2)
            fits *= SURFACE_WEIGHT / max(window.sum(), TINY)
            plane = np.column_stack([np.where(height < 0, -1, 1)[:, None] * normals, np.ones(len(points))])
            matrix += (fits[:, None] * plane).T @ plane
            right += plane.T @ (fits * np.abs(height))
        *step, touching = np.linalg.solve(matrix, right)
        touching = float(np.clip(touching, 0, 2 * radius))
        place = place + step
    return place, touching
