"""Cycles of a graph embedded in space, and how wide they open."""

from collections.abc import Iterator
from typing import TypeAlias

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from .groups import breadth_first_forest, component_labels, group_sum
from .polylines import maximal_paths
from .vectors import TINY, Floats, Ints, dot

ROOTS_CHUNK = 2**20  # speed: pairs of a root and a chain at a time: memory stays flat
Chain: TypeAlias = tuple[float, list[int]]
"""The length of a path and its vertices."""
Chains: TypeAlias = dict[tuple[int, int], int]
"""The number of the shortest chain between two junctions, in both directions."""


def minimum_cycle_basis(n: int, edges: np.ndarray, lengths: np.ndarray) -> list[np.ndarray]:
    """Shortest set of cycles that generates all others (Horton 1987): vertices of each in order, shortest cycle first.

    Edges (e, 2) come once each, without loops, with positive `lengths` (e,).
    """
    # Strategy: the cost depends on the junctions of the cyclic part alone. Trees that hang on the graph are cut off,
    # and chains of vertices with two neighbours become edges between junctions. A basis is among the cycles that an
    # edge closes with the shortest paths from any junction to its ends (Horton). Those are taken shortest first, each
    # as the bits of its chains, and kept if independent of those before (elimination over the numbers modulo 2).
    chains = _cyclic_chains(n, edges, lengths)
    cycles = [(length, chain[:-1]) for length, chain in chains if chain[0] == chain[-1]]
    cycles += _horton([(length, chain) for length, chain in chains if chain[0] != chain[-1]])
    return [np.array(vertices) for _, vertices in sorted(cycles, key=lambda cycle: cycle[0])]


def edges_on_cycles(n: int, edges: np.ndarray) -> np.ndarray:
    """Whether each edge is on a cycle, (e,) bool array, and no bridge, in a graph as in `minimum_cycle_basis`."""
    # Strategy: each edge out of a spanning forest has a random code and closes a cycle with edges of it. These have the
    # sum of the codes (Pritchard 2008, "Fast distributed computation of cuts via random circulations"): 0 for a bridge.
    order, parent, _ = breadth_first_forest(n, edges)
    up, down = (parent[edges] == edges[:, ::-1]).T
    codes = np.where(up | down, 0, np.random.default_rng(0).integers(1 << 62, size=len(edges)))
    total = np.zeros(n + 1, np.int64)
    np.bitwise_xor.at(total, edges.ravel(), np.repeat(codes, 2))
    for v in order[::-1].tolist():  # what is below an edge of the forest adds up
        total[parent[v]] ^= total[v]
    return ~(up | down) | (total[np.where(up, *edges.T)] != 0)


def _cyclic_chains(n: int, edges: np.ndarray, lengths: np.ndarray) -> list[Chain]:
    """Paths between junctions of the cyclic part. A ring of its own starts anywhere."""
    paths = maximal_paths(n, edges)
    ends = np.array([(chain[0], chain[-1]) for chain, _ in paths], int).reshape(-1, 2)
    cyclic = np.ones(len(paths), bool)
    while (tips := (np.bincount(ends[cyclic].ravel(), minlength=n) == 1)[ends].any(axis=1) & cyclic).any():
        cyclic &= ~tips
    if not cyclic.all():
        kept = np.sort([edge for (_, path), on in zip(paths, cyclic, strict=True) if on for edge in path]).astype(int)
        paths, lengths = maximal_paths(n, edges[kept]), lengths[kept]
    return [(float(np.cumsum(lengths[path])[-1]), vertices) for vertices, path in paths]


def _horton(chains: list[Chain]) -> list[Chain]:
    """Minimum cycle basis of the multigraph of chains between different junctions."""
    if not chains:
        return []
    ends = np.unique([(chain[0], chain[-1]) for _, chain in chains], return_inverse=True)[1].reshape(-1, 2)
    lengths = np.array([length for length, _ in chains])
    shortest: Chains = {}
    for e in np.argsort(lengths, kind="stable")[::-1].tolist():  # of parallel chains the shortest stays
        a, b = ends[e].tolist()
        shortest[a, b] = shortest[b, a] = e
    m, keys = int(ends.max()) + 1, np.array(list(shortest))
    graph = csr_matrix((lengths[list(shortest.values())], keys.T), shape=(m, m))
    rank, high = len(chains) - m + component_labels(m, ends).max() + 1, -np.inf
    basis, pivots = list[Chain](), dict[int, int]()
    while len(basis) < rank and high < 2 * lengths.sum():  # in a large graph most cycles of a basis are short
        low, high = high, max(2 * high, 4 * lengths.mean())
        for total, e, before, root in _candidates(graph, low, high, ends, lengths, shortest):
            members = [e]
            for v in ends[e].tolist():
                while v != root:
                    u = int(before[v])
                    members.append(shortest[u, v])
                    v = u
            reduced = sum(1 << chain for chain in members)
            while reduced and (pivot := reduced.bit_length()) in pivots:
                reduced ^= pivots[pivot]
            if reduced:
                pivots[reduced.bit_length()] = reduced
                basis.append((total, _walk([chains[chain][1] for chain in sorted(members)])))
            if len(basis) == rank:
                break
    return basis


