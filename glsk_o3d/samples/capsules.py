"""What all samples share, and unions of tapered capsules, the convex hulls of two balls, of which most are."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InvalidParameterError
from ..geometry.vectors import Floats


@dataclass(frozen=True, eq=False, repr=False)
class Sample:
    """A cloud and its axis.

    Attributes
    ----------
    points : (n, 3) float64 array
    nodes : (M, 3) float64 array
        Nodes of the true axis; none for a shape that has no axis.
    edges : (E, 2) int64 array
    radii : (M,) float64 array
        Distance from each node to the surface of its own part.
    name : str

    Examples
    --------
    >>> from glsk_o3d.samples import torus
    >>> torus(1000).points.shape
    (1000, 3)
    """

    points: np.ndarray
    nodes: np.ndarray
    edges: np.ndarray
    radii: np.ndarray
    name: str

    def __repr__(self) -> str:
        counts = f"{len(self.points)} points, {len(self.nodes)} nodes, {len(self.edges)} edges"
        return f"Sample({self.name!r}, {counts})"


class Axis:
    """The axis of a sample: nodes, edges and radii, to which chains of nodes are added one by one."""

    def __init__(self) -> None:
        self.nodes, self.edges, self.radii = list[Any](), list[tuple[int, int]](), list[float]()

    def grow(self, nodes: Any, radii: Any, start: int | None = None, end: int | None = None) -> int:
        """Add a chain of nodes between two known ones, or free at either end; returns its last node."""
        for node, radius in zip(nodes, np.broadcast_to(radii, len(nodes)), strict=True):
            new = len(self.nodes)
            if start is not None:
                self.edges.append((start, new))
            self.nodes.append(node)
            self.radii.append(radius)
            start = new
        if end is not None:
            self.edges.append((new, end))
        return new

    def arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Nodes, (M, 3) float64 array, edges, (E, 2) int64 array, and radii, (M,) float64 array."""
        nodes, edges = np.array(self.nodes, float).reshape(-1, 3), np.array(self.edges, np.int64).reshape(-1, 2)
        return nodes, edges, np.array(self.radii, float)


def checked_generator(n: Any, noise: float, seed: Any, **positive: float) -> np.random.Generator:
    """The random numbers of a sample; InvalidParameterError for a wrong n, noise, or length or angle by its name."""
    if isinstance(n, bool) or not isinstance(n, int | np.integer) or n < 1:
        raise InvalidParameterError(f"n = {n!r}: must be an int of at least 1")
    if not (np.isfinite(noise) and noise >= 0):
        raise InvalidParameterError(f"noise = {noise!r}: must be finite and not negative")
    for name, value in positive.items():
        if not (np.isfinite(value) and value > 0):
            raise InvalidParameterError(f"{name} = {value!r}: must be finite and above 0")
    return np.random.default_rng(seed)


def collect(draw: Callable[[int], np.ndarray], n: int) -> np.ndarray:
    """Exactly n rows from a function that draws at most as many as it is asked for."""
    rows, total, batch = list[np.ndarray](), 0, max(n, 256)
    while total < n:
        rows.append(draw(batch))
        total += len(rows[-1])
        batch = max(256, int(1.1 * batch * (n - total) / max(len(rows[-1]), 1)))
    return np.concatenate(rows)[:n]


def noisy(points: Floats, noise: float, rng: np.random.Generator) -> np.ndarray:
    """The points with Gaussian noise, which is a share of the diagonal of their box."""
    if noise == 0:
        return points
    return points + rng.normal(scale=noise * np.linalg.norm(np.ptp(points, axis=0)), size=points.shape)


