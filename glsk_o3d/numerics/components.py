"""Connected components of a graph given by its edges."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components


def component_labels(n: int, edges: np.ndarray) -> np.ndarray:
    """Connected component of every node, (n,) int array, numbered from 0; edges (E, 2) int array."""
    return connected_components(coo_matrix((np.ones(len(edges)), edges.T), shape=(n, n)), directed=False)[1]
