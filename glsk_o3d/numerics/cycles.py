"""Cycles of a graph embedded in space, and how wide they open."""

from typing import TypeAlias

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components, dijkstra

from .groups import group_sum
from .paths import maximal_paths
from .vectors import TINY, dot

ROOTS = 256  # speed: roots at a time from which cycles are closed

Chain: TypeAlias = tuple[float, list[int]]
"""The length of a path and its vertices."""


def minimum_cycle_basis(n: int, edges: np.ndarray, lengths: np.ndarray) -> list[np.ndarray]:
    """Shortest set of cycles that generates all others (Horton 1987): vertices of each in order, shortest cycle first.

    Edges (e, 2) come once each, without loops, with positive `lengths` (e,). Chains of vertices with two neighbours
    count as one edge, and trees that hang on the graph are cut off first: the cost depends on the junctions in the
    cyclic part alone.
    """
    chains = _cyclic_chains(n, edges, lengths)
    cycles = [(length, chain[:-1]) for length, chain in chains if chain[0] == chain[-1]]
    cycles += _horton([(length, chain) for length, chain in chains if chain[0] != chain[-1]])
    return [np.array(vertices) for _, vertices in sorted(cycles, key=lambda cycle: cycle[0])]


def edges_on_cycles(n: int, edges: np.ndarray) -> np.ndarray:
    """Whether each edge is on a cycle, (e,) bool array, and no bridge, in a graph as in `minimum_cycle_basis`.

    An edge that is in no spanning tree closes a cycle with the ways in it from both of its ends to where they meet. Of
    these all edges are contracted, so that none is walked twice.
    """
    around: list[list[tuple[int, int]]] = [[] for _ in range(n)]
    for edge, (a, b) in enumerate(edges.tolist()):
        around[a].append((b, edge))
        around[b].append((a, edge))
    depth, above, closing = [-1] * n, [(-1, -1)] * n, []
    for root in range(n):
        if depth[root] >= 0:
            continue
        depth[root], front = 0, [root]
        for here in front:
            for there, edge in around[here]:
                if depth[there] < 0:
                    depth[there], above[there] = depth[here] + 1, (here, edge)
                    front.append(there)
                elif edge != above[here][1]:
                    closing.append((here, there, edge))
    on, merged = np.zeros(len(edges), bool), list(range(n))

    def top(v: int) -> int:
        while merged[v] != v:
            merged[v] = v = merged[merged[v]]
        return v

    for a, b, edge in closing:
        on[edge] = True
        while (a := top(a)) != (b := top(b)):
            if depth[a] < depth[b]:
                a, b = b, a
            merged[a], edge = above[a]
            on[edge] = True
    return on


def _cyclic_chains(n: int, edges: np.ndarray, lengths: np.ndarray) -> list[Chain]:
    """Paths between junctions of the cyclic part. A ring of its own starts anywhere."""
    paths = maximal_paths(n, edges)
    ends, cyclic = (
        np.array([(chain[0], chain[-1]) for chain, _ in paths], int).reshape(-1, 2),
        np.ones(len(paths), bool),
    )
    while (tips := (np.bincount(ends[cyclic].ravel(), minlength=n) == 1)[ends].any(axis=1) & cyclic).any():
        cyclic &= ~tips
    if not cyclic.all():
        left = np.sort([edge for (_, path), on in zip(paths, cyclic, strict=True) if on for edge in path]).astype(int)
        paths, lengths = maximal_paths(n, edges[left]), lengths[left]
    return [(float(np.cumsum(lengths[path])[-1]), vertices) for vertices, path in paths]


def _horton(chains: list[Chain]) -> list[Chain]:
    """Minimum cycle basis of the multigraph of chains between different junctions."""
    if not chains:
        return []
    junctions = sorted({v for _, chain in chains for v in (chain[0], chain[-1])})
    index = {v: i for i, v in enumerate(junctions)}
    ends = np.array([(index[chain[0]], index[chain[-1]]) for _, chain in chains])
    lengths = np.array([length for length, _ in chains])
    order = np.argsort(lengths, kind="stable")
    shortest = {}
    for e in order[::-1].tolist():  # of parallel chains the shortest stays
        a, b = ends[e].tolist()
        shortest[a, b] = shortest[b, a] = e
    m, keys = len(junctions), np.array(list(shortest))
    graph = csr_matrix((lengths[list(shortest.values())], keys.T), shape=(m, m))
    distance, before = dijkstra(graph, return_predecessors=True)
    rank = len(chains) - m + connected_components(graph, directed=False)[0]
    totals, root, closing = _closed(distance, before, ends, lengths, shortest)
    basis, pivots = list[tuple[float, list[int]]](), dict[int, int]()
    for total, top, e in zip(totals.tolist(), root.tolist(), closing.tolist(), strict=True):
        if len(basis) == rank:
            break
        cycle, above = 1 << e, before[top]
        for v in ends[e].tolist():
            while v != top:
                u = int(above[v])
                cycle |= 1 << shortest[u, v]
                v = u
        reduced = cycle
        while reduced and (pivot := reduced.bit_length()) in pivots:
            reduced ^= pivots[pivot]
        if reduced:
            pivots[reduced.bit_length()] = reduced
            basis.append((total, _walk([chains[i][1] for i in range(len(chains)) if cycle >> i & 1])))
    return basis


