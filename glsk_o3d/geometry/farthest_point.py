"""Farthest-point sampling (Gonzalez 1985, "Clustering to minimize the maximum intercluster distance")."""

import numpy as np

from .vectors import TINY, dot


def farthest_point_sampling(points: np.ndarray, radius: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sample points (n, 3) until all lie in the ball of a sample: each is the point farthest from those before.

    Distances from a sample are in units of its own `radius` (n,). The first sample is the point farthest from the
    centroid, whatever the order of the points. Returns the samples (m,) in the order taken, and for every point the
    position of the sample nearest to it, (n,).
    """
    x, nearest = np.ascontiguousarray(points.T), np.full(len(points), np.inf)
    representative, scale = np.zeros(len(points), int), 1 / np.maximum(radius**2, TINY)
    offset = points - points.mean(axis=0)
    sample, samples = int(np.argmax(dot(offset, offset))), list[int]()
    work = np.empty_like(x)
    while nearest[sample] > 1:
        np.subtract(x, x[:, sample, None], out=work)
        distance = np.multiply(work, work, out=work).sum(axis=0) * scale[sample]
        closer = np.flatnonzero(distance < nearest)
        nearest[closer], representative[closer] = distance[closer], len(samples)
        samples.append(sample)
        sample = int(nearest.argmax())
    return np.array(samples), representative
