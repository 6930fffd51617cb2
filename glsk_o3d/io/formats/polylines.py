"""CGAL's polylines: keep the branches, a line of text for each, to the last bit; lose the radii and all else.

A line holds the number of its points and then x y z of each. Polylines are joined where their ends have equal
coordinates; a vertex without edges is a line of one point.
"""

from __future__ import annotations

import numpy as np

from ...skeleton import Skeleton
from .graphs import graph_skeleton
from .text import line, text, words_by_line


def write(skeleton: Skeleton) -> bytes:
    """The content of a file of polylines."""
    paths = [*skeleton.branches, *np.flatnonzero(skeleton.degree == 0)[:, None]]
    return text(line(len(path), *skeleton.vertices[path].ravel().tolist()) for path in paths)


def read(data: bytes) -> Skeleton:
    """The skeleton in the content of a file of polylines."""
    lines = [[float(word) for word in words] for words in words_by_line(data)]
    if not lines or any(len(numbers) != 1 + 3 * numbers[0] or numbers[0] < 1 for numbers in lines):
        raise ValueError("a line must hold the number of its points and then x y z of each")
    points = np.concatenate([numbers[1:] for numbers in lines]).reshape(-1, 3)
    stop = np.cumsum([int(numbers[0]) for numbers in lines])
    start = np.r_[0, stop[:-1]]
    inner = np.setdiff1d(np.arange(len(points)), stop - 1)  # those with a next point on their line
    ends = np.concatenate([start, stop - 1])[np.tile(stop - start > 1, 2)]
    _, first, which = np.unique(points[ends], axis=0, return_index=True, return_inverse=True)
    label = np.arange(len(points))
    label[ends] = ends[first][which.ravel()]
    kept, index = np.unique(label, return_inverse=True)
    return graph_skeleton(points[kept], index[np.column_stack([inner, inner + 1])])
