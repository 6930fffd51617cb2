"""Farthest-point sampling."""

import numpy as np
from scipy.spatial import cKDTree

from .vectors import TINY, dot

FEW_POINTS = 16384  # speed: as many distances are measured sooner than points nearby are looked up


def farthest_point_sampling(points: np.ndarray, radius: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sample points until every one lies in the ball of a sample: each is the point farthest from those before.

    Distances from a sample count in units of its own `radius` (n,), so that samples are dense where the radii are
    small. The first sample is the point farthest from the centroid, which depends neither on the order of the points
    nor on how they are turned. Returns the samples (m,) in the order taken, and for every point the position of the
    sample nearest to it, (n,).
    """
    x, nearest = np.ascontiguousarray(points.T), np.full(len(points), np.inf)
    representative, scale = np.zeros(len(points), int), 1 / np.maximum(radius**2, TINY)
    tree = cKDTree(points) if len(points) > FEW_POINTS else None
    away = points - points.mean(axis=0)
    sample = int(np.argmax(dot(away, away)))
    samples: list[int] = []
    work = np.empty_like(x)
    while nearest[sample] > 1:
        some, near, squared = None, x, work
        if tree is not None and samples:
            # Only points nearer to the new sample than the farthest point is to the old ones can change hands.
            reach = np.sqrt(nearest[sample]) * radius[sample]
            some = np.array(tree.query_ball_point(points[sample], reach))
            near = squared = x.take(some, axis=1)
        np.subtract(near, x[:, sample, None], out=squared)
        np.multiply(squared, squared, out=squared)
        distance = np.add.reduce(squared, axis=0)
        distance *= scale[sample]
        closer = np.flatnonzero(distance < (nearest if some is None else nearest[some]))
        changed = closer if some is None else some[closer]
        nearest[changed], representative[changed] = distance[closer], len(samples)
        samples.append(sample)
        sample = int(nearest.argmax())
    return np.array(samples), representative
