"""Clouds of every degenerate kind, of any size: each is a way in which clouds could take longer than others."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from itertools import combinations, product

import numpy as np
from scipy.spatial import cKDTree

import glsk_o3d as glsk
from glsk_o3d import GlskError, samples

SIZES = (2000, 5000, 12000, 25000, 50000)
LIMIT_S = 900  # of one cloud, by the clock
MOST_RATIO = 5.0  # of the CPU time of a cloud to the median of its size
Draw = Callable[[int, np.random.Generator], np.ndarray]


def _box(*sides: int) -> np.ndarray:
    """All whole numbers in a box."""
    return np.stack(np.meshgrid(*map(np.arange, sides), indexing="ij"), -1).reshape(-1, len(sides)).astype(float)


def _block(n: int, rng: np.random.Generator) -> np.ndarray:
    """Whole numbers in a cube."""
    return _box(*[max(round(n ** (1 / 3)), 2)] * 3)


def _solid(n: int, inside: Callable[[np.ndarray], np.ndarray], every: int = 1) -> np.ndarray:
    """About n whole numbers inside of something in a cube from -1 to 1, of every so many a slice."""
    share = inside(2 * np.random.default_rng(0).random((100_000, 3)) - 1).mean()
    side = round((every * n / share) ** (1 / 3))
    slices = []
    for z in range(0, side, every):
        places = np.column_stack([_box(side, side), np.full(side * side, float(z))])
        slices.append(places[inside(2 * places / (side - 1) - 1)])
    return np.concatenate(slices)


def _of_tubes(x: np.ndarray) -> np.ndarray:
    """Inside of a body with a neck and two legs."""
    ends = np.array([[[-0.6, 0, 0], [0.5, 0, 0]], [[0.5, 0, 0], [0.8, 0, 0.8]], [[-0.5, 0, 0], [-0.5, 0.3, -0.8]]])
    ends = np.concatenate([ends, [[[0.4, 0, 0], [0.4, -0.3, -0.8]]]])
    radii, inside = (0.25, 0.15, 0.12, 0.12), np.zeros(len(x), bool)
    for (a, b), radius in zip(ends, radii, strict=True):
        t = np.clip((x - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
        inside |= np.linalg.norm(x - a - t[:, None] * (b - a), axis=1) < radius
    return inside


def _voxel_solid(n: int, rng: np.random.Generator) -> np.ndarray:
    return _solid(n, _of_tubes)


def _voxel_ball(n: int, rng: np.random.Generator) -> np.ndarray:
    return _solid(n, lambda x: np.linalg.norm(x, axis=1) < 1)


def _voxel_rod(n: int, rng: np.random.Generator) -> np.ndarray:
    """A solid square rod, sixteen times as long as wide."""
    side = max(round((n / 16) ** (1 / 3)), 2)
    return _box(side, side, 16 * side)


def _shell(solid: np.ndarray, axes: tuple[int, ...] = (0, 1, 2)) -> np.ndarray:
    """Those of some whole numbers that lack a neighbour along one of the axes."""
    side = int(solid.max()) + 3
    full = np.zeros((side,) * 3, bool)
    at = tuple(solid.astype(int).T + 1)
    full[at] = True
    hidden = np.ones(len(solid), bool)
    for axis, step in product(axes, (-1, 1)):
        hidden &= np.roll(full, step, axis)[at]
    return solid[~hidden]


def _voxel_shell(n: int, rng: np.random.Generator) -> np.ndarray:
    return _shell(_solid(round((n / 6.5) ** 1.5), _of_tubes))


def _box_shell(n: int, rng: np.random.Generator) -> np.ndarray:
    side = max(round(np.sqrt(n / 18)), 2)
    return _shell(_box(side, side, 4 * side))


def _ct_slices(n: int, rng: np.random.Generator) -> np.ndarray:
    """The contours of a body in slices five times as far apart as the points in them."""
    slices = _solid(round((n / 1.15) ** 1.5 / 5), _of_tubes, every=5)
    return _shell(slices, axes=(0, 1))


def _ct_contours(n: int, rng: np.random.Generator) -> np.ndarray:
    """Exact circles above each other, ten times as far apart as the points in them."""
    around = max(round(np.sqrt(4 * n)), 8)
    angle, row = _box(around, max(n // around, 1)).T
    turn = 2 * np.pi * angle / around
    return np.column_stack([np.cos(turn), np.sin(turn), row * 20 * np.pi / around])


def _depth_plane(n: int, rng: np.random.Generator) -> np.ndarray:
    """The pixels of an organised depth image of a plane."""
    side = round(np.sqrt(n))
    pixels = _box(side, side) / side - 0.5
    return np.column_stack([pixels, np.ones(len(pixels))]) * 2.0


def _depth_tilted(n: int, rng: np.random.Generator) -> np.ndarray:
    """Of a tilted one, the depth in whole millimetres."""
    side = round(np.sqrt(n))
    pixels = _box(side, side) / side - 0.5
    depth = np.round(1000 / (1 + 0.4 * pixels[:, 0]))
    return np.column_stack([pixels, np.ones(len(pixels))]) * depth[:, None]


def _depth_scene(n: int, rng: np.random.Generator) -> np.ndarray:
    """Of a ball before a wall, the depth in whole millimetres."""
    side = round(np.sqrt(n))
    pixels = _box(side, side) / side - 0.5
    away = np.hypot(*pixels.T)
    depth = np.round(1000 - 300 * np.sqrt(np.maximum(0.09 - away**2, 0)) - 150 * (away < 0.3))
    return np.column_stack([pixels, np.ones(len(pixels))]) * depth[:, None]


def _height_map(n: int, rng: np.random.Generator) -> np.ndarray:
    """Terraces: whole heights over whole places."""
    side = round(np.sqrt(n))
    x, y = _box(side, side).T
    return np.column_stack([x, y, np.floor(side / 10 * np.sin(6 * x / side) * np.cos(5 * y / side))])


def _mesh_torus(n: int, rng: np.random.Generator) -> np.ndarray:
    """Vertices of a structured mesh."""
    rows = max(round(np.sqrt(n / 4)), 3)
    u, v = 2 * np.pi * _box(4 * rows, rows).T / [[4 * rows], [rows]]
    return np.column_stack([(4 + np.cos(v)) * np.cos(u), (4 + np.cos(v)) * np.sin(u), np.sin(v)])


def _mesh_tube(n: int, rng: np.random.Generator) -> np.ndarray:
    around = max(round(np.sqrt(n / 5)), 3)
    turn, row = _box(around, 5 * around).T
    angle = 2 * np.pi * turn / around
    return np.column_stack([np.cos(angle), np.sin(angle), row * 2 * np.pi / around])


def _mesh_sphere(n: int, rng: np.random.Generator) -> np.ndarray:
    """Meridians and parallels: ever denser towards the poles, which are many copies."""
    rows = max(round(np.sqrt(n / 2)), 3)
    u, v = (_box(2 * rows, rows) * [np.pi / rows, np.pi / (rows - 1)]).T
    return np.column_stack([np.sin(v) * np.cos(u), np.sin(v) * np.sin(u), np.cos(v)])


def _mesh_long(n: int, rng: np.random.Generator) -> np.ndarray:
    """Rows of vertices along a tube, forty times as far apart around as along it."""
    angle, along = _box(12, max(n // 12, 2)).T
    return np.column_stack([np.cos(np.pi * angle / 6), np.sin(np.pi * angle / 6), along * np.pi / 240])


def _cells(n: int, basis: np.ndarray, more: np.ndarray) -> np.ndarray:
    """A lattice with several points in each cell, about n in all."""
    side = max(round((n / len(more)) ** (1 / len(basis))), 2)
    return ((_box(*[side] * len(basis))[:, None] + more).reshape(-1, len(basis))) @ basis


def _hexagonal(n: int, rng: np.random.Generator) -> np.ndarray:
    return _cells(n, np.array([[1, 0, 0], [0.5, np.sqrt(0.75), 0]]), np.zeros((1, 2)))


def _honeycomb(n: int, rng: np.random.Generator) -> np.ndarray:
    return _cells(n, np.array([[1, 0, 0], [0.5, np.sqrt(0.75), 0]]), np.array([[0, 0], [1 / 3, 1 / 3]]))


def _body_centred(n: int, rng: np.random.Generator) -> np.ndarray:
    return _cells(n, np.eye(3), np.array([[0, 0, 0], [0.5, 0.5, 0.5]]))


def _face_centred(n: int, rng: np.random.Generator) -> np.ndarray:
    return _cells(n, np.eye(3), np.array([[0, 0, 0], [0.5, 0.5, 0], [0.5, 0, 0.5], [0, 0.5, 0.5]]))


def _diamond(n: int, rng: np.random.Generator) -> np.ndarray:
    faces = np.array([[0, 0, 0], [0.5, 0.5, 0], [0.5, 0, 0.5], [0, 0.5, 0.5]])
    return _cells(n, np.eye(3), np.concatenate([faces, faces + 0.25]))


def _sheared(n: int, rng: np.random.Generator) -> np.ndarray:
    return _cells(n, np.array([[1, 0, 0], [0.3, 1, 0], [0.2, 0.4, 1.0]]), np.zeros((1, 3)))


def _holey_block(n: int, rng: np.random.Generator) -> np.ndarray:
    """A cube of whole numbers of which half are missing."""
    places = _block(2 * n, rng)
    return places[rng.random(len(places)) < 0.5]


def _stretched(n: int, rng: np.random.Generator) -> np.ndarray:
    """A block of voxels six times as high as wide."""
    return _block(n, rng) * [1, 1, 6]


def _line(n: int, rng: np.random.Generator) -> np.ndarray:
    return rng.random((n, 1)) * [1.0, 2.0, 3.0]


def _even_line(n: int, rng: np.random.Generator) -> np.ndarray:
    return np.arange(n)[:, None] * [1.0, 0.0, 0.0]


def _plane(n: int, rng: np.random.Generator) -> np.ndarray:
    return rng.random((n, 3)) * [1, 1, 0]


def _squeezed(n: int, rng: np.random.Generator) -> np.ndarray:
    return samples.sauropod(n, seed=3).points * [1, 1, 1e-4]


def _planes(n: int, rng: np.random.Generator) -> np.ndarray:
    """Ten parallel ones."""
    return rng.random((n, 3)) * [1, 1, 0] + rng.integers(0, 10, (n, 1)) * [0, 0, 0.1]


def _crossed_planes(n: int, rng: np.random.Generator) -> np.ndarray:
    points = 2 * rng.random((n, 3)) - 1
    points[np.arange(n), rng.integers(0, 3, n)] = 0
    return points


def _parallel_lines(n: int, rng: np.random.Generator) -> np.ndarray:
    m = max(round(n ** (1 / 3)), 2)
    return _box(m, m)[rng.integers(0, m * m, n)] @ np.eye(2, 3) / m + rng.random((n, 1)) * [0, 0, 1]


def _star(n: int, rng: np.random.Generator) -> np.ndarray:
    """Lines from one place in all directions."""
    ways = rng.normal(size=(40, 3))
    return ways[rng.integers(0, 40, n)] * rng.random((n, 1))


def _collinear_clusters(n: int, rng: np.random.Generator) -> np.ndarray:
    """Clusters along a line, each of points on a line of its own."""
    which = rng.integers(0, 50, n)
    return which[:, None] * [1.0, 0, 0] + rng.normal(size=(50, 3))[which] * 0.1 * rng.random((n, 1))


def _clusters(n: int, rng: np.random.Generator) -> np.ndarray:
    """Of ten points each, far apart."""
    return rng.random((n // 10 + 1, 3))[rng.integers(0, n // 10 + 1, n)] + 1e-4 * rng.normal(size=(n, 3))


def _tiny_clusters(n: int, rng: np.random.Generator) -> np.ndarray:
    """Hundreds, some roundings wide."""
    return rng.normal(size=(n // 100, 3))[rng.integers(0, n // 100, n)] + 1e-14 * rng.normal(size=(n, 3))


def _two_scales(n: int, rng: np.random.Generator) -> np.ndarray:
    """A thing, and a thousandth of its size, beside it, another."""
    half = n // 2
    return np.concatenate([samples.sauropod(n - half).points, 1e-3 * samples.torus(half).points + [1, 1, 0]])


def _dense_spot(n: int, rng: np.random.Generator) -> np.ndarray:
    """Half of the points on a hundredth of the surface."""
    points = samples.sauropod(4 * n, seed=1).points
    order = np.argsort(np.linalg.norm(points - points[0], axis=1))
    return np.concatenate([points[order[: n // 2]], points[rng.choice(order[n // 2 :], n - n // 2, replace=False)]])


def _gradient(n: int, rng: np.random.Generator) -> np.ndarray:
    """Ever sparser along a tube, a thousandfold."""
    along = 10 ** (3 * rng.random(n))
    turn = 2 * np.pi * rng.random(n)
    return np.column_stack([30 * np.cos(turn), 30 * np.sin(turn), along])


def _cone(n: int, rng: np.random.Generator) -> np.ndarray:
    """Points evenly along, and so ever denser towards the tip."""
    along, turn = rng.random(n), 2 * np.pi * rng.random(n)
    return np.column_stack([0.3 * along * np.cos(turn), 0.3 * along * np.sin(turn), along])


def _dust(n: int, rng: np.random.Generator) -> np.ndarray:
    return rng.random((n, 3))


def _heap(n: int, rng: np.random.Generator) -> np.ndarray:
    return rng.normal(size=(n, 3))


def _ball(n: int, rng: np.random.Generator) -> np.ndarray:
    points = rng.normal(size=(n, 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True) * rng.random((n, 1)) ** (1 / 3)


def _sphere(n: int, rng: np.random.Generator) -> np.ndarray:
    return samples.sphere(n).points


def _shells(n: int, rng: np.random.Generator) -> np.ndarray:
    """Eight spheres in each other."""
    return samples.sphere(n).points * rng.integers(1, 9, (n, 1))


def _duplicates(n: int, rng: np.random.Generator) -> np.ndarray:
    points = samples.sauropod(n // 10).points
    return points[rng.integers(0, len(points), n)]


def _mostly_duplicates(n: int, rng: np.random.Generator) -> np.ndarray:
    points = samples.torus(n // 5).points
    return np.concatenate([points, np.repeat(points[:1], n - len(points), axis=0)])


def _near_duplicates(n: int, rng: np.random.Generator) -> np.ndarray:
    """Every point ten times, a millionth of the cloud apart."""
    return np.repeat(samples.sauropod(n // 10).points, 10, axis=0) + 1e-6 * rng.normal(size=(n // 10 * 10, 3))


def _rounded(n: int, rng: np.random.Generator) -> np.ndarray:
    points = samples.sauropod(n).points
    return np.round(points * 0.4 * np.sqrt(n) / np.ptp(points))


def _rounded_noise(n: int, rng: np.random.Generator) -> np.ndarray:
    points = samples.torus(n, noise=0.03).points
    return np.round(points * 0.5 * np.sqrt(n) / np.ptp(points))


def _offset(n: int, rng: np.random.Generator) -> np.ndarray:
    """Far from the origin in single precision: rounded to a grid."""
    return (samples.sauropod(n).points + 30000).astype(np.float32).astype(float)


def _noise(n: int, rng: np.random.Generator) -> np.ndarray:
    """As much of it as the thing is thick."""
    return samples.sauropod(n, noise=0.08).points


def _noisy_tree(n: int, rng: np.random.Generator) -> np.ndarray:
    return samples.tree(n, noise=0.02).points


def _thick_noise(n: int, rng: np.random.Generator) -> np.ndarray:
    """A curve with points all around it, as many at any distance: a bottle brush."""
    t = rng.random((n, 1))
    return np.column_stack([np.cos(4 * t), np.sin(4 * t), t]) + 0.15 * rng.normal(size=(n, 3))


def _spiral(n: int, rng: np.random.Generator) -> np.ndarray:
    t = np.linspace(0, 1, n)[:, None]
    return np.column_stack([t * np.cos(200 * t), t * np.sin(200 * t), 0 * t])


def _sphere_spiral(n: int, rng: np.random.Generator) -> np.ndarray:
    """Even points on a sphere, a golden angle after each other."""
    z, turn = (2 * np.arange(n) + 1) / n - 1, np.pi * (3 - np.sqrt(5)) * np.arange(n)
    across = np.sqrt(1 - z * z)
    return np.column_stack([across * np.cos(turn), across * np.sin(turn), z])


def _scroll(n: int, rng: np.random.Generator) -> np.ndarray:
    """A sheet rolled up, five times around."""
    t = np.sqrt(rng.random(n))
    return np.column_stack([t * np.cos(30 * t), t * np.sin(30 * t), rng.random(n)])


def _circle(n: int, rng: np.random.Generator) -> np.ndarray:
    turn = 2 * np.pi * np.arange(n) / n
    return np.column_stack([np.cos(turn), np.sin(turn), 0 * turn])


def _rings(n: int, rng: np.random.Generator) -> np.ndarray:
    """Exact circles around each other in a plane, as of a spinning scanner."""
    each = max(round(np.sqrt(n)), 3)
    turn, row = _box(each, each).T
    return np.column_stack(
        [(1 + row) * np.cos(2 * np.pi * turn / each), (1 + row) * np.sin(2 * np.pi * turn / each)] + [0 * row]
    )


def _wire(n: int, rng: np.random.Generator) -> np.ndarray:
    """A random walk without a surface."""
    return np.cumsum(rng.normal(size=(n, 3)), axis=0)


def _coil(n: int, rng: np.random.Generator) -> np.ndarray:
    return samples.helix(n).points * [1, 1, 4]


def _hairs(n: int, rng: np.random.Generator) -> np.ndarray:
    """Hundreds of thin curves."""
    m = max(n // 50, 4)
    start, way = rng.normal(size=(2, m, 3))
    which, t = rng.integers(0, m, n), rng.random((n, 1))
    return start[which] + t * way[which] + 0.3 * t**2 * way[(which + 1) % m]


def _tubes(n: int, rng: np.random.Generator) -> np.ndarray:
    """Many of them, beside each other."""
    m = max(n // 400, 4)
    side = int(np.ceil(np.sqrt(m)))
    which, turn, along = rng.integers(0, m, n), 2 * np.pi * rng.random(n), 6 * rng.random(n)
    return np.column_stack([which % side * 4 + np.cos(turn), which // side * 4 + np.sin(turn), along])


def _balls(n: int, rng: np.random.Generator) -> np.ndarray:
    """Many spheres, each of some points."""
    m = max(n // 200, 2)
    return samples.sphere(n).points + 5 * rng.random((m, 3))[rng.integers(0, m, n)] * m ** (1 / 3)


def _along_edges(n: int, rng: np.random.Generator, nodes: np.ndarray, edges: np.ndarray, radius: float) -> np.ndarray:
    """Points on the tubes around the edges of a graph, but not those inside of another one."""
    a, b = nodes[edges[:, 0]], nodes[edges[:, 1]]
    length = np.linalg.norm(b - a, axis=1)
    draws = 3 * n
    which, turn = rng.choice(len(edges), draws, p=length / length.sum()), 2 * np.pi * rng.random((draws, 1))
    way = (b - a) / length[:, None]
    side = np.cross(way, np.where(np.abs(way[:, :1]) < 0.6, [1.0, 0, 0], [0, 1.0, 0]))
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    axis = a[which] + rng.random((draws, 1)) * (b - a)[which]
    points = axis + radius * (np.cos(turn) * side[which] + np.sin(turn) * np.cross(way, side)[which])
    steps = np.linspace(0, 1, max(int(4 * length.max() / radius), 2))[:, None, None]
    inside = cKDTree((a + steps * (b - a)).reshape(-1, 3)).query(points)[0] < 0.95 * radius
    return points[~inside][:n]


def _lattice_of(side: int) -> Draw:
    """Tubes along the edges of a cubic lattice."""

    def draw(n: int, rng: np.random.Generator) -> np.ndarray:
        nodes = _box(side, side, side)
        return _along_edges(n, rng, nodes, np.array(sorted(cKDTree(nodes).query_pairs(1.01))), 0.15)

    return draw


def _truss(n: int, rng: np.random.Generator) -> np.ndarray:
    """A girder with diagonals."""
    nodes = _box(2, 2, max(n // 500, 4))
    pairs = [(i, j) for i, j in combinations(range(len(nodes)), 2) if np.linalg.norm(nodes[i] - nodes[j]) < 1.45]
    return _along_edges(n, rng, nodes, np.array(pairs), 0.08)


def _net(n: int, rng: np.random.Generator) -> np.ndarray:
    """A flat net of wires."""
    side = max(round(np.sqrt(n / 120)), 3)
    nodes = np.column_stack([_box(side, side), np.zeros(side * side)])
    return _along_edges(n, rng, nodes, np.array(sorted(cKDTree(nodes).query_pairs(1.01))), 0.12)


def _stent(n: int, rng: np.random.Generator) -> np.ndarray:
    """A net of wires around a cylinder."""
    around = max(round(np.sqrt(n / 500)), 3) * 2
    turn, row = _box(around, 2 * around).T
    angle = 2 * np.pi * (turn + row % 2 / 2) / around
    nodes = np.column_stack([np.cos(angle), np.sin(angle), row * np.pi / around])
    reach = 1.15 * np.linalg.norm(nodes[0] - nodes[1])
    pairs = [(i, j) for i, j in sorted(cKDTree(nodes).query_pairs(reach)) if row[i] != row[j]]
    return _along_edges(n, rng, nodes, np.array(pairs), 0.1 * np.pi / around)


def _sponge(n: int, rng: np.random.Generator) -> np.ndarray:
    """Near the surface of a gyroid, four periods to a side."""
    x = 8 * np.pi * rng.random((40 * n, 3))
    value = (np.sin(x) * np.cos(np.roll(x, -1, axis=1))).sum(axis=1)
    return x[np.argsort(np.abs(value - 0.5))[:n]]


def _foam(n: int, rng: np.random.Generator) -> np.ndarray:
    """Tubes between each of some random places and its nearest ones."""
    m = max(n // 250, 8)
    nodes = m ** (1 / 3) * rng.random((m, 3))
    near = cKDTree(nodes).query(nodes, 4)[1]
    edges = np.unique(np.sort(np.column_stack([np.repeat(near[:, 0], 3), near[:, 1:].ravel()]), axis=1), axis=0)
    return _along_edges(n, rng, nodes, edges, 0.06)


def _fractal(n: int, rng: np.random.Generator) -> np.ndarray:
    """Sierpinski's tetrahedron, by chance."""
    corners, x = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]), rng.random((n, 3))
    for _ in range(25):
        x = (x + corners[rng.integers(0, 4, n)]) / 2
    return x


