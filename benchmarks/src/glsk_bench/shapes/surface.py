"""The boundary of a union of round cones: points uniform by area, and their normals."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from glsk_o3d.geometry.vectors import dot, norm, unit
from glsk_o3d.samples.capsules import capsule_distance

INSIDE = 2e-5  # fitted: how deep a point is that does not show: where cones hardly bend, none of their balls is drawn
STRAIGHT = np.radians(1.5)  # fitted: what turns by less does not show a ball between its cones
EVEN_SLOPE = np.radians(1)  # fitted: nor does what narrows by so little more, or widens by so little less
STEEP = 1e-6  # derived: a cone whose radii differ by less, in the first one, is drawn as a cylinder: roundings


class Surface(NamedTuple):
    """Points of a surface."""

    points: np.ndarray  # (n, 3), uniform by area
    normals: np.ndarray  # (n, 3), outward, of length 1
    area: float  # of the surface, as the share of points that are not inside tells it


class Pieces(NamedTuple):
    """Cones, and the balls that may show between them."""

    start: np.ndarray
    span: np.ndarray
    length: np.ndarray
    radius: np.ndarray  # of the cones at their start
    end_radius: np.ndarray
    sine: np.ndarray  # of the angle by which a cone's normals lean towards its end
    cosine: np.ndarray
    centres: np.ndarray  # of the balls
    ball_radii: np.ndarray
    areas: np.ndarray  # of the cones, then of the balls


def surface(nodes: np.ndarray, edges: np.ndarray, radii: np.ndarray, n: int, rng: np.random.Generator) -> Surface:
    """Draw points on the boundary of a union of round cones."""
    pieces = _pieces(nodes, edges, radii)
    chance = pieces.areas / pieces.areas.sum()
    points, normals, have, tried = [], [], 0, 0
    while have < n:
        more = int(1.1 * (n - have) * tried / max(have, 1)) + 500 if tried else int(1.2 * n)
        drawn, outward = _drawn(pieces, chance, more, rng)
        shown = ~buried(nodes, edges, radii, drawn)
        points.append(drawn[shown])
        normals.append(outward[shown])
        have, tried = have + int(shown.sum()), tried + more
    return Surface(np.vstack(points)[:n], np.vstack(normals)[:n], float(pieces.areas.sum() * have / tried))


def _pieces(nodes, edges, radii):
    """All that points are drawn on."""
    a, b = edges.T
    span = nodes[b] - nodes[a]
    length = norm(span)
    sine = np.clip((radii[a] - radii[b]) / length, -1, 1)
    cosine = np.sqrt(1 - sine**2)
    shown = np.flatnonzero(_ball_shows(nodes, edges, radii))
    areas = np.concatenate([np.pi * (radii[a] + radii[b]) * cosine**2 * length, 4 * np.pi * radii[shown] ** 2])
    return Pieces(nodes[a], span, length, radii[a], radii[b], sine, cosine, nodes[shown], radii[shown], areas)


def _ball_shows(nodes, edges, radii):
    """At which nodes more than cones may show: ends, forks, bends, and where cones narrow more than before."""
    shows = np.bincount(edges.ravel(), minlength=len(nodes)) != 2
    here, there = np.concatenate([edges, edges[:, ::-1]]).T
    there = there[np.argsort(here, kind="stable")][~shows[np.sort(here)]]  # both neighbours of nodes that have two
    middle = np.flatnonzero(~shows)
    x, y = (nodes[beside] - nodes[middle] for beside in (there[::2], there[1::2]))
    long_x, long_y = norm(x), norm(y)
    bent = dot(x, y) > -np.cos(STRAIGHT) * long_x * long_y
    slope = sum(
        np.arcsin(np.clip((radii[beside] - radii[middle]) / length, -1, 1))
        for beside, length in ((there[::2], long_x), (there[1::2], long_y))
    )
    shows[middle] = bent | (slope < -EVEN_SLOPE)
    return shows


def _drawn(pieces, chance, n, rng):
    """Points and normals on cones and balls, whether or not they are inside others."""
    pick = rng.choice(len(chance), n, p=chance)
    normals = unit(rng.normal(size=(n, 3)))
    points = np.empty((n, 3))
    n_cones = len(pieces.length)
    on_ball, on_cone = np.flatnonzero(pick >= n_cones), np.flatnonzero(pick < n_cones)
    ball, cone = pick[on_ball] - n_cones, pick[on_cone]
    points[on_ball] = pieces.centres[ball] + pieces.ball_radii[ball, None] * normals[on_ball]
    along = pieces.span[cone] / pieces.length[cone, None]
    radial = unit(normals[on_cone] - dot(normals[on_cone], along)[:, None] * along)
    radius, end_radius = pieces.radius[cone], pieces.end_radius[cone]
    t = _wider_more_often(rng.random(len(cone)), end_radius / radius - 1)
    normals[on_cone] = pieces.cosine[cone, None] * radial + pieces.sine[cone, None] * along
    at_axis = pieces.start[cone] + pieces.span[cone] * t[:, None]
    points[on_cone] = at_axis + (radius + (end_radius - radius) * t)[:, None] * normals[on_cone]
    return points, normals


def _wider_more_often(uniform, widening):
    """Shares of the way along cones, of uniform numbers: their density grows like the radius, 1 + widening * t."""
    steep = np.abs(widening) > STEEP
    root = np.sqrt(1 + uniform * (2 * widening + widening * widening))
    return np.where(steep, (root - 1) / np.where(steep, widening, 1), uniform)


def buried(nodes: np.ndarray, edges: np.ndarray, radii: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Which points, (n, 3) float array, are more than `INSIDE` deep in the union of round cones: (n,) bool array."""
    inside, tree = np.zeros(len(points), bool), cKDTree(points)
    a, b = nodes[edges[:, 0]], nodes[edges[:, 1]]
    reach = norm(b - a) / 2 + radii[edges].max(axis=1)
    for (i, j), near in zip(edges, tree.query_ball_point((a + b) / 2, reach), strict=True):
        near = np.array(near, int)
        near = near[~inside[near]]
        inside[near] = capsule_distance(points[near], nodes[i], nodes[j], radii[i], radii[j]) < -INSIDE
    return inside
