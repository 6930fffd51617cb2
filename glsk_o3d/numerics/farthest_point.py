"""Farthest-point sampling."""

import numpy as np
from scipy.spatial import cKDTree

from .vectors import dot, norm


def farthest_point_sampling(points: np.ndarray, radius: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sample points until every one lies in the ball of a sample: each is the point farthest from those before.

    Distances from a sample count in units of its own `radius` (n,), so that samples are dense where the radii are
    small. The first sample is the point farthest from the centroid, which depends neither on the order of the points
    nor on how they are turned. Returns the samples (m,) in the order taken, and for every point the position of the
    sample nearest to it, (n,).
    """
    tree, nearest = cKDTree(points), np.full(len(points), np.inf)
    representative = np.zeros(len(points), int)
    away = points - points.mean(axis=0)
    sample = int(np.argmax(dot(away, away)))
    samples: list[int] = []
    while nearest[sample] > 1:
        # Only points nearer to the new sample than the farthest point is to the old ones can change hands.
        reach = nearest[sample]
        ball = np.arange(len(points))
        if samples:
            ball = np.array(tree.query_ball_point(points[sample], reach * radius[sample]))
        distance = norm(points.take(ball, axis=0) - points[sample]) / radius[sample]
        closer = distance < nearest[ball]
        nearest[ball[closer]] = distance[closer]
        representative[ball[closer]] = len(samples)
        samples.append(sample)
        sample = int(np.argmax(nearest))
    return np.array(samples), representative
