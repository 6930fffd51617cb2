"""Which branches are the same in two graphs that have as many components, loops and ends."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from glsk_o3d import Skeleton, samples, skeletonize
from glsk_o3d.analysis.correspondence import same_branches, same_one_by_one


def hammer(joined):
    """A handle along x and a head across it, joined, or apart with a fork at one end of the head; and a piece alone.

    Both have two components and five ends.
    """
    handle, head, prong, piece = (
        [[0, 0, 0], [3, 0, 0]],
        [[0, -1, 0], [0, 0, 0], [0, 1, 0]],
        [[0, 1, 0], [0.3, 1.3, 0]],
        [[-1, 0, 2], [-1, 1, 2]],
    )
    if not joined:
        handle[0], prong = [0.6, 0, 0], [*prong, [0, 1, 0], [-0.3, 1.3, 0]]
    parts = [handle, head, piece] if joined else [handle, head, prong[:2], prong[2:]]
    places = np.concatenate([np.array(part, float) for part in parts])
    first = np.cumsum([0, *map(len, parts)])
    edges = [(i, i + 1) for a, b in pairwise(first) for i in range(a, b - 1)]
    _, row, which = np.unique(places, axis=0, return_index=True, return_inverse=True)
    return Skeleton(places[row], which.ravel()[np.array(edges)], [0.1] * len(row), (), (), ())


def test_a_graph_with_as_many_ends_may_have_other_branches():
    joined, apart = hammer(True), hammer(False)
    for graph in (joined, apart):
        assert (graph.n_components, graph.n_loops, len(graph.leaves)) == (2, 0, 5)
        assert same_one_by_one(graph, graph)
    assert not same_one_by_one(joined, apart)
    assert not same_one_by_one(apart, joined)


@pytest.mark.parametrize("make", [samples.y_junction, samples.two_rings, samples.sauropod])
def test_another_sample_has_the_same_branches(make):
    first, second = (skeletonize(make(2000, seed=seed).points) for seed in (0, 1))
    assert same_one_by_one(first, second)
    order = np.random.default_rng(0).permutation(len(first.vertices))
    moved = replace(
        first, vertices=first.vertices[order] + 1e-3, edges=np.argsort(order)[first.edges], radii=first.radii[order]
    )
    matches = same_branches(moved, first)
    for number, path in enumerate(moved.branches):
        assert set(order[path]) == set(first.branches[matches[number]])
