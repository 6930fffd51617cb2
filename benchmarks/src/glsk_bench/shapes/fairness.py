"""What makes a draw fair: its axis is no matter of taste, and a cloud of 4096 points can show it."""

from __future__ import annotations

from itertools import product

import numpy as np
from scipy.ndimage import label
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra
from scipy.spatial.distance import cdist

from glsk_o3d.geometry.groups import component_labels

from .axis import subdivided

# Fitted, as all of this page: on draws that people would not agree about.
GAP = 0.5  # between parts that are not joined nearby, at least, in the smaller radius
NEARBY = 2  # what is joined nearby is so within so many times the sum of both radii
STUB = 0.75  # how far the middle of a tip stands out of all else, at least, in its radius
THINNEST_SPACINGS = 1.2  # least radius, in the mean distance of 4096 points
MOST_PLACES = 3000  # along an axis: all pairs are looked at
LOOP_SAMPLES = 30  # places on a loop, between each two of which a ball is tried
CELLS_PER_RADIUS = 3  # of the grid, along the least radius: what touches there is told from what does not
LEAST_CELL = 0.0035  # of the grid, as a share of the diagonal: at most some ten million cells


def fault(nodes: np.ndarray, edges: np.ndarray, radii: np.ndarray, spacing: float) -> str | None:
    """The first thing that is wrong with a shape, in a word; `spacing` is the mean distance of 4096 points on it.

    ``thin``: a part is thinner than `THINNEST_SPACINGS` spacings; ``large``: there are too many pieces to look at;
    ``gap``: parts come near each other that are not joined nearby; ``opening``: a loop has no room for a ball as thick
    as its thinnest part; ``stub``: a tip hardly stands out of the rest; ``holes``: the solid has other loops or
    components than the axis, or cavities.
    """
    if radii.min() < THINNEST_SPACINGS * spacing:
        return "thin"
    places, links, thick = subdivided(nodes, edges, radii)
    if len(places) > MOST_PLACES:
        return "large"
    apart = cdist(places, places)
    if _gap(apart, links, thick, spacing):
        return "gap"
    found = _unclear(places, links, thick, apart)
    if found:
        return found
    components = int(component_labels(len(places), links).max()) + 1
    expected = (components, len(links) - len(places) + components, 0)
    return None if topology(places, thick) == expected else "holes"


def _gap(apart, links, radii, spacing):
    """Whether two places are near that cannot be reached from each other along the axis without going far.

    Far from a place is what is more than `NEARBY` times two radii off: its own, and that of the thickest part that the
    other one is inside of. What can be reached from which place are the components of a graph of pairs: (i, j) and
    (i, k) are joined if a link joins j and k and both are near i.
    """
    holder = np.where(apart < radii, radii, 0).max(axis=1)
    smaller = np.minimum(radii[:, None], radii)
    close = apart < radii[:, None] + radii + np.maximum(GAP * smaller, spacing)
    near = apart < NEARBY * (radii[:, None] + holder)
    number = np.cumsum(near).reshape(near.shape) - 1
    a, b = links.T
    place, link = np.nonzero(near[:, a] & near[:, b])
    pairs = np.column_stack([number[place, a[link]], number[place, b[link]]])
    part = component_labels(int(near.sum()), pairs)[number]
    return bool((close & ~(near & (part == np.diag(part)[:, None]))).any())


def _unclear(places, links, radii, apart):
    """The first path whose loop is closed up or whose tip is hidden: ``opening`` or ``stub``; else None."""
    n = len(places)
    degree, lengths = np.bincount(links.ravel(), minlength=n), apart[tuple(links.T)]
    paths = chains(n, links)
    for path in paths:
        loop = shortest_loop(n, links, lengths, path)
        if loop and not _opens(places[loop], radii[loop].min(), places, radii):
            return "opening"
        if len(paths) > 1:
            others = np.setdiff1d(np.arange(n), path)
            for tip in {path[0], path[-1]}:
                if degree[tip] == 1 and len(others) and (apart[tip] - radii)[others].min() < STUB * radii[tip]:
                    return "stub"
    return None