def _candidates(
    graph: csr_matrix, low: float, high: float, ends: Ints, lengths: Floats, shortest: Chains
) -> Iterator[tuple[float, int, Ints, int]]:
    """Simple cycles of a chain and the shortest paths from a root to its ends, longer than `low`, up to `high`.

    Shortest first, each once: its length, the chain, the junction before each on the paths, (m,), and the root.
    """
    # Strategy: shortest paths lead from all roots at once, as trees with one row per root. Jumping to the ancestor of
    # the ancestor, again and again, finds on each path the junction next to the root and the sum of the random codes
    # of its chains. A cycle is simple if its two paths start apart, and known by the sum of its codes.
    (a, b), m, chosen = ends.T, graph.shape[0], list(shortest.values())
    codes, code = np.random.default_rng(0).integers(1 << 62, size=len(lengths)), np.zeros(graph.shape, np.int64)
    code[tuple(np.array(list(shortest)).T)] = codes[chosen]
    parallel, trees, cycles = ~np.isin(np.arange(len(lengths)), chosen), [], []
    rows, junction = max(ROOTS_CHUNK // len(lengths), 1), np.arange(m)
    for start in range(0, m, rows):
        root = junction[start : start + rows, None]
        # what rounding adds to half of a cycle must not put it out of reach
        distance, before = dijkstra(graph, indices=root[:, 0], return_predecessors=True, limit=(0.5 + 1e-9) * high)
        up = np.where(before < 0, root, before)
        first, name = np.where(up == root, junction, up), code[up, junction]
        closes = parallel | ((up[:, b] != a) & (up[:, a] != b))
        totals = distance[:, a] + distance[:, b] + lengths
        while (up != root).any():  # twice as far up at a time
            name ^= np.take_along_axis(name, up, axis=1)
            up, first = (np.take_along_axis(table, table, axis=1) for table in (up, first))
        row, e = np.nonzero(closes & (first[:, a] != first[:, b]) & (low < totals) & (totals <= high))
        trees.append(before)
        cycles.append((totals[row, e], e, row + start, name[row, a[e]] ^ name[row, b[e]] ^ codes[e]))
    total, e, top, name = (np.concatenate(arrays) for arrays in zip(*cycles, strict=True))
    before, order = np.concatenate(trees), np.argsort(total, kind="stable")
    order = order[np.sort(np.unique(name[order], return_index=True)[1])]
    for length, chain, end in zip(total[order].tolist(), e[order].tolist(), top[order].tolist(), strict=True):
        yield length, chain, before[end], end


def _walk(chains: list[list[int]]) -> list[int]:
    """Join chains that form one cycle, end to end."""
    walk, *others = chains
    while others:
        chain = others.pop(next(i for i, chain in enumerate(others) if walk[-1] in (chain[0], chain[-1])))
        walk = walk + (chain[1:] if chain[0] == walk[-1] else chain[-2::-1])
    return walk[:-1]


def inscribed_circle(points: np.ndarray) -> tuple[np.ndarray, float]:
    """Centre and radius, to about 1 %, of the largest circle inside of a closed polygon (n, 3), in its plane."""
    middle, axes, ends, low, high = _flattened(points)
    centre, radius = np.zeros(3), 0.0
    focus, span = (low + high) / 2, high - low
    for n in (21, 11, 11):  # a grid that is refined twice
        grid = _grid_inside(np.linspace(-0.5, 0.5, n)[:, None] * span + focus, *ends)
        distance = _distance(grid, *ends)
        if distance.max(initial=0) > radius:
            radius, centre = float(distance.max()), grid[np.argmax(distance)]
        focus, span = centre[:2], span / 5
    return centre @ axes + middle, radius


def places_inside(points: np.ndarray, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Places (g, 3) of a grid of n x n inside of a closed polygon (m, 3), and its plane's axes and normal (3, 3)."""
    middle, axes, ends, low, high = _flattened(points)
    return _grid_inside(low + (np.arange(n)[:, None] + 0.5) / n * (high - low), *ends) @ axes + middle, axes


def _flattened(points: Floats) -> tuple[Floats, Floats, tuple[Floats, Floats], Floats, Floats]:
    """Middle and axes of a closed polygon's plane; in these both ends of its edges, and its box in the plane."""
    middle = points.mean(axis=0)
    axes = np.linalg.svd(points - middle, full_matrices=False)[2]
    polygon = (points - middle) @ axes.T
    ends = polygon, np.concatenate([polygon[1:], polygon[:1]])
    return middle, axes, ends, polygon[:, :2].min(axis=0), polygon[:, :2].max(axis=0)


def _grid_inside(places: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Of the grid of the coordinates of places (n, 2) what is inside of edges from a to b, (g, 3): even-odd rule."""
    x, y = places.T
    row, edge = np.nonzero((a[:, 1] > y[:, None]) != (b[:, 1] > y[:, None]))
    (start, low), (stop, high) = a[edge, :2].T, b[edge, :2].T
    crossing = (stop - start) * (y[row] - low) / (high - low) + start
    beyond = group_sum((x < crossing[:, None]).astype(float), row, len(y))
    row, column = np.nonzero(beyond % 2)
    return np.stack([x[column], y[row], np.zeros(len(row))], axis=1)


def _distance(points: np.ndarray, polygon: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Distance from each point to the closed polygon, (n,) float array; edges lead to the places `after` its own."""
    edge = after - polygon
    length_squared = np.maximum(dot(edge, edge), TINY)
    # products of matrices instead of differences of all pairs; the polygon is centred, so that they lose nothing
    along = points @ edge.T - dot(polygon, edge)
    squared = dot(points, points)[:, None] - 2 * points @ polygon.T
    squared += dot(polygon, polygon)
    share = np.clip(along / length_squared, 0, 1)
    squared += share * (share * length_squared - 2 * along)
    return np.sqrt(np.maximum(squared.min(axis=1), 0))
