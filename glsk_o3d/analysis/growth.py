"""Which branch of a skeleton grows from which, from the root on, and which continue each other as one axis."""

from __future__ import annotations

import heapq

import numpy as np


def grow(skeleton, paths, length, section, chosen):
    """Parent and level of every path, and whether it runs towards the root: three (B,) arrays.

    Paths are reached from the roots, the nearest first. `chosen` is the root vertex of its component, or None; other
    components grow from the path with the most volume, `length` times `section`.
    """
    ends = [(int(path[0]), int(path[-1])) for path in paths]
    at: dict[int, list[int]] = {}
    for row, pair in enumerate(ends):
        for vertex in set(pair):
            at.setdefault(vertex, []).append(row)
    parent, level, backwards = np.full(len(paths), -1), np.full(len(paths), -1), np.zeros(len(paths), bool)
    component = skeleton.component_of_vertex[[pair[0] for pair in ends]]
    queue: list[tuple[float, int, int]] = []  # distance, vertex, and the path that leads there
    for part in range(skeleton.n_components):
        if chosen is not None and skeleton.component_of_vertex[chosen] == part:
            if chosen in at:
                queue.append((0.0, chosen, -1))
                continue
            (row,) = (row for row, path in enumerate(paths) if chosen in path)
            place = int(np.argmax(paths[row] == chosen))
            way = np.linalg.norm(np.diff(skeleton.vertices[paths[row]], axis=0), axis=1)
            backwards[row] = way[:place].sum() > way[place:].sum()
        else:
            rows = np.flatnonzero(component == part)
            row = rows[np.argmax((length * section)[rows])]
            free, thick = (np.take(values, ends[row]) for values in (skeleton.degree == 1, skeleton.radii))
            backwards[row] = free[1] if free[0] != free[1] else thick[1] > thick[0]
        level[row] = 0
        queue += [(0.0, vertex, row) for vertex in ends[row]]
    heapq.heapify(queue)
    done = set()
    while queue:
        distance, vertex, via = heapq.heappop(queue)
        if vertex in done:
            continue
        done.add(vertex)
        for row in at[vertex]:
            if level[row] < 0:
                parent[row], level[row] = via, level[via] + 1 if via >= 0 else 0
                backwards[row] = ends[row][0] != vertex
                heapq.heappush(queue, (distance + length[row], ends[row][0 if backwards[row] else 1], row))
    return parent, level, backwards


def axes(parent, level, start, angle, radius, length):
    """First row of every row's axis, and the axes before it: of those that begin in one place, one goes on.

    It is the one that is straight and thick, but no stub: one that ends within its own radius is inside the part.
    """
    stub = _ahead(parent, level, length) < np.nan_to_num(radius)
    straight = np.where(stub, 0, np.cos(np.radians(angle)))
    _, fork = np.unique([parent, start], axis=1, return_inverse=True)
    fork = fork.ravel()  # NumPy 2.0 gives it two axes
    unknown = np.isin(fork, fork[(straight > 0) & np.isnan(radius)])  # there the angle alone decides
    onward = np.nan_to_num(straight * np.where(unknown, 1, radius))
    straightest: dict[tuple[int, int], int] = {}
    for row in np.lexsort((-np.arange(len(onward)), onward)).tolist():  # the last one stays
        if onward[row] > 0:
            straightest[int(parent[row]), int(start[row])] = row
    axis, order = np.arange(len(parent)), np.zeros(len(parent), int)
    for row in np.argsort(level, kind="stable").tolist():
        before = parent[row]
        if before >= 0:
            same = straightest.get((int(before), int(start[row]))) == row
            axis[row], order[row] = (axis[before], order[before]) if same else (row, order[before] + 1)
    return axis, order


def _ahead(parent, level, length):
    """The longest way from the start of every row to a tip, away from the root."""
    ahead = np.array(length, float)
    for row in np.argsort(-level, kind="stable").tolist():  # those farthest from the root first
        before = parent[row]
        if before >= 0:
            ahead[before] = max(ahead[before], length[before] + ahead[row])
    return ahead
