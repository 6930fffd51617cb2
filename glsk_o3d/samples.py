"""Sample clouds with exactly known axes, made from formulas: to try things on, to test with, to draw.

Most shapes are unions of tapered capsules (the convex hull of two balls), so a shape *is* its axis: nodes, edges, and a
radius at every node. All clouds are uniform by area, reproducible through `seed`, and about one unit in size.

Examples
--------
>>> from glsk_o3d.samples import sample_object
>>> toy = sample_object(n=2000)
>>> toy
Sample('sauropod', 2000 points, 54 nodes, 54 edges)
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .errors import InvalidParameterError


@dataclass(frozen=True, eq=False, repr=False)
class Sample:
    """A cloud and the axis it was made from.

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
    >>> ring = torus(1000)
    >>> ring.points.shape, float(ring.radii.max())
    ((1000, 3), 0.1)
    """

    points: np.ndarray
    nodes: np.ndarray
    edges: np.ndarray
    radii: np.ndarray
    name: str

    def __repr__(self):
        counts = f"{len(self.points)} points, {len(self.nodes)} nodes, {len(self.edges)} edges"
        return f"Sample({self.name!r}, {counts})"


# --------------------------------------------------------------------------------------------------------------- shapes

TWO_CAMERAS = ((1.1, 1.8, 1.4), (-1.2, -1.7, 1.3))
"""Where the sauropod is scanned from: front left and rear right, a little above it."""


def sample_object(n: int = 8192, noise: float = 0.002, seed: int = 0, name: str = "sauropod") -> Sample:
    """The object of ``glsk demo``, or any other sample by its name.

    Parameters
    ----------
    n : int
        Number of points.
    noise : float
        Standard deviation of the Gaussian noise on every coordinate, as a share of the bounding-box diagonal.
    seed : int
    name : str
        One of `SAMPLES`.

    Returns
    -------
    Sample

    Examples
    --------
    >>> sample_object(500)
    Sample('sauropod', 500 points, 54 nodes, 54 edges)
    """
    if name not in SAMPLES:
        raise InvalidParameterError(f"no sample is called {name!r}; there are {', '.join(SAMPLES)}")
    return SAMPLES[name](n=n, noise=noise, seed=seed)


def sauropod(
    n: int = 8192,
    *,
    noise: float = 0.0,
    seed: int = 0,
    cameras: tuple[tuple[float, float, float], ...] | None = TWO_CAMERAS,
) -> Sample:
    """A toy dinosaur with a carrying handle on its back: one loop, six ends, nothing thinner than 0.05.

    Parameters
    ----------
    n : int
        Number of points.
    noise : float
        Standard deviation of the Gaussian noise, as a share of the bounding-box diagonal.
    seed : int
    cameras : tuple of points, optional
        Only points that one of these sees are kept, as in a scan: the belly and parts of the legs and of the flanks
        behind them are missing. None keeps the whole surface.

    Returns
    -------
    Sample

    Examples
    --------
    >>> sauropod(500)
    Sample('sauropod', 500 points, 54 nodes, 54 edges)
    """
    nodes, edges, radii = _sauropod_axis()
    return _union_sample("sauropod", nodes, edges, radii, n, noise, seed, cameras)


def tube(
    n: int = 4096, *, length: float = 1.0, radius: float = 0.1, capped: bool = True, noise: float = 0.0, seed: int = 0
) -> Sample:
    """A straight tube along x, centred on the origin.

    Parameters
    ----------
    n : int
        Number of points.
    length : float
        Length of the axis; half balls at the ends come on top.
    radius : float
    capped : bool
        Whether the ends are closed by half balls.
    noise : float
        Standard deviation of the Gaussian noise, as a share of the bounding-box diagonal.
    seed : int

    Returns
    -------
    Sample

    Examples
    --------
    >>> tube(500)
    Sample('tube', 500 points, 2 nodes, 1 edges)
    """
    _check(n, noise, length=length, radius=radius)
    nodes, edges, radii = _chain(np.array([[-length / 2, 0, 0], [length / 2, 0, 0]]), radius)
    if capped:
        return _union_sample("tube", nodes, edges, radii, n, noise, seed)
    rng = np.random.default_rng(seed)
    angle = rng.uniform(0, 2 * np.pi, n)
    points = np.stack([rng.uniform(-length / 2, length / 2, n), radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    return Sample(_noisy(points, noise, rng), nodes, edges, radii, "tube")


def torus(n: int = 4096, *, ring_radius: float = 0.4, radius: float = 0.1, noise: float = 0.0, seed: int = 0) -> Sample:
    """A torus around z.

    Parameters
    ----------
    n : int
        Number of points.
    ring_radius : float
        Radius of the axis, a circle.
    radius : float
        Radius of the tube, smaller than `ring_radius`.
    noise : float
        Standard deviation of the Gaussian noise, as a share of the bounding-box diagonal.
    seed : int

    Returns
    -------
    Sample

    Examples
    --------
    >>> torus(500)
    Sample('torus', 500 points, 128 nodes, 128 edges)
    """
    _check(n, noise, ring_radius=ring_radius, radius=radius)
    if radius >= ring_radius:
        raise InvalidParameterError(f"radius = {radius}: must be below ring_radius = {ring_radius}")
    rng = np.random.default_rng(seed)
    points = _torus_points(n, ring_radius, radius, rng)
    nodes, edges, radii = _circle(ring_radius, radius)
    return Sample(_noisy(points, noise, rng), nodes, edges, radii, "torus")


def helix(
    n: int = 4096,
    *,
    coil_radius: float = 0.3,
    radius: float = 0.06,
    pitch: float = 0.35,
    turns: float = 2.0,
    noise: float = 0.0,
    seed: int = 0,
) -> Sample:
    """A coil spring around z, its ends closed by half balls.

    Parameters
    ----------
    n : int
        Number of points.
    coil_radius : float
        Radius of the axis, a helix.
    radius : float
        Radius of the wire; the turns must not touch and the wire must not fold.
    pitch : float
        Rise per turn.
    turns : float
    noise : float
        Standard deviation of the Gaussian noise, as a share of the bounding-box diagonal.
    seed : int

    Returns
    -------
    Sample

    Examples
    --------
    >>> helix(500)
    Sample('helix', 500 points, 193 nodes, 192 edges)
    """
    _check(n, noise, coil_radius=coil_radius, radius=radius, pitch=pitch, turns=turns)
    climb = pitch / (2 * np.pi)
    speed = np.hypot(coil_radius, climb)
    curvature = coil_radius / speed**2
    if radius * curvature >= 1 or 2 * radius * speed >= pitch * coil_radius:
        raise InvalidParameterError(f"radius = {radius}: the turns of the helix touch, or its wire folds")
    rng = np.random.default_rng(seed)
    end = 2 * np.pi * turns
    wire, cap = speed * end * 2 * np.pi * radius, 2 * np.pi * radius**2

    def frame(t):
        centre = np.stack([coil_radius * np.cos(t), coil_radius * np.sin(t), climb * (t - end / 2)], axis=-1)
        inward = np.stack([-np.cos(t), -np.sin(t), np.zeros_like(t)], axis=-1)
        tangent = np.stack([-coil_radius * np.sin(t), coil_radius * np.cos(t), np.full_like(t, climb)], axis=-1) / speed
        return centre, inward, tangent, np.cross(tangent, inward)

    def draw(m):
        which = rng.choice(3, m, p=np.array([wire, cap, cap]) / (wire + 2 * cap))
        t, angle = rng.uniform(0, end, m), rng.uniform(0, 2 * np.pi, m)
        centre, inward, _, across = frame(t)
        points = centre + radius * (np.cos(angle)[:, None] * inward + np.sin(angle)[:, None] * across)
        for piece, (at, sign) in enumerate(((0.0, -1), (end, 1)), start=1):
            rows = np.flatnonzero(which == piece)
            centre, _, tangent, _ = frame(np.array(at))
            out = _directions(len(rows), rng)
            out *= np.where(sign * (out @ tangent) < 0, -1, 1)[:, None]
            points[rows] = centre + radius * out
        density = np.where(which == 0, 1 - radius * curvature * np.cos(angle), 1)  # area element of a bent tube
        return points[rng.uniform(0, 1 + radius * curvature, m) < density]

    points = _collect(draw, n)
    nodes, edges, radii = _chain(frame(np.linspace(0, end, max(2, int(96 * turns) + 1)))[0], radius)
    return Sample(_noisy(points, noise, rng), nodes, edges, radii, "helix")


def y_junction(
    n: int = 4096,
    *,
    length: float = 0.5,
    radii: tuple[float, float, float] = (0.09, 0.07, 0.07),
    angle: float = 80.0,
    noise: float = 0.0,
    seed: int = 0,
) -> Sample:
    """Three straight tubes that meet in the origin: a stem downwards and two arms.

    Parameters
    ----------
    n : int
        Number of points.
    length : float
        Length of each axis.
    radii : tuple of three floats
        At the ends of the stem and of the two arms; all have the stem's radius in the middle.
    angle : float
        Between the arms, in degrees.
    noise : float
        Standard deviation of the Gaussian noise, as a share of the bounding-box diagonal.
    seed : int

    Returns
    -------
    Sample

    Examples
    --------
    >>> y_junction(500)
    Sample('y_junction', 500 points, 4 nodes, 3 edges)
    """
    half = np.deg2rad(angle) / 2
    _check(n, noise, length=length, angle=angle, stem=radii[0], left=radii[1], right=radii[2])
    ends = length * np.array([[0, 0, -1], [-np.sin(half), 0, np.cos(half)], [np.sin(half), 0, np.cos(half)]])
    nodes = np.concatenate([np.zeros((1, 3)), ends])
    edges = np.array([[0, 1], [0, 2], [0, 3]])
    return _union_sample("y_junction", nodes, edges, np.array([radii[0], *radii], float), n, noise, seed)


def two_rings(
    n: int = 4096, *, ring_radius: float = 0.3, radius: float = 0.06, noise: float = 0.0, seed: int = 0
) -> Sample:
    """Two links of a chain, which do not touch: two components, two loops.

    Parameters
    ----------
    n : int
        Number of points.
    ring_radius : float
        Radius of each axis; the second circle goes through the middle of the first.
    radius : float
        Radius of the tubes, below half of `ring_radius`.
    noise : float
        Standard deviation of the Gaussian noise, as a share of the bounding-box diagonal.
    seed : int

    Returns
    -------
    Sample

    Examples
    --------
    >>> two_rings(500)
    Sample('two_rings', 500 points, 256 nodes, 256 edges)
    """
    _check(n, noise, ring_radius=ring_radius, radius=radius)
    if 2 * radius >= ring_radius:
        raise InvalidParameterError(f"radius = {radius}: must be below half of ring_radius = {ring_radius}")
    rng = np.random.default_rng(seed)
    points = _torus_points(n, ring_radius, radius, rng)
    nodes, edges, radii = _circle(ring_radius, radius)

    def second(x):  # turned about x, and moved by one ring radius
        return np.stack([x[:, 0] + ring_radius, -x[:, 2], x[:, 1]], axis=1)

    points = np.where(rng.random(n)[:, None] < 0.5, points, second(points))
    nodes, edges = np.concatenate([nodes, second(nodes)]), np.concatenate([edges, edges + len(nodes)])
    return Sample(_noisy(points, noise, rng), nodes, edges, np.concatenate([radii, radii]), "two_rings")


def sphere(n: int = 4096, *, radius: float = 0.5, noise: float = 0.0, seed: int = 0) -> Sample:
    """A sphere about the origin. Its axis is one node; a curve skeleton of it means nothing.

    Parameters
    ----------
    n : int
        Number of points.
    radius : float
    noise : float
        Standard deviation of the Gaussian noise, as a share of the bounding-box diagonal.
    seed : int

    Returns
    -------
    Sample

    Examples
    --------
    >>> sphere(500)
    Sample('sphere', 500 points, 1 nodes, 0 edges)
    """
    _check(n, noise, radius=radius)
    rng = np.random.default_rng(seed)
    points = radius * _directions(n, rng)
    nodes, edges, radii = np.zeros((1, 3)), np.zeros((0, 2), np.int64), np.array([float(radius)])
    return Sample(_noisy(points, noise, rng), nodes, edges, radii, "sphere")


def sheet(
    n: int = 4096, *, length: float = 1.0, width: float = 0.7, bend: float = 60.0, noise: float = 0.0, seed: int = 0
) -> Sample:
    """A sheet of paper, rolled along x. It has no axis; a curve skeleton of it means nothing.

    Parameters
    ----------
    n : int
        Number of points.
    length, width : float
    bend : float
        Angle between the two ends in degrees, below 360; 0 leaves the sheet flat.
    noise : float
        Standard deviation of the Gaussian noise, as a share of the bounding-box diagonal.
    seed : int

    Returns
    -------
    Sample

    Examples
    --------
    >>> sheet(500)
    Sample('sheet', 500 points, 0 nodes, 0 edges)
    """
    _check(n, noise, length=length, width=width)
    if not 0 <= bend < 360:
        raise InvalidParameterError(f"bend = {bend}: must be at least 0 and below 360 degrees")
    rng = np.random.default_rng(seed)
    along, across = rng.uniform(-length / 2, length / 2, n), rng.uniform(-width / 2, width / 2, n)
    if bend == 0:
        points = np.stack([along, across, np.zeros(n)], axis=1)
    else:
        curvature = np.deg2rad(bend) / length
        turn = curvature * along
        points = np.stack([np.sin(turn) / curvature, across, (np.cos(turn) - 1) / curvature], axis=1)
    return Sample(_noisy(points, noise, rng), np.zeros((0, 3)), np.zeros((0, 2), np.int64), np.zeros(0), "sheet")


SAMPLES: dict[str, Callable[..., Sample]] = {
    shape.__name__: shape for shape in (sauropod, tube, torus, helix, y_junction, two_rings, sphere, sheet)
}
"""Every sample by its name; each takes at least ``n``, ``noise`` and ``seed``."""


def _sauropod_axis() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """x forward, y to its left, z up; the feet stand on z = 0."""
    nodes: list[np.ndarray] = []
    radii: list[float] = []
    edges: list[tuple[int, int]] = []

    def grow(start: int | None, places, sizes, end: int | None = None) -> int:
        """A chain of new nodes from `start`, closed onto `end`; returns its last node."""
        last = start
        for place, size in zip(places, sizes, strict=True):
            nodes.append(np.asarray(place, float))
            radii.append(float(size))
            if last is not None:
                edges.append((last, len(nodes) - 1))
            last = len(nodes) - 1
        assert last is not None
        if end is not None:
            edges.append((last, end))
        return last

    hip = grow(None, [(-0.20, 0, 0.345)], [0.105])
    rear = grow(hip, [(-0.11, 0, 0.362)], [0.122])
    front = grow(rear, [(0, 0, 0.37), (0.11, 0, 0.368)], [0.128, 0.122])
    chest = grow(front, [(0.20, 0, 0.36)], [0.1])
    neck = _curve([(0.20, 0, 0.36), (0.33, 0, 0.43), (0.395, 0, 0.57), (0.42, 0, 0.72), (0.47, 0, 0.80)], 8)
    head = grow(chest, neck, np.linspace(0.08, 0.042, len(neck)))
    grow(head, [(0.525, 0, 0.803), (0.615, 0, 0.765)], [0.056, 0.04])
    tail = _curve(
        [
            (-0.20, 0, 0.345),
            (-0.36, 0, 0.29),
            (-0.50, 0.04, 0.195),
            (-0.64, 0.11, 0.17),
            (-0.75, 0.10, 0.25),
            (-0.80, 0, 0.35),
        ],
        14,
    )
    grow(hip, tail, np.linspace(0.084, 0.028, len(tail)))
    for root, x, sway in ((chest, 0.20, 0.025), (hip, -0.21, -0.025)):
        for side in (1, -1):
            leg = [(x, 0.105 * side, 0.25), (x + sway, 0.125 * side, 0.14), (x + sway * 0.4, 0.13 * side, 0.046)]
            grow(root, leg, [0.062, 0.05, 0.046])
    arch = np.linspace(np.pi, 0, 15)[1:-1]
    handle = np.stack([0.14 * np.cos(arch), 0 * arch, 0.46 + 0.27 * np.sin(arch) ** 0.8], axis=1)
    grow(rear, handle, np.full(len(handle), 0.03), end=front)
    return np.array(nodes), np.array(edges, np.int64), np.array(radii)


def _curve(through, pieces: int) -> np.ndarray:
    """A Catmull-Rom spline as `pieces` points, without its first."""
    p = np.asarray(through, float)
    p = np.concatenate([2 * p[:1] - p[1:2], p, 2 * p[-1:] - p[-2:-1]])
    t = np.linspace(0, len(p) - 3, pieces + 1)[1:]
    i = np.minimum(t.astype(int), len(p) - 4)
    u = (t - i)[:, None]
    a, b, c, d = p[i], p[i + 1], p[i + 2], p[i + 3]
    return 0.5 * (2 * b + (c - a) * u + (2 * a - 5 * b + 4 * c - d) * u**2 + (3 * b - a - 3 * c + d) * u**3)


# ------------------------------------------------------------------------------------------- unions of tapered capsules


def signed_distance(points: np.ndarray, nodes: np.ndarray, edges: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Signed distance to a union of tapered capsules: exact outside and on the surface, a bound inside.

    Parameters
    ----------
    points : (n, 3) array
    nodes : (M, 3) array
    edges : (E, 2) int array
        A node without an edge is a ball.
    radii : (M,) array

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
        a, span, length = nodes[i], nodes[j] - nodes[i], np.linalg.norm(nodes[j] - nodes[i])
        slope = (radii[i] - radii[j]) / length
        if abs(slope) >= 1:  # one ball holds the other
            big = i if slope > 0 else j
            best = np.minimum(best, np.linalg.norm(points - nodes[big], axis=1) - radii[big])
            continue
        offset = points - a
        along = offset @ span / length
        across = np.sqrt(np.maximum((offset**2).sum(axis=1) - along**2, 0))
        # the sphere that touches the surface nearest to the point has its centre `foot` along the axis
        foot = np.clip(along - across * slope / np.sqrt(1 - slope**2), 0, length)
        distance = np.hypot(along - foot, across) - (radii[i] - slope * foot)
        best = np.minimum(best, distance)
    return best


def _union_sample(name, nodes, edges, radii, n, noise, seed, cameras=None) -> Sample:
    """n points, uniform by area, on the outer surface of the union, as far as one of the cameras sees it."""
    _check(n, noise)
    rng = np.random.default_rng(seed)
    a, b = nodes[edges[:, 0]], nodes[edges[:, 1]]
    ra, rb = radii[edges[:, 0]], radii[edges[:, 1]]
    length = np.linalg.norm(b - a, axis=1)
    slope = (ra - rb) / length
    if (np.abs(slope) >= 1).any():
        raise InvalidParameterError(f"{name}: a part is wider than it is long, so that one end swallows the other")
    if cameras is not None:
        cameras = np.asarray(cameras, float).reshape(-1, 3)
        if len(cameras) == 0 or not (signed_distance(cameras, nodes, edges, radii) > 0).all():
            raise InvalidParameterError(f"{name}: there must be a camera, and none inside the object")
    axis = (b - a) / length[:, None]
    lean = np.sqrt(1 - slope**2)  # the cone touches its end balls where the normal has `slope` along the axis
    areas = np.concatenate([4 * np.pi * radii**2, np.pi * lean**2 * (ra + rb) * length])

    def draw(m):
        piece = rng.choice(len(areas), m, p=areas / areas.sum())
        points = np.empty((m, 3))
        on_ball = piece < len(nodes)
        ball = piece[on_ball]
        points[on_ball] = nodes[ball] + radii[ball, None] * _directions(len(ball), rng)
        cone = piece[~on_ball] - len(nodes)
        big, small = np.maximum(ra, rb)[cone], np.minimum(ra, rb)[cone]
        u = rng.random(len(cone))
        radius = np.sqrt(big**2 + u * (small**2 - big**2))  # by area: density proportional to the radius
        flat = np.abs(big - small) < 1e-12 * big
        share = np.where(flat, u, (ra[cone] - radius) / np.where(flat, 1, (ra - rb)[cone]))
        out = _perpendicular(axis[cone], rng) * lean[cone, None] + axis[cone] * slope[cone, None]
        points[~on_ball] = a[cone] + (b - a)[cone] * share[:, None] + radius[:, None] * out
        points = points[signed_distance(points, nodes, edges, radii) > -1e-9]
        if cameras is not None:
            seen = [_visible(points, camera, nodes, edges, radii) for camera in cameras]
            points = points[np.any(seen, axis=0)]
        return points

    return Sample(_noisy(_collect(draw, n), noise, rng), nodes, edges, radii, name)


def _visible(points, camera, nodes, edges, radii) -> np.ndarray:
    """Which points on the surface the camera, which is outside, sees: its ray meets nothing before them.

    Each tapered capsule is two balls and a cone between them; a ray meets all three in closed form.
    """
    ray = points - camera
    reach = np.linalg.norm(ray, axis=1)
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


# -------------------------------------------------------------------------------------------------------------- helpers


def _check(n, noise, **positive) -> None:
    if isinstance(n, bool) or not isinstance(n, int | np.integer) or n < 1:
        raise InvalidParameterError(f"n = {n!r}: must be an int of at least 1")
    if not (np.isfinite(noise) and noise >= 0):
        raise InvalidParameterError(f"noise = {noise!r}: must be finite and not negative")
    for name, value in positive.items():
        if not (np.isfinite(value) and value > 0):
            raise InvalidParameterError(f"{name} = {value!r}: must be finite and above 0")


def _collect(draw, n: int) -> np.ndarray:
    """Exactly n rows from a function that draws at most as many as it is asked for."""
    found, total, batch = [], 0, max(n, 256)
    while total < n:
        found.append(draw(batch))
        total += len(found[-1])
        batch = max(256, int(1.1 * batch * (n - total) / max(len(found[-1]), 1)))
    return np.concatenate(found)[:n]


def _noisy(points, noise: float, rng) -> np.ndarray:
    if noise == 0:
        return points
    diagonal = np.linalg.norm(np.ptp(points, axis=0))
    return points + rng.normal(scale=noise * diagonal, size=points.shape)


def _directions(n: int, rng) -> np.ndarray:
    v = rng.normal(size=(n, 3))
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def _perpendicular(axis: np.ndarray, rng) -> np.ndarray:
    """A random unit vector perpendicular to each row."""
    v = rng.normal(size=axis.shape)
    v -= axis * (v * axis).sum(axis=1, keepdims=True)
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def _chain(nodes, radius: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    nodes = np.asarray(nodes, float)
    start = np.arange(len(nodes) - 1)
    return nodes, np.stack([start, start + 1], axis=1), np.full(len(nodes), float(radius))


def _circle(ring_radius: float, radius: float, pieces: int = 128) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    angle = np.arange(pieces) * 2 * np.pi / pieces
    nodes = ring_radius * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    start = np.arange(pieces)
    return nodes, np.stack([start, (start + 1) % pieces], axis=1), np.full(pieces, float(radius))


def _torus_points(n: int, ring_radius: float, radius: float, rng) -> np.ndarray:
    def draw(m):
        around, tube_angle = rng.uniform(0, 2 * np.pi, (2, m))
        out = ring_radius + radius * np.cos(tube_angle)
        points = np.stack([out * np.cos(around), out * np.sin(around), radius * np.sin(tube_angle)], axis=1)
        return points[rng.uniform(0, ring_radius + radius, m) < out]

    return _collect(draw, n)