def _closed(
    distance: np.ndarray,
    before: np.ndarray,
    ends: np.ndarray,
    lengths: np.ndarray,
    shortest: dict[tuple[int, int], int],
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Simple cycles of a chain and the shortest paths from a root to its two ends: lengths, roots, chains.

    The shortest first, and each once: of those that are closed from several roots the first. It is known by the sum of
    random codes of its chains, and is simple if its paths start apart.
    """
    m, n = len(distance), len(lengths)
    every, (a, b), codes = np.arange(m), ends.T, np.random.default_rng(0).integers(1 << 62, size=n)
    code, direct = np.zeros((m, m), np.int64), np.zeros(n, bool)
    code[tuple(np.array(list(shortest)).T)] = codes[list(shortest.values())]
    direct[list(shortest.values())] = True
    found = [np.empty((3, 0))]
    names = [np.empty(0, np.int64)]
    for start in range(0, m, ROOTS):
        root = every[start : start + ROOTS, None]
        up = np.where(before[root[:, 0]] < 0, root, before[root[:, 0]])
        first, name = np.where(up == root, every, up), code[up, every]
        while (up != root).any():  # twice as far up at a time
            name ^= np.take_along_axis(name, up, axis=1)
            up, first = np.take_along_axis(up, up, axis=1), np.take_along_axis(first, first, axis=1)
        onward = direct & ((before[root[:, 0]][:, b] == a) | (before[root[:, 0]][:, a] == b))
        totals = distance[root[:, 0]][:, a] + distance[root[:, 0]][:, b] + lengths
        row, e = np.nonzero((first[:, a] != first[:, b]) & ~onward & np.isfinite(totals))
        name, total = name[row, a[e]] ^ name[row, b[e]] ^ codes[e], totals[row, e]
        once = np.lexsort([total, name])
        once = np.sort(once[np.unique(name[once], return_index=True)[1]])
        names.append(name[once])
        found.append(np.stack([total[once], row[once] + start, e[once]]))
    every_name, (total, row, e) = np.concatenate(names), np.concatenate(found, axis=1)
    order = np.argsort(total, kind="stable")
    order = order[np.sort(np.unique(every_name[order], return_index=True)[1])]
    return total[order], row[order].astype(int), e[order].astype(int)


def _walk(chains: list[list[int]]) -> list[int]:
    """Join chains that form one cycle, end to end."""
    first, *rest = chains
    walk = list(first)
    while rest:
        for i, chain in enumerate(rest):
            if walk[-1] in (chain[0], chain[-1]):
                walk += chain[1:] if chain[0] == walk[-1] else chain[-2::-1]
                del rest[i]
                break
    return walk[:-1]


def inscribed_circle(points: np.ndarray) -> tuple[np.ndarray, float]:
    """Largest circle in the plane of a closed polygon (n, 3) that the curve does not enter: its centre and its radius.

    The centre is found on a grid that is refined twice; the radius is good to about 1 %.
    """
    middle, axes, ends, low, high = _flattened(points)
    centre, best = np.zeros(3), 0.0
    at, span = (low + high) / 2, high - low
    for n in (21, 11, 11):
        grid = _grid(np.linspace(-0.5, 0.5, n)[:, None] * span + at, *ends)
        if len(grid):
            distance = _distance(grid, *ends)
            if distance.max() > best:
                best, centre = float(distance.max()), grid[np.argmax(distance)]
        at, span = centre[:2], span / 5
    return centre @ axes + middle, best


def places_inside(points: np.ndarray, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Places in the plane of a closed polygon (m, 3) and inside of it, (g, 3), on a grid of n x n; the plane's axes.

    The rows of the axes (3, 3) are unit vectors, the last one the normal.
    """
    middle, axes, ends, low, high = _flattened(points)
    return _grid(low + (np.arange(n)[:, None] + 0.5) / n * (high - low), *ends) @ axes + middle, axes


def _flattened(
    points: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, tuple[np.ndarray, np.ndarray], np.ndarray, np.ndarray]:
    """Middle and axes of a closed polygon's plane; in these both ends of its edges, and its box in the plane."""
    middle = points.mean(axis=0)
    axes = np.linalg.svd(points - middle, full_matrices=False)[2]
    polygon = (points - middle) @ axes.T
    ends = polygon, np.concatenate([polygon[1:], polygon[:1]])
    return middle, axes, ends, polygon[:, :2].min(axis=0), polygon[:, :2].max(axis=0)


def _grid(places: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Of the grid of the coordinates of some places (n, 2) what is inside of edges from a to b, (g, 3) float array.

    A place is inside if an odd number of edges cross its row beyond it.
    """
    x, y = places.T
    row, edge = np.nonzero((a[:, 1] > y[:, None]) != (b[:, 1] > y[:, None]))
    (start, low), (stop, high) = a[edge, :2].T, b[edge, :2].T
    crossing = (stop - start) * (y[row] - low) / (high - low) + start
    beyond = group_sum((x < crossing[:, None]).astype(float), row, len(y))
    row, column = np.nonzero(beyond % 2)
    return np.column_stack([x[column], y[row], np.zeros(len(row))])


def _distance(points: np.ndarray, polygon: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Distance from each point to the closed polygon, (n,) float array; edges lead to the places `after` its own."""
    edge = after - polygon
    squared = np.maximum(dot(edge, edge), TINY)
    # products of matrices instead of differences of all pairs; the polygon is centred, so that they lose nothing
    along = points @ edge.T - dot(polygon, edge)
    apart = dot(points, points)[:, None] - 2 * points @ polygon.T
    apart += dot(polygon, polygon)
    share = np.clip(along / squared, 0, 1)
    apart += share * (share * squared - 2 * along)
    return np.sqrt(np.maximum(apart.min(axis=1), 0))
