"""How far points are from the surface of a solid, and points on it."""

from __future__ import annotations

from itertools import product

import numpy as np

from glsk_o3d.geometry.vectors import dot, norm, unit

from ..surface import Surface
from .solid import Solid

FAR = 1e3  # derived: a distance beyond all others
BLEND_REACH = 4  # fitted: how much farther blended parts are looked for, in the width of the blend
MOST_EXPONENT = 60  # derived: keeps exponentials finite
NEAR_FACE = 0.01  # fitted: how far out from a sweep points are asked whether they are inside
SAME_PLANE = 1e-6  # derived: of two faces in one plane, one counts: more than roundings
LEAST_COSINE = 1e-6  # derived: of a gradient and a normal that tell which side is out: more than roundings
# Of the shell around a blended surface, in the least half axis: its half thickness and the cells that it is found in.
SHELL, SHELL_CELL, LEAST_SHELL_CELL = 0.3, 0.7, 0.006  # fitted
STEEPEST = 1.05  # fitted: length of gradients of a blend, at most
ON_SURFACE = 0.03  # fitted: how far from the surface points may stay, in the least half axis
NEWTON_STEPS, LEAST_SLOPE = 3, 0.05  # fitted: towards the surface
FIRST_BLOCK = 8  # speed: cells along the side of the blocks that a grid is first filled by
BLOCK_REACH = 1.8  # derived: a block's corners are sqrt(3) / 2 of its side from its middle, rounded up twice


