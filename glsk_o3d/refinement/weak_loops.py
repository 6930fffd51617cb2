"""Cut weak loops: those across which the surface hardly goes on, and narrow ones with little confidence."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..numerics.cycles import minimum_cycle_basis, opens_wider
from ..numerics.neighbourhoods import nearest_neighbours, uprightness
from ..numerics.vectors import dot
from ..skeleton import Skeleton
from .loops import surface_distance

BOND_NEIGHBOURS = 8  # fitted: points, itself included, that are near to a point


def bonds(skeleton: Skeleton, among: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """How far the surface goes on from vertex to vertex.

    Every two near points of different vertices count by how far their normals agree and stand upright on the line
    between them, cos^2 times sin^2 times sin^2: not where surfaces of two parts face each other.

    Parameters
    ----------
    skeleton : Skeleton
    among : (c,) int array, optional
        The vertices to look at; by default all.

    Returns
    -------
    pairs : (B, 2) int array
        Vertices, i < j.
    weight : (B,) float array
    """
    supporting = skeleton.supporting_points
    places = skeleton.points[supporting]
    if len(np.unique(places[:, 0])) < len(supporting):  # perhaps copies, which are near to nothing else
        order = np.lexsort(places.T)
        step = np.diff(places[order], axis=0, prepend=np.nan)
        supporting = np.sort(supporting[order[(step != 0).any(axis=1)]])
    if len(supporting) < 2:
        return np.empty((0, 2), int), np.empty(0)
    points, normals, vertex = (
        skeleton.points[supporting],
        skeleton.normals[supporting],
        skeleton.vertex_of_point[supporting],
    )
    chosen = np.ones(len(vertex), bool) if among is None else np.isin(vertex, among)
    p = np.flatnonzero(chosen)
    near = nearest_neighbours(points, min(BOND_NEIGHBOURS, len(supporting)), of=points[p])[1][:, 1:]
    p, q = np.repeat(p, near.shape[1]), near.ravel()
    foreign = (vertex[p] != vertex[q]) & chosen[q]
    p, q = p[foreign], q[foreign]
    agree = dot(normals[p], normals[q]) ** 2
    weight = agree * uprightness(points, normals, p, q)
    m = len(skeleton.vertices)
    keys, which = np.unique(np.sort(np.column_stack([vertex[p], vertex[q]]), axis=1) @ [m, 1], return_inverse=True)
    return np.column_stack(np.divmod(keys, m)), np.bincount(which, weight, len(keys))


def crossings(cycle: np.ndarray, m: int, pairs: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Bonds across every edge of a cycle, from its vertices on the one side to those on the other, the shorter way.

    Parameters
    ----------
    cycle : (n,) int array
    m : int
        Vertices of the graph.
    pairs, weight
        From `bonds`.

    Returns
    -------
    (n,) float array
        For the edge from each vertex of the cycle to the next.
    """
    n = len(cycle)
    place = np.full(m, -1)
    place[cycle] = np.arange(n)
    first, last = np.sort(place[pairs], axis=1).T
    inside = first >= 0
    first, last, weight = first[inside], last[inside], weight[inside]
    around = last - first > n / 2
    start, stop = np.where(around, last, first), np.where(around, first, last)
    steps = np.bincount(start, weight, n) - np.bincount(stop, weight, n)
    return np.maximum(np.cumsum(steps) + weight[around].sum(), 0)  # rounding leaves less than nothing


def cut_weak_loops(skeleton: Skeleton, weak_bonds: float, weak_opening: float) -> Skeleton:
    """Cut the weak loops, each where the fewest bonds cross.

    A loop is weak where hardly any bond crosses it: two parts touch there, or a lone point lies between them. And it is
    weak if its opening over the distance to the surface is small for the confidence in it: noise and sparse points
    leave narrow loops, not wide ones. All such loops of a minimum cycle basis are cut, until there
    are none; a component is never torn.

    Parameters
    ----------
    skeleton : Skeleton
        With its confidence.
    weak_bonds : float
        Least bonds across an edge over the median along its loop.
    weak_opening : float
        Least opening over the distance to the surface, times the mean confidence.
    """
    m = len(skeleton.vertices)
    cycles = minimum_cycle_basis(m, skeleton.edges, skeleton.edge_lengths)
    if not cycles:
        return skeleton
    pairs, weight = bonds(skeleton, np.concatenate(cycles))  # cutting makes no new cycles elsewhere
    distance = surface_distance(skeleton)
    while True:
        keys = skeleton.edges @ [m, 1]
        cut, used = [], np.zeros(len(keys), bool)
        for cycle in cycles:
            across = crossings(cycle, m, pairs, weight)
            tube, loop = np.median(distance[cycle]), skeleton.confidence[cycle].mean() * skeleton.vertices[cycle]
            if across.min() < weak_bonds * np.median(across) or not opens_wider(loop, weak_opening * tube):
                edges = np.searchsorted(keys, np.sort(np.column_stack([cycle, np.roll(cycle, -1)]), axis=1) @ [m, 1])
                if not used[edges].any():  # two cuts in what two loops share would tear a piece out of it
                    cut.append(edges[np.lexsort((edges, across))[0]])
                used[edges] = True
        if not cut:
            return skeleton
        skeleton = replace(skeleton, edges=np.delete(skeleton.edges, cut, axis=0))
        cycles = minimum_cycle_basis(m, skeleton.edges, skeleton.edge_lengths)
