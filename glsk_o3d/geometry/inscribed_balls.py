"""Which side of a surface is inside, and the ball that touches each of its points from there."""

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import minimum_spanning_tree
from scipy.spatial import cKDTree

from .groups import breadth_first_forest
from .neighbourhoods import uprightness
from .rings import Rings
from .vectors import TINY, Floats, dot

LARGEST_BALL = 0.8  # derived: half the longest side of the working frame
SHRUNK = 1e-3  # precision: of a radius
VOTES = 10  # precision: rounds in which neighbours vote on a sign; noise turns some of a thousand of a spanning tree


def outward_normals(points: np.ndarray, normals: np.ndarray, rings: Rings) -> np.ndarray:
    """Unit normals (n, 3) with signs by which they point out of the object."""
    # Strategy: signs spread along the spanning tree of the neighbours that agree best (Hoppe et al. 1992, "Surface
    # reconstruction from unorganized points"), where a surface goes on from one to the other; then neighbours vote, as
    # in power iterations. Of every piece most is bent around the inside, as the wall of a hole is not.
    n, p, q = len(points), rings.centres, rings.indices
    cosine = dot(normals.take(p, axis=0), normals.take(q, axis=0))
    weight = np.abs(cosine) * uprightness(points, normals, p, q)
    tree = minimum_spanning_tree(csr_matrix((1 + SHRUNK - weight, (p, q)), shape=(n, n))).nonzero()
    _, up, piece = breadth_first_forest(n, np.stack(tree, axis=1))
    up = np.where(up == n, np.arange(n), up)
    sign = np.where(dot(normals, normals[up]) < 0, -1.0, 1.0)
    while (up != up[up]).any():  # twice as far up at a time
        sign, up = sign * sign[up], up[up]
    links = csr_matrix((cosine * weight * sign[p] * sign[q], (p, q)), shape=(n, n))
    vote = np.ones(n)
    for _ in range(VOTES):
        vote = links @ vote
        vote /= max(np.abs(vote).max(), TINY)
    sign = np.where(vote < 0, -sign, sign)
    bent = dot(points - rings.mean_over(points), normals) * sign
    bent = np.clip(bent / max(np.median(np.abs(bent)), TINY), -3, 3)
    return normals * (sign * np.where(np.bincount(piece, bent) < 0, -1, 1)[piece])[:, None]


def inscribed_balls(points: np.ndarray, outward: np.ndarray) -> tuple[Floats, Floats]:
    """Radius of the ball inside that touches each point, (n,), and distance of its contacts over its diameter, (n,)."""
    # Strategy: all balls shrink at once to the sphere through the point and what is nearest to the centre, and drop out
    # when they are empty (Ma et al. 2012, "3D medial axis point approximation using nearest neighbors and the normal
    # field"). One that meets nothing has a single contact.
    n = len(points)
    tree, radius, contacts, row = cKDTree(points), np.full(n, LARGEST_BALL), np.zeros(n), np.arange(n)
    while len(row):
        distance, nearest = tree.query(points[row] - radius[row, None] * outward[row], 2)
        own = nearest[:, 0] == row
        other, gap = np.where(own, nearest[:, 1], nearest[:, 0]), np.where(own, distance[:, 1], distance[:, 0])
        chord = points[other] - points[row]
        squared, depth = dot(chord, chord), -dot(outward[row], chord)
        shrinks = (gap < (1 - SHRUNK) * radius[row]) & (depth > 0)
        row, squared, depth = row[shrinks], squared[shrinks], depth[shrinks]
        radius[row], contacts[row] = squared / (2 * depth), depth / np.sqrt(squared)
    return radius, contacts


def mean_places(
    points: np.ndarray, outward: np.ndarray, rings: Rings, radius: np.ndarray, contacts: np.ndarray
) -> tuple[Floats, Floats]:
    """What inscribed balls say of the medial axis, as places (n, 3) and trust (n,): means of centres over two rings.

    Each weighs by the squared distance of its `contacts` over that of its diameter, which is what they say of its
    centre: 1 of two walls, 0 of a single flat face.
    """
    trust = contacts[:, None] ** 2
    centre, count = trust * (points - radius[:, None] * outward), rings.sizes[:, None]
    for _ in range(2):
        centre, trust = ((sums + count * rings.mean_over(sums)) / (1 + count) for sums in (centre, trust))
    return centre / np.maximum(trust, TINY), trust[:, 0]