def directions(n: int, rng: np.random.Generator) -> np.ndarray:
    """Random unit vectors, (n, 3)."""
    v: Floats = rng.normal(size=(n, 3))
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def signed_distance(points: np.ndarray, nodes: np.ndarray, edges: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Signed distance to a union of tapered capsules: exact outside and on the surface, a bound inside.

    Parameters
    ----------
    points : (n, 3) array
    nodes, radii : (M, 3) and (M,) array
    edges : (E, 2) int array
        A node without an edge is a ball.

    Returns
    -------
    (n,) float64 array
        Negative inside.
    """
    points = np.asarray(points, float)
    best = np.full(len(points), np.inf)
    for node in np.setdiff1d(np.arange(len(nodes)), edges):
        best = np.minimum(best, np.linalg.norm(points - nodes[node], axis=1) - radii[node])
    for i, j in edges:
        best = np.minimum(best, capsule_distance(points, nodes[i], nodes[j], radii[i], radii[j]))
    return best


def capsule_distance(points: np.ndarray, a: np.ndarray, b: np.ndarray, radius_a: float, radius_b: float) -> np.ndarray:
    """Signed distance of points, (n, 3) array, to the convex hull of two balls around `a` and `b`, (3,) arrays."""
    span, length = b - a, np.linalg.norm(b - a)
    slope = (radius_a - radius_b) / length
    if abs(slope) >= 1:  # one ball holds the other
        big, radius = (a, radius_a) if slope > 0 else (b, radius_b)
        return np.linalg.norm(points - big, axis=1) - radius
    offset = points - a
    along = offset @ span / length
    across = np.sqrt(np.maximum((offset**2).sum(axis=1) - along**2, 0))
    # the sphere that touches the surface nearest to the point has its centre `foot` along the axis
    foot = np.clip(along - across * slope / np.sqrt(1 - slope**2), 0, length)
    return np.hypot(along - foot, across) - (radius_a - slope * foot)


def union_sample(
    name: str, nodes: Floats, edges: np.ndarray, radii: Floats, n: int, noise: float, seed: int, cameras: Any = None
) -> Sample:
    """n points, uniform by area, on the outer surface of the union, as far as one of the cameras sees it."""
    rng = checked_generator(n, noise, seed)
    (a, b), (ra, rb) = nodes[edges].swapaxes(0, 1), radii[edges].T
    length = np.linalg.norm(b - a, axis=1)
    slope = (ra - rb) / length
    if (np.abs(slope) >= 1).any():
        raise InvalidParameterError(f"{name}: a part is wider than it is long, so one end contains the other")
    if cameras is not None:
        cameras = np.asarray(cameras, float).reshape(-1, 3)
        if len(cameras) == 0 or not (signed_distance(cameras, nodes, edges, radii) > 0).all():
            raise InvalidParameterError(f"{name}: there must be a camera, and none inside the object")
    axis = (b - a) / length[:, None]
    lean = np.sqrt(1 - slope**2)  # the cone touches its end balls where the normal has `slope` along the axis
    areas = np.concatenate([4 * np.pi * radii**2, np.pi * lean**2 * (ra + rb) * length])

    def draw(m: int) -> np.ndarray:
        piece = rng.choice(len(areas), m, p=areas / areas.sum())
        points, on_ball = np.empty((m, 3)), piece < len(nodes)
        ball, cone = piece[on_ball], piece[~on_ball] - len(nodes)
        points[on_ball] = nodes[ball] + radii[ball, None] * directions(len(ball), rng)
        big, small = np.maximum(ra, rb)[cone], np.minimum(ra, rb)[cone]
        u = rng.random(len(cone))
        radius = np.sqrt(big**2 + u * (small**2 - big**2))  # by area: density proportional to the radius
        flat = np.abs(big - small) < 1e-12 * big
        share = np.where(flat, u, (ra[cone] - radius) / np.where(flat, 1, (ra - rb)[cone]))
        aside = rng.normal(size=(len(cone), 3))
        aside -= axis[cone] * (aside * axis[cone]).sum(axis=1, keepdims=True)
        aside /= np.linalg.norm(aside, axis=1, keepdims=True)
        outward = aside * lean[cone, None] + axis[cone] * slope[cone, None]
        points[~on_ball] = a[cone] + (b - a)[cone] * share[:, None] + radius[:, None] * outward
        points = points[signed_distance(points, nodes, edges, radii) > -1e-9]
        if cameras is None:
            return points
        return points[np.any([visible(points, camera, nodes, edges, radii) for camera in cameras], axis=0)]

    return Sample(noisy(collect(draw, n), noise, rng), nodes, edges, radii, name)


def visible(points: Floats, camera: Floats, nodes: Floats, edges: np.ndarray, radii: Floats) -> np.ndarray:
    """Which points on the surface the camera, which is outside, sees: its ray meets nothing before them.

    Each tapered capsule is two balls and a cone between them; a ray meets all three in closed form.
    """
    ray = points - camera
    reach: Floats = np.linalg.norm(ray, axis=1)
    ray /= reach[:, None]
    to_node = camera - nodes
    first = np.full(len(points), np.inf)
    for offset, radius in zip(to_node, radii, strict=True):
        near = ray @ offset
        root = near**2 - offset @ offset + radius**2
        first = np.where(root >= 0, np.minimum(first, -near - np.sqrt(np.maximum(root, 0))), first)
    for i, j in edges:
        # |o + t d - foot| = radius(foot), foot as in signed_distance: a quadratic k2 t^2 + 2 k1 t + k0 = 0
        span, drop = nodes[j] - nodes[i], radii[i] - radii[j]
        size = span @ span
        along_o, along_d, near = to_node[i] @ span, ray @ span, ray @ to_node[i]
        k2 = size - drop**2 - along_d**2
        k1 = (size - drop**2) * near - along_o * along_d + along_d * drop * radii[i]
        k0 = (size - drop**2) * (to_node[i] @ to_node[i]) - along_o**2 + 2 * along_o * drop * radii[i]
        k0 -= size * radii[i] ** 2
        root = np.sqrt(np.maximum(k1**2 - k0 * k2, 0))
        safe = np.where(np.abs(k2) < 1e-12, 1, k2)
        for t in ((-k1 - root) / safe, (-k1 + root) / safe):
            y = along_o + t * along_d - drop * radii[i]
            hit = (k1**2 >= k0 * k2) & (safe == k2) & (y > 0) & (y < size - drop**2) & (t > 0)
            first = np.where(hit, np.minimum(first, t), first)
    return first > reach - 1e-6
