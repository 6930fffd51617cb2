"""Nearest neighbours and how they are spread."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from scipy.spatial import cKDTree

from .cores import in_threads, threads
from .eigen import principal_parts
from .vectors import PAIRS, Floats, dot, unit

THREAD_POINTS = 4096  # speed: points whose neighbours are worth a thread
SCATTER_CHUNK = 4096  # speed: rows at a time: the (3, rows, k) work array then stays in the cache


def nearest_neighbours(points: np.ndarray, k: int, of: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Distances to the k nearest points of every point, itself first, or of places `of` (m, 3), and which these are.

    Two arrays (n, k), or (m, k). On all cores, unless ``OMP_NUM_THREADS`` says otherwise.
    """
    # Split at middles, not at medians: a twelfth faster to build and ask together.
    tree, asked = cKDTree(points, leafsize=24, balanced_tree=False), points if of is None else of
    distance, neighbour = np.empty((len(asked), k)), np.empty((len(asked), k), int)

    def ask(part: tuple[int, int]) -> None:
        start, stop = part
        found = tree.query(asked[start:stop], k)
        distance[start:stop], neighbour[start:stop] = (np.reshape(each, (stop - start, k)) for each in found)

    parts = max(min(threads(), len(asked) // THREAD_POINTS), 1)
    bounds = np.linspace(0, len(asked), parts + 1).astype(int).tolist()
    # Not SciPy's own threads, which outlive their arrays when they are interrupted, and crash the process.
    for _ in in_threads(ask, pairwise(bounds), parts):
        pass  # it is written in place
    return distance, neighbour


def mean_distances(points: np.ndarray, neighbours: np.ndarray) -> Floats:
    """Mean distance of every point (n, 3) to its neighbours (n, k), of which it is the first itself, (n,)."""
    coordinates, mean = np.ascontiguousarray(points.T), np.empty(len(points))
    for start in range(0, len(points), SCATTER_CHUNK):
        part = slice(start, start + SCATTER_CHUNK)
        away = (x.take(neighbours[part, 1:]) - x[part, None] for x in coordinates)
        mean[part] = np.sqrt(sum(each * each for each in away)).mean(axis=1)
    return mean


def nearest_left(points: np.ndarray, neighbours: np.ndarray, left: np.ndarray, k: int) -> np.ndarray:
    """The k nearest points of every point left among those left, (m, k) positions among these, nearest first.

    `neighbours` (n, c), c >= k, are the nearest among all; points are asked anew only where too few of them are left.
    """
    rows, index = np.flatnonzero(left), np.cumsum(left) - 1
    known = neighbours[rows]
    there = left.take(known)
    rank = np.cumsum(there, axis=1, dtype=np.int16)
    enough, found = rank[:, -1] >= k, np.empty((len(rows), k), int)
    found[enough] = index[known[enough][(there & (rank <= k))[enough]]].reshape(-1, k)
    if not enough.all():
        found[~enough] = nearest_neighbours(points[rows], k, of=points[rows[~enough]])[1]
    return found


def nearest_moved(points: np.ndarray, neighbours: np.ndarray, moved: np.ndarray) -> np.ndarray:
    """The nearest points of every point after some have moved a little; asked anew only around these.

    `neighbours` (n, k) belong to where the points were, and `moved` (n,) are those that have moved, not farther than
    their neighbours were. Of the others one in a thousand lacks a neighbour that came from farther away.
    """
    changed = moved[neighbours].any(axis=1)
    changed[neighbours[moved]] = True
    found: np.ndarray = neighbours.copy()
    found[changed] = nearest_neighbours(points, neighbours.shape[1], of=points[changed])[1]
    return found


def spacing(points: np.ndarray) -> float:
    """Mean distance of points (n, 3) to six neighbours, as many as a regular triangulation gives each."""
    return float(nearest_neighbours(points, min(7, len(points)))[0][:, 1:].mean())


def local_outlier_ratio(mean: Floats, neighbours: np.ndarray) -> np.ndarray:
    """Mean distance of every point to its neighbours over that of the neighbours to theirs (Breunig et al. 2000, LOF).

    Near 1 on a surface, whatever its density; an outlier has more.
    """
    return mean / row_medians(mean.take(neighbours[:, 1:]))


def row_medians(values: np.ndarray) -> Floats:
    """Median of every row of (n, k): several times faster than NumPy's on short rows."""
    k = values.shape[1]
    ordered: Floats = np.sort(values, axis=1)
    return (ordered[:, (k - 1) // 2] + ordered[:, k // 2]) / 2


def scatter(points: np.ndarray, neighbours: np.ndarray) -> np.ndarray:
    """Scatter matrix of every neighbourhood: the sums of products of what its points deviate from their mean.

    (6, n) float array from points (m, 3) and neighbours (n, k): its entries xx, xy, xz, yy, yz, zz.
    """
    coordinates, entries = np.ascontiguousarray(points.T), np.empty((6, len(neighbours)))
    share = np.full(neighbours.shape[1], 1 / neighbours.shape[1])
    for start in range(0, len(neighbours), SCATTER_CHUNK):
        part = slice(start, start + SCATTER_CHUNK)
        patch = coordinates.take(neighbours[part], axis=1)
        patch -= (patch @ share)[:, :, None]
        for entry, (i, j) in zip(entries, PAIRS, strict=True):
            np.einsum("nk,nk->n", patch[i], patch[j], out=entry[part])
    return entries


def principal(points: np.ndarray, neighbours: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Principal components of every neighbourhood: sums of squares, (n, 3) ascending, and unit normals (n, 3)."""
    values, normals = principal_parts(scatter(points, neighbours))
    return np.maximum(values.T, 0), normals


def wide_covariances(
    points: np.ndarray, average: Callable[[np.ndarray], np.ndarray], times: int
) -> tuple[np.ndarray, np.ndarray]:
    """Covariances of wider surroundings: what `average` makes of the first and second moments, again and again.

    It takes (n, c) float arrays to means over the surroundings of each point. Two (6, n) float arrays as of `scatter`:
    the covariances, and the means of the squares and products that they are the difference of.
    """
    moments = np.stack([*points.T, *(points[:, i] * points[:, j] for i, j in PAIRS)], axis=1)
    for _ in range(times):
        moments = average(moments)
    mean, square = moments[:, :3].T, moments[:, 3:].T
    return square - [mean[i] * mean[j] for i, j in PAIRS], square


def uprightness(points: np.ndarray, normals: np.ndarray, p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """How upright two normals stand on the line between their points `p` and `q`, (m,): sin^2 times sin^2.

    1 where a surface goes on from one point to the other, 0 where two surfaces face each other.
    """
    line = unit(points.take(q, axis=0) - points.take(p, axis=0))
    at_p, at_q = (np.maximum(1 - dot(normals.take(end, axis=0), line) ** 2, 0) for end in (p, q))
    return at_p * at_q


def plane_axes(normals: np.ndarray) -> np.ndarray:
    """Two orthonormal axes perpendicular to each normal (Duff et al. 2017, "Building an orthonormal basis, revisited").

    (n, 3, 2) float array from `normals` (n, 3), unit vectors.
    """
    x, y, z = normals.T
    sign = np.copysign(1.0, z)
    a = -1.0 / (sign + z)
    b = x * y * a
    first = np.stack([1.0 + sign * x * x * a, sign * b, -sign * x], axis=1)
    second = np.stack([b, sign + y * y * a, -y], axis=1)
    return np.stack([first, second], axis=2)
