"""Cycles of a graph embedded in space, and how wide they open."""

from collections.abc import Iterator
from typing import TypeAlias

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import breadth_first_order, dijkstra

from .groups import component_labels, group_sum
from .paths import maximal_paths
from .vectors import TINY, Floats, Ints, dot

ROOTS_CHUNK = 2**20  # speed: pairs of a root and a chain at a time: memory stays flat
Chain: TypeAlias = tuple[float, list[int]]
"""The length of a path and its vertices."""
Chains: TypeAlias = dict[tuple[int, int], int]
"""The number of the shortest chain between two junctions, both ways."""


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

    An edge that is in no spanning tree closes a cycle with edges of one. Every one of these has the sum of the random
    codes of those that close a cycle with it, which is 0 if there are none: what is below it in the tree adds up.
    """
    label = component_labels(n, edges)
    roots = np.column_stack([np.full(label.max(initial=-1) + 1, n), np.unique(label, return_index=True)[1]])
    links = np.concatenate([edges, roots])  # from one more vertex there is one tree
    graph = csr_matrix((np.ones(len(links)), links.T), shape=(n + 1, n + 1))
    order, above = breadth_first_order(graph, n, directed=False)
    up, down = (above[edges] == edges[:, ::-1]).T
    codes = np.where(up | down, 0, np.random.default_rng(0).integers(1 << 62, size=len(edges)))
    total = np.zeros(n + 1, np.int64)
    np.bitwise_xor.at(total, edges.ravel(), np.repeat(codes, 2))
    for v in order[:0:-1].tolist():
        total[above[v]] ^= total[v]
    return ~(up | down) | (total[np.where(up, *edges.T)] != 0)


def _cyclic_chains(n: int, edges: np.ndarray, lengths: np.ndarray) -> list[Chain]:
    """Paths between junctions of the cyclic part. A ring of its own starts anywhere."""
    paths = maximal_paths(n, edges)
    ends = np.array([(chain[0], chain[-1]) for chain, _ in paths], int).reshape(-1, 2)
    cyclic = np.ones(len(paths), bool)
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
    ends = np.unique([(chain[0], chain[-1]) for _, chain in chains], return_inverse=True)[1].reshape(-1, 2)
    lengths = np.array([length for length, _ in chains])
    order = np.argsort(lengths, kind="stable")
    shortest: Chains = {}
    for e in order[::-1].tolist():  # of parallel chains the shortest stays
        a, b = ends[e].tolist()
        shortest[a, b] = shortest[b, a] = e
    m, keys = int(ends.max()) + 1, np.array(list(shortest))
    graph = csr_matrix((lengths[list(shortest.values())], keys.T), shape=(m, m))
    rank, high = len(chains) - m + component_labels(m, ends).max() + 1, -np.inf
    basis, pivots = list[tuple[float, list[int]]](), dict[int, int]()
    while len(basis) < rank and high < 2 * lengths.sum():  # in a large graph most cycles of a basis are short
        low, high = high, max(2 * high, 4 * lengths.mean())
        for total, e, before, top in _closed(graph, low, high, ends, lengths, shortest):
            cycle = 1 << e
            for v in ends[e].tolist():
                while v != top:
                    u = int(before[v])
                    cycle |= 1 << shortest[u, v]
                    v = u
            reduced = cycle
            while reduced and (pivot := reduced.bit_length()) in pivots:
                reduced ^= pivots[pivot]
            if reduced:
                pivots[reduced.bit_length()] = reduced
                on = np.frombuffer(cycle.to_bytes(len(chains) // 8 + 1, "little"), np.uint8)
                on = np.flatnonzero(np.unpackbits(on, bitorder="little"))
                basis.append((total, _walk([chains[i][1] for i in on.tolist()])))
            if len(basis) == rank:
                break
    return basis


def _closed(
    graph: csr_matrix, low: float, high: float, ends: Ints, lengths: Floats, shortest: Chains
) -> Iterator[tuple[float, int, Ints, int]]:
    """Simple cycles of a chain and the shortest paths from a root to its two ends, longer than `low`, up to `high`.

    The shortest first, and each once: of those that are closed from several roots the first. It is known by the sum of
    random codes of its chains, and is simple if its paths start apart. The third array leads back to its root.
    """
    (a, b), m, chosen = ends.T, graph.shape[0], list(shortest.values())
    codes, code = np.random.default_rng(0).integers(1 << 62, size=len(lengths)), np.zeros(graph.shape, np.int64)
    code[tuple(np.array(list(shortest)).T)] = codes[chosen]
    alone, above, found = ~np.isin(np.arange(len(lengths)), chosen), [], []
    for start in range(0, m, max(ROOTS_CHUNK // len(lengths), 1)):
        root = np.arange(m)[start : start + max(ROOTS_CHUNK // len(lengths), 1), None]
        # what rounding adds to half of a cycle must not put it out of reach
        distance, before = dijkstra(graph, indices=root[:, 0], return_predecessors=True, limit=(0.5 + 1e-9) * high)
        up, each = np.where(before < 0, root, before), np.arange(m)
        first, name = np.where(up == root, each, up), code[up, each]
        apart, totals = alone | ((up[:, b] != a) & (up[:, a] != b)), distance[:, a] + distance[:, b] + lengths
        while (up != root).any():  # twice as far up at a time
            name ^= np.take_along_axis(name, up, axis=1)
            up, first = (np.take_along_axis(table, table, axis=1) for table in (up, first))
        row, e = np.nonzero(apart & (first[:, a] != first[:, b]) & (low < totals) & (totals <= high))
        above.append(before)
        found.append((totals[row, e], e, row + start, name[row, a[e]] ^ name[row, b[e]] ^ codes[e]))
    total, e, top, name = (np.concatenate(part) for part in zip(*found, strict=True))
    before, order = np.concatenate(above), np.argsort(total, kind="stable")
    order = order[np.sort(np.unique(name[order], return_index=True)[1])]
    for number, chain, root in zip(total[order].tolist(), e[order].tolist(), top[order].tolist(), strict=True):
        yield number, chain, before[root], root


def _walk(chains: list[list[int]]) -> list[int]:
    """Join chains that form one cycle, end to end."""
    first, *rest = chains
    walk = list(first)
    while rest:
        chain = rest.pop(next(i for i, chain in enumerate(rest) if walk[-1] in (chain[0], chain[-1])))
        walk += chain[1:] if chain[0] == walk[-1] else chain[-2::-1]
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


def _flattened(points: Floats) -> tuple[Floats, Floats, tuple[Floats, Floats], Floats, Floats]:
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