def distance(solid: Solid, points: np.ndarray, margin: float, opened: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Distances of points, (n, 3) float array, below 0 inside, to first order, and their gradients; farther out than
    `margin` just `FAR`.

    The voids' last faces are `opened` so much farther out.
    """
    values, gradients, smoothing = np.full(len(points), FAR), np.zeros_like(points), solid.smoothing
    if smoothing:
        total = np.zeros(len(points))
        for sweep in solid.sweeps:
            near = sweep.distance(points, margin + BLEND_REACH * smoothing, edge=solid.edge)
            weight = np.exp(-np.clip(near.values / smoothing, -MOST_EXPONENT, MOST_EXPONENT))
            total[near.rows] += weight
            gradients[near.rows] += weight[:, None] * near.gradients
        some = total > 0
        values[some] = -smoothing * np.log(total[some])
        gradients[some] = gradients[some] / total[some, None]
    else:
        for sweep in solid.sweeps:
            near = sweep.distance(points, margin)
            nearer = near.values < values[near.rows]
            values[near.rows[nearer]], gradients[near.rows[nearer]] = near.values[nearer], near.gradients[nearer]
    for void in solid.voids:
        near = void.distance(points, margin, opened)
        taken = -near.values > values[near.rows]
        values[near.rows[taken]], gradients[near.rows[taken]] = -near.values[taken], -near.gradients[taken]
    return values, gradients


def surface_of(solid: Solid, n: int, rng: np.random.Generator) -> Surface:
    """Draw points on the surface of a solid."""
    return _on_blend(solid, n, rng) if solid.smoothing else _on_faces(solid, n, rng)


def _on_faces(solid, n, rng):
    """Points on the meshes of all sweeps, less those inside others; and those on meshes of voids that are in sweeps."""
    parts, solids = [*solid.sweeps, *solid.voids], len(solid.sweeps)
    meshes = [part.mesh() for part in parts]
    owner = np.repeat(np.arange(len(parts)), [len(mesh) for mesh in meshes])
    corners = np.concatenate(meshes)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = (norm(normals) / 2).cumsum()
    points, triangles, have, tried = [], [], 0, 0
    while have < n:
        more = int(1.15 * (n - have) * tried / max(have, 1)) + 500 if tried else int(1.5 * n)
        triangle = np.searchsorted(area, rng.random(more) * area[-1])
        root, share = np.sqrt(rng.random(more)), rng.random(more)
        weights = np.stack([1 - root, root * (1 - share), root * share], axis=1)
        drawn = (corners[triangle] * weights[:, :, None]).sum(axis=1)
        shown = np.flatnonzero(_shows(parts, solids, drawn, owner[triangle]))
        points.append(drawn[shown])
        triangles.append(triangle[shown])
        have, tried = have + len(shown), tried + more
    found, triangle = np.concatenate(points)[:n], np.concatenate(triangles)[:n]
    outward = unit(normals[triangle])
    away = outward.copy()
    for k, part in enumerate(parts):
        mine = np.flatnonzero(owner[triangle] == k)
        near = part.distance(found[mine], NEAR_FACE)
        away[mine[near.rows]] = near.gradients
    # on an edge the gradient may stand on the normal: there its sign would be the rounding's, another on each processor
    sign = np.where(dot(outward, away) < -LEAST_COSINE, -1, 1) * np.where(owner[triangle] < solids, 1, -1)
    return Surface(found, outward * sign[:, None], float(area[-1] * have / tried))


def _shows(parts, solids, points, owner):
    """Whether points of the parts' surfaces are on that of the whole."""
    inside, cut = np.zeros(len(points), bool), np.zeros(len(points), bool)
    for k, part in enumerate(parts):
        near = part.distance(points, NEAR_FACE)
        of = owner[near.rows]
        within = (of != k) & (near.values < np.where(of < k, -SAME_PLANE, SAME_PLANE))
        (inside if k < solids else cut)[near.rows] |= within
    return np.where(owner < solids, ~inside, inside) & ~cut


def _on_blend(solid, n, rng):
    """Points drawn uniformly in a shell around the surface and moved onto it.

    They are uniform by area, as the distance is one to first order; where its gradient is not of length 1, which makes
    the shell thicker or thinner, as many fewer are kept.
    """
    thin = solid.thinnest
    cell, half = max(SHELL_CELL * thin, LEAST_SHELL_CELL), SHELL * thin
    values, low = grid(solid, cell, half + cell)
    cubes = low + cell * np.argwhere(np.abs(values) < half + cell)
    points, normals, have, tried = [], [], 0, 0
    while have < n:
        more = int(1.1 * (n - have) * tried / max(have, 1)) + 500 if tried else int(3 * n)
        drawn = cubes[rng.integers(len(cubes), size=more)] + rng.uniform(-cell / 2, cell / 2, (more, 3))
        off, gradient = distance(solid, drawn, 2 * half)
        kept = (np.abs(off) < half) & (rng.random(more) * STEEPEST < norm(gradient))
        drawn, off, gradient = drawn[kept], off[kept], gradient[kept]
        for _ in range(NEWTON_STEPS):
            drawn = drawn - (off / np.maximum(dot(gradient, gradient), LEAST_SLOPE))[:, None] * gradient
            off, gradient = distance(solid, drawn, 2 * half)
        good = np.abs(off) < ON_SURFACE * thin
        points.append(drawn[good])
        normals.append(unit(gradient[good]))
        have, tried = have + int(good.sum()), tried + more
    area = STEEPEST * have / tried * len(cubes) * cell**3 / (2 * half)
    return Surface(np.vstack(points)[:n], np.vstack(normals)[:n], float(area))


def grid(solid: Solid, cell: float, margin: float, opened: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Distances at the middles of the cells of a grid around a solid, and the first cell's middle.

    They are right within `margin` of the surface; farther away only their signs are. The grid is filled by blocks, each
    half as wide as before, of those that may be near the surface.
    """
    lowest = np.min([sweep.track.places.min(axis=0) - sweep.reach for sweep in solid.sweeps], axis=0)
    highest = np.max([sweep.track.places.max(axis=0) + sweep.reach for sweep in solid.sweeps], axis=0)
    low = lowest - margin - 2.3 * cell
    blocks = np.ceil((highest + margin + 2 * cell - low) / (FIRST_BLOCK * cell)).astype(int)
    size, todo, values = FIRST_BLOCK, np.argwhere(np.ones(blocks, bool)), np.full(blocks, FAR)
    children = np.array(list(product((0, 1), repeat=3)))
    while True:
        reach = BLOCK_REACH * size * cell * (size > 1) + margin
        found = distance(solid, low + cell * (size * (todo + 0.5) - 0.5), reach, opened)[0]
        values[tuple(todo.T)] = found
        if size == 1:
            return values, low
        values = values.repeat(2, axis=0).repeat(2, axis=1).repeat(2, axis=2)
        todo = (2 * todo[np.abs(found) < reach][:, None] + children).reshape(-1, 3)
        size //= 2
