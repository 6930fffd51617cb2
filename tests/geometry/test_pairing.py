"""Merging mutual nearest neighbours, against its definition."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from glsk_o3d.geometry.pairing import final_representatives, merge_pairs

SPIRAL = np.linspace(0.1, 1, 600)[:, None]
CLOUDS = {
    "uniform": lambda rng: rng.random((300, 3)),
    "spiral": lambda rng: SPIRAL * np.column_stack([np.cos(40 * SPIRAL), np.sin(40 * SPIRAL), 0 * SPIRAL]),
    "ever denser": lambda rng: 1.02 ** -np.arange(200.0)[:, None] * [1, 0, 0],
    "lattice": lambda rng: np.argwhere(np.ones((6, 6, 6))).astype(float),
}


def defined(points, neighbours, most, least):
    """Round by round, all pairs of free points that are the first free ones among each other's neighbours."""
    mass, into = np.ones(len(points)), np.arange(len(points))
    while (mass > 0).sum() > least:
        free = (mass > 0) & (mass + 1 <= most)
        first = [next((q for q in row[1:] if free[q]), -1) if free[p] else -1 for p, row in enumerate(neighbours)]
        pairs = [(p, q) for p, q in enumerate(first) if p < q and first[q] == p]
        if not pairs:
            break
        room = np.linalg.norm(points[neighbours[:, -1]] - points, axis=1)
        for p, q in pairs:
            kept, swallowed = (q, p) if room[q] > room[p] else (p, q)
            into[swallowed], mass[kept], mass[swallowed] = kept, mass[p] + mass[q], 0
    return final_representatives(into)


@pytest.mark.parametrize("most", [np.inf, 3])
@pytest.mark.parametrize("kind", CLOUDS)
def test_merged_pairs_are_those_of_the_definition(kind, most):
    points = CLOUDS[kind](np.random.default_rng(0))
    neighbours = cKDTree(points).query(points, 12)[1]
    for least in (0, len(points) // 2):
        merged = merge_pairs(points, neighbours, lambda pairs, mass: pairs, most, least)
        np.testing.assert_array_equal(merged, defined(points, neighbours, most, least))