def _outliers(n: int, rng: np.random.Generator) -> np.ndarray:
    """A fifth of the points anywhere."""
    points = samples.sauropod(n).points
    points[::5] = points.min(axis=0) + np.ptp(points, axis=0) * rng.random((len(points[::5]), 3))
    return points


def _far_outliers(n: int, rng: np.random.Generator) -> np.ndarray:
    return np.concatenate([samples.sauropod(n - 20).points, 1e4 * rng.normal(size=(20, 3))])


def _grid_outliers(n: int, rng: np.random.Generator) -> np.ndarray:
    """A shell of voxels and, near it, points that are on no grid."""
    shell = _box_shell(n, rng)
    return np.concatenate([shell, shell.max(axis=0) * rng.random((len(shell) // 20, 3))])


def _walls(n: int, rng: np.random.Generator) -> np.ndarray:
    """The rooms of a house: planes that meet at right angles."""
    points = 4 * rng.random((n, 3))
    axis = rng.integers(0, 3, n)
    points[np.arange(n), axis] = np.round(points[np.arange(n), axis])
    return points


def _plain(shape: str, noise: float = 0.0) -> Draw:
    return lambda n, rng: getattr(samples, shape)(n, noise=noise).points


KINDS: dict[str, Draw] = {
    **{
        shape.replace("_", " "): _plain(shape)
        for shape in ("torus", "sauropod", "tree", "sheet", "helix", "y_junction")
    },
    "noisy torus": _plain("torus", 0.02),
    "lattice of 4": _lattice_of(4),
    "lattice of 8": _lattice_of(8),
    **{
        draw.__name__.strip("_").replace("_", " "): draw
        for draw in (
            *(_block, _voxel_solid, _voxel_ball, _voxel_rod, _voxel_shell, _box_shell, _ct_slices, _ct_contours),
            *(
                _depth_plane,
                _depth_tilted,
                _depth_scene,
                _height_map,
                _mesh_torus,
                _mesh_tube,
                _mesh_sphere,
                _mesh_long,
            ),
            *(_hexagonal, _honeycomb, _body_centred, _face_centred, _diamond, _sheared, _holey_block, _stretched),
            *(_line, _even_line, _plane, _squeezed, _planes, _crossed_planes, _parallel_lines, _star),
            *(_collinear_clusters, _clusters, _tiny_clusters, _two_scales, _dense_spot, _gradient, _cone),
            *(_dust, _heap, _ball, _sphere, _shells, _duplicates, _mostly_duplicates, _near_duplicates),
            *(_rounded, _rounded_noise, _offset, _noise, _noisy_tree, _thick_noise, _spiral, _sphere_spiral, _scroll),
            *(_circle, _rings, _wire, _coil, _hairs, _tubes, _balls, _truss, _net, _stent, _sponge, _foam, _fractal),
            *(_outliers, _far_outliers, _grid_outliers, _walls),
        )
    },
}
"""What draws about n points of a kind."""


def time_case(seed: int, number: int) -> tuple[str, str, float]:
    """Size and kind of a cloud, whether there is a ``"skeleton"`` or it was ``"refused"``, and CPU seconds."""
    size, kind = SIZES[number // len(KINDS)], [*KINDS][number % len(KINDS)]
    points = KINDS[kind](size, np.random.default_rng([seed, number]))
    start = time.process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            glsk.skeletonize(points)
            told = "skeleton"
        except GlskError:
            told = "refused"
    return f"{size} {kind}", told, time.process_time() - start
