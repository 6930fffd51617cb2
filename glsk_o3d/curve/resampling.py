"""The same curve through other vertices: at equal distances, and smooth."""

from itertools import pairwise

import numpy as np
from scipy.interpolate import make_smoothing_spline

from ..data.graph import OF_VERTICES, in_order_of_ends
from ..data.skeleton import Skeleton
from ..geometry.polylines import arc_lengths, incident_edges, nearest_on_edges, place_at
from ..geometry.vectors import TINY
from .rooted import numbered_from

LEAST_SMOOTHED = 5  # derived: vertices that SciPy's smoothing spline needs
FIXED = 1000.0  # precision: weight of the ends of a branch, over that of all its other vertices


def resampled(graph: Skeleton, spacing: float) -> Skeleton:
    """The curve through vertices at equal distances along each branch, as near to `spacing` as a whole number of steps.

    Ends, junctions, detached vertices and the root of a tree stay. Other vertices have what lies between those of
    before; points belong to the new vertex that is nearest to where they were on the edges of their vertex.
    """
    paths = _paths(graph)
    nodes = np.unique(np.concatenate([np.flatnonzero(graph.degree == 0), *(path[[0, -1]] for path in paths)]))
    index = np.full(len(graph.vertices), -1)
    index[nodes] = np.arange(len(nodes))
    least = _least_steps(paths)
    columns = np.column_stack([graph.vertices, *(getattr(graph, name) for name in OF_VERTICES)])
    rows, edges, numbers, step_of_path = [columns[nodes]], [], [], []
    count = len(nodes)
    for path, fewest in zip(paths, least, strict=True):
        along = arc_lengths(graph.vertices[path])
        steps = max(round(along[-1] / spacing), fewest)
        inner = place_at(columns[path], along, along[-1] * np.arange(1, steps) / steps)
        number = np.r_[index[path[0]], count + np.arange(steps - 1), index[path[-1]]]
        rows.append(inner)
        edges.append(np.column_stack([number[:-1], number[1:]]))
        numbers.append(number)
        step_of_path.append(along[-1] / steps)
        count += steps - 1
    table = np.concatenate(rows)
    fields = dict(zip(OF_VERTICES, table[:, 3:].T, strict=True))
    owner = _owners(graph, paths, numbers, step_of_path, index)
    other = graph.changed(
        vertices=np.ascontiguousarray(table[:, :3]),
        edges=in_order_of_ends(np.concatenate([*edges, np.empty((0, 2), int)]), count),
        vertex_of_point=owner,
        **{name: np.ascontiguousarray(values) for name, values in fields.items()},
    )
    return numbered_from(other, 0) if graph.report.root and len(nodes) else other


def _paths(graph: Skeleton) -> list[np.ndarray]:
    """The branches, cut at the root of a tree, which is vertex 0."""
    paths = []
    for path in graph.branches:
        inner = np.flatnonzero(path[1:-1] == 0) + 1 if graph.report.root else np.empty(0, int)
        stops = [0, *inner.tolist(), len(path) - 1]
        paths += [path[a : b + 1] for a, b in pairwise(stops)]
    return paths


def _least_steps(paths: list[np.ndarray]) -> list[int]:
    """Steps that a path has at least: a ring three, and of paths between the same two vertices all but one have two."""
    seen, least = set[tuple[int, int]](), list[int]()
    for path in paths:
        ends = int(min(path[0], path[-1])), int(max(path[0], path[-1]))
        least.append(3 if ends[0] == ends[1] else 1 + (ends in seen))
        seen.add(ends)
    return least


def _owners(
    graph: Skeleton, paths: list[np.ndarray], numbers: list[np.ndarray], steps: list[float], index: np.ndarray
) -> np.ndarray:
    """The new vertex of every point, (N,) int array."""
    owner = np.where(graph.vertex_of_point < 0, -1, index[graph.vertex_of_point])
    points = np.flatnonzero((graph.vertex_of_point >= 0) & (graph.degree > 0)[graph.vertex_of_point])
    if len(points) == 0:
        return owner
    candidates = incident_edges(graph.edges, len(graph.vertices))[graph.vertex_of_point[points]]
    edge, share = nearest_on_edges(graph.vertices, graph.edges, candidates, graph.points[points])
    for path, number, step in zip(paths, numbers, steps, strict=True):
        along, piece = arc_lengths(graph.vertices[path]), np.full(len(graph.edges), -1)
        piece[graph.edges_along([path])] = np.arange(len(path) - 1)
        on_path = np.flatnonzero(piece[edge] >= 0)
        start, part = piece[edge[on_path]], share[on_path]
        part = np.where(path[start] > path[start + 1], 1 - part, part)
        length = (1 - part) * along[start] + part * along[start + 1]
        owner[points[on_path]] = number[np.rint(length / max(step, TINY)).astype(int)]
    return owner


def smoothed(graph: Skeleton, length: float) -> Skeleton:
    """The curve with each branch a cubic smoothing spline of its vertices (Reinsch 1967), ends and junctions kept.

    Waves of the branch with this length keep half their height, longer ones more: those with length l keep
    :math:`1 / (1 + (length / l)^4)`.
    """
    places = graph.vertices.copy()
    for path in graph.branches:
        curve = graph.vertices[path]
        ring, along = path[0] == path[-1], arc_lengths(curve)
        distinct = np.flatnonzero(np.r_[True, np.diff(along) > 0])
        if len(distinct) < LEAST_SMOOTHED:
            continue
        knots, values, weight = along[distinct], curve[distinct], np.ones(len(distinct))
        if ring and graph.degree[path[0]] == 2:  # once more before and behind, as there is no end
            knots = np.concatenate([knots[:-1] - along[-1], knots, knots[1:] + along[-1]])
            values, weight = np.concatenate([values[:-1], values, values[1:]]), np.ones(len(knots))
        else:
            weight[[0, -1]] = FIXED * len(weight)
        stiffness = (length / (2 * np.pi)) ** 4 / (along[-1] / (len(distinct) - 1))
        moved = [make_smoothing_spline(knots, column, weight, lam=stiffness)(along) for column in values.T]
        places[path] = np.column_stack(moved)
    places[graph.degree != 2] = graph.vertices[graph.degree != 2]
    return graph.changed(vertices=places)