def _opens(loop, radius, places, radii):
    """Whether a ball of this radius has room somewhere between two places of a loop."""
    some = loop[np.linspace(0, len(loop) - 1, LOOP_SAMPLES).astype(int)]
    middles = (some[:, None] + some)[np.triu_indices(LOOP_SAMPLES, 1)] / 2
    return (cdist(middles, places) - radii).min(axis=1).max() >= radius


def chains(n: int, edges: np.ndarray) -> list[list[int]]:
    """Paths between nodes that do not have two neighbours; a ring of its own begins and ends at its first node."""
    around: list[dict[int, None]] = [{} for _ in range(n)]
    for a, b in edges.tolist():
        around[a][b] = around[b][a] = None
    degree = [len(links) for links in around]
    found = []
    for start in sorted(range(n), key=lambda node: degree[node] == 2):
        for step in list(around[start]):
            if step not in around[start]:
                continue  # walked from its other end
            path, ahead = [start], step
            while True:
                here = path[-1]
                del around[here][ahead], around[ahead][here]
                path.append(ahead)
                if ahead == start or degree[ahead] != 2:
                    break
                ahead = next(iter(around[ahead]))
            found.append(path)
    return found


def shortest_loop(n: int, edges: np.ndarray, lengths: np.ndarray, path: list[int]) -> list[int]:
    """The shortest loop through the first edge of a path, and so through all of a chain."""
    if path[0] == path[-1]:
        return path[:-1]
    kept = (edges != path[:2]).any(axis=1) & (edges != path[1::-1]).any(axis=1)
    (a, b), length = edges[kept].T, lengths[kept]
    links = coo_matrix((np.r_[length, length], (np.r_[a, b], np.r_[b, a])), (n, n)).tocsr()
    distance, before = dijkstra(links, indices=path[0], return_predecessors=True)
    if not np.isfinite(distance[path[1]]):
        return []
    loop = [path[1]]
    while loop[-1] != path[0]:
        loop.append(int(before[loop[-1]]))
    return loop


def topology(centres: np.ndarray, radii: np.ndarray) -> tuple[int, int, int]:
    """Components, loops and cavities of a union of balls, as its cells on a grid have them."""
    return grid_topology(_cells(centres, radii))


def grid_topology(cells: np.ndarray) -> tuple[int, int, int]:
    """Components, loops and cavities of cells of a grid, (x, y, z) bool array, of which those at its rim are empty.

    Components are cells that share a corner at least, cavities empty cells that share a face with no outer one. The
    Euler characteristic is components less loops plus cavities.
    """
    components = label(cells, np.ones((3, 3, 3)))[1]
    cavities = label(~cells)[1] - 1
    return components, components + cavities - _euler(cells), cavities


def _cells(centres, radii):
    """Which cells of a grid have their middle in a ball; two layers around are empty."""
    cell = max(radii.min() / CELLS_PER_RADIUS, LEAST_CELL)
    low = (centres - radii[:, None]).min(axis=0) - 2 * cell
    high = (centres + radii[:, None]).max(axis=0)
    cells = np.zeros(np.ceil((high - low) / cell).astype(int) + 2, bool)
    for centre, radius in zip((centres - low) / cell, radii / cell, strict=True):
        first, beyond = np.floor(centre - radius).astype(int), np.ceil(centre + radius).astype(int) + 1
        x, y, z = (np.arange(a, b) + 0.5 - c for a, b, c in zip(first, beyond, centre, strict=True))
        ball = (x**2)[:, None, None] + (y**2)[:, None] + z**2 < radius * radius
        cells[tuple(map(slice, first, beyond))] |= ball
    return cells


def _euler(cells):
    """Corners less edges plus faces less cubes of the cells, each counted once."""
    total = 0
    for flat in product((False, True), repeat=3):  # along which axes a face, an edge or a corner has no extent
        grown = cells
        for axis in np.flatnonzero(flat):
            grown = grown | np.roll(grown, 1, axis)
        total += (-1) ** (3 - sum(flat)) * int(np.count_nonzero(grown))
    return total
