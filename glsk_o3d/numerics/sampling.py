"""Farthest-point sampling."""

import numpy as np
from scipy.spatial import cKDTree


def farthest_point_sampling(points, radius):
    """Sample points so that every point lies within `radius` of a sample: each sample is the farthest point left.

    Starts at the point farthest from the centroid, so that the samples depend neither on the order of the points nor on
    how they are turned.

    Parameters
    ----------
    points : (n, 3) float array
    radius : float
        Positive.

    Returns
    -------
    samples : (m,) int array
        In the order taken.
    owner : (n,) int array
        For every point the position in `samples` of the sample nearest to it.
    """
    tree = cKDTree(points)
    nearest = np.full(len(points), np.inf)
    owner = np.zeros(len(points), int)
    sample = int(np.argmax(((points - points.mean(axis=0)) ** 2).sum(axis=1)))
    reach = np.inf
    samples = []
    while reach > radius or not samples:
        # Only points nearer to the new sample than the reach so far can change hands.
        ball = slice(None) if np.isinf(reach) else np.array(tree.query_ball_point(points[sample], reach))
        distance = np.linalg.norm(points[ball] - points[sample], axis=1)
        closer = distance < nearest[ball]
        hit = np.flatnonzero(closer) if isinstance(ball, slice) else ball[closer]
        nearest[hit] = distance[closer]
        owner[hit] = len(samples)
        samples.append(sample)
        sample = int(np.argmax(nearest))
        reach = nearest[sample]
    return np.array(samples), owner
