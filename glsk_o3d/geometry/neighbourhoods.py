"""Nearest neighbours and how they are spread."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from scipy.spatial import cKDTree

from .cores import in_threads, threads
from .eigen import principal_parts
from .vectors import PAIRS, TINY, Floats, dot, norm, unit

THREAD_POINTS = 4096  # speed: points whose neighbours are worth a thread
SCATTER_CHUNK = 4096  # speed: rows at a time: the (3, rows, k) work array then stays in the cache
ROW_PLACES = 500  # speed: places at which rows are looked for
ROW_DIMENSION = 1.5  # derived: halfway between a curve and a surface
DOUBLINGS = 3  # speed: of the usual number of neighbours, at most
NEXT_ROWS = 2.0  # derived: times as many neighbours as a row alone has: 1.15 times as far as the next row, both see it


def nearest_neighbours(points: np.ndarray, k: int, of: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Distances to the k nearest points of every point, itself first, or of places `of` (m, 3), and which these are.

    Two arrays (n, k), or (m, k), on as many threads as ``OMP_NUM_THREADS`` says.
    """
    # Split at middles, not at medians: a twelfth faster to build and ask together.
    tree, queries = cKDTree(points, leafsize=24, balanced_tree=False), points if of is None else of
    parts = max(min(threads(), len(queries) // THREAD_POINTS), 1)
    bounds = np.linspace(0, len(queries), parts + 1).astype(int).tolist()
    # Not SciPy's own threads, which outlive their arrays when they are interrupted, and crash the process.
    answers = in_threads(lambda part: tree.query(queries[slice(*part)], np.arange(1, k + 1)), pairwise(bounds), parts)
    distance, neighbour = (np.concatenate(arrays) for arrays in zip(*answers, strict=True))
    return distance, neighbour


def mean_distances(points: np.ndarray, neighbours: np.ndarray) -> Floats:
    """Mean distance of every point (n, 3) to its neighbours (n, k), of which it is the first itself, (n,)."""
    coordinates, mean = np.ascontiguousarray(points.T), np.empty(len(points))
    for start in range(0, len(points), SCATTER_CHUNK):
        part = slice(start, start + SCATTER_CHUNK)
        offsets = (x.take(neighbours[part, 1:]) - x[part, None] for x in coordinates)
        mean[part] = np.sqrt(sum(offset * offset for offset in offsets)).mean(axis=1)
    return mean


def nearest_left(points: np.ndarray, neighbours: np.ndarray, remaining: np.ndarray, k: int) -> np.ndarray:
    """The k nearest of every remaining point among those that remain, (m, k) positions among these, nearest first.

    `neighbours` (n, c), c >= k, are the nearest among all; looked up anew only for points of which too few remain.
    """
    rows, index = np.flatnonzero(remaining), np.cumsum(remaining) - 1
    known = neighbours[rows]
    present = remaining.take(known)
    rank = np.cumsum(present, axis=1, dtype=np.int16)
    enough, nearest = rank[:, -1] >= k, np.empty((len(rows), k), int)
    nearest[enough] = index[known[enough][(present & (rank <= k))[enough]]].reshape(-1, k)
    if not enough.all():
        nearest[~enough] = nearest_neighbours(points[rows], k, of=points[rows[~enough]])[1]
    return nearest


def nearest_moved(points: np.ndarray, neighbours: np.ndarray, moved: np.ndarray) -> np.ndarray:
    """The nearest of every point after those `moved` (n,) bool have moved no farther than `neighbours` (n, k) were.

    They are looked up anew only around these. Of the others one in a thousand lacks one that came from farther away.
    """
    changed = moved[neighbours].any(axis=1)
    changed[neighbours[moved]] = True
    nearest: np.ndarray = neighbours.copy()
    nearest[changed] = nearest_neighbours(points, neighbours.shape[1], of=points[changed])[1]
    return nearest


def spacing(points: np.ndarray) -> float:
    """Mean distance of points (n, 3) to six neighbours, as many as a regular triangulation gives each."""
    return float(nearest_neighbours(points, min(7, len(points)))[0][:, 1:].mean())


def local_outlier_ratio(mean: Floats, neighbours: np.ndarray) -> np.ndarray:
    """Mean distance of every point to its neighbours over the median of theirs (as LOF, Breunig et al. 2000)."""
    return mean / row_medians(mean.take(neighbours[:, 1:]))


def row_medians(values: np.ndarray) -> Floats:
    """Median of every row of (n, k): several times faster than NumPy's on short rows."""
    k = values.shape[1]
    ordered: Floats = np.sort(values, axis=1)
    return (ordered[:, (k - 1) // 2] + ordered[:, k // 2]) / 2


def scatter(points: np.ndarray, neighbours: np.ndarray) -> np.ndarray:
    """Scatter matrices of neighbourhoods (n, k) of points (m, 3) around their means: entries (6, n) as of `eigen`."""
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
    """Covariances of wider surroundings, and the means of squares and products they come from, (6, n) as of `scatter`.

    The first and second moments are averaged so many `times`: (n, c) arrays to means over what surrounds each point.
    """
    moments = np.stack([*points.T, *(points[:, i] * points[:, j] for i, j in PAIRS)], axis=1)
    for _ in range(times):
        moments = average(moments)
    mean, square = moments[:, :3].T, moments[:, 3:].T
    return square - [mean[i] * mean[j] for i, j in PAIRS], square


def uprightness(points: np.ndarray, normals: np.ndarray, p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """How upright normals stand on lines between points `p` and `q`, (m,): 1 along a surface, 0 between facing ones."""
    line = unit(points.take(q, axis=0) - points.take(p, axis=0))
    at_p, at_q = (np.maximum(1 - dot(normals.take(end, axis=0), line) ** 2, 0) for end in (p, q))
    return at_p * at_q


def plane_axes(normals: np.ndarray) -> np.ndarray:
    """Two orthonormal axes across each unit normal (n, 3), (n, 3, 2) float array (Duff et al. 2017, JCGT 6)."""
    (x, y, z), sign = normals.T, np.copysign(1.0, normals[:, 2])
    a = -1.0 / (sign + z)
    b = x * y * a
    first = np.stack([1.0 + sign * x * x * a, sign * b, -sign * x], axis=1)
    second = np.stack([b, sign + y * y * a, -y], axis=1)
    return np.stack([first, second], axis=2)


def reach_next_rows(points: np.ndarray, neighbours: np.ndarray) -> np.ndarray:
    """The neighbours (n, k) of points, or more of them, (n, K), where rows, as of a scanner, would hide the surface."""
    # Strategy: within a distance r a row has in the order of r points, a surface r^2. Where k neighbours grow as along
    # a curve, more are looked at: if most of their neighbourhoods are planar (Demantke et al. 2011, "Dimensionality
    # based scale selection in 3D lidar point clouds"), the points lie in rows on a surface; those of twigs are not.
    # K is the number at which there are twice as many neighbours as on the row alone.
    n, k = neighbours.shape
    places, few = np.arange(0, n, max(n // ROW_PLACES, 1)), max(k // 4, 2)
    near, far = (norm(points[neighbours[places, column]] - points[places]) for column in (few, k - 1))
    if np.median(near * ((k - 1) / few) ** (1 / ROW_DIMENSION) - far) > 0:
        return neighbours
    distance, wide = nearest_neighbours(points, max(min(k << DOUBLINGS, n // 4), k), of=points[places])
    sizes = k << np.arange(DOUBLINGS + 1)  # more than a quarter of a cloud is no neighbourhood
    for size in sizes[sizes <= wide.shape[1]]:
        third, second, first = np.sqrt(principal(points, wide[:, :size])[0].T)
        if 2 * np.count_nonzero(second - third > np.maximum(first - second, third)) > len(places):
            break  # most are rather planar than linear or scattered
    else:
        return neighbours
    on_row = few * distance / np.maximum(near, TINY)[:, None]
    reached = np.arange(distance.shape[1]) >= NEXT_ROWS * on_row
    reached[:, :k], reached[:, -1] = False, True
    return nearest_neighbours(points, int(np.median(reached.argmax(axis=1))) + 1)[1]
