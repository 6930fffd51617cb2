"""The graph of near points: what hangs together where no surface says so, and how it goes on from place to place."""

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix, identity
from scipy.sparse.csgraph import connected_components, minimum_spanning_tree
from scipy.spatial import cKDTree

from .groups import component_labels, group_sum
from .neighbourhoods import nearest_neighbours, row_medians
from .vectors import TINY, Ints, dot, norm, unit

LINK_NEIGHBOURS = 20  # fitted: nearest points that a point may be linked with
LINK_SPACINGS = 2.0  # fitted: longest link over the local spacing; twigs that pass each other are mostly farther apart
SPACING_NEIGHBOUR = 3  # fitted: which of the nearest points is as far away as the spacing


def linked(places: np.ndarray, ends: np.ndarray) -> csr_matrix:
    """Symmetric (n, n) matrix of the lengths of links between places (n, 3), given by their ends (e, 2), or repeatedly.

    Links of no length stay links, and a place has none with itself.
    """
    n, ends = len(places), ends[ends[:, 0] != ends[:, 1]]
    links = csr_matrix(coo_matrix((np.ones(2 * len(ends)), np.concatenate([ends, ends[:, ::-1]]).T), shape=(n, n)))
    row = np.repeat(np.arange(n), np.diff(links.indptr))
    links.data = np.maximum(norm(places.take(row, axis=0) - places.take(links.indices, axis=0)), TINY)
    return links


def near_links(points: np.ndarray) -> csr_matrix:
    """Links, as from `linked`, of points with their nearest, none longer than twice the spacing around either end."""
    n = len(points)
    if n == 0:
        return csr_matrix((0, 0))
    distance, neighbour = nearest_neighbours(points, min(LINK_NEIGHBOURS + 1, n))
    spacing = row_medians(distance[:, min(SPACING_NEIGHBOUR, n - 1)][neighbour])
    row, column = np.nonzero(distance <= LINK_SPACINGS * np.minimum(spacing[:, None], spacing[neighbour]))
    return linked(points, np.stack([row, neighbour[row, column]], axis=1))


def link_growth(links: csr_matrix) -> np.ndarray:
    """Points within two links of every point over those within one, (n,) float array.

    5/3 along a curve, 25/9 on a surface, 125/27 where points fill space; mean over the links of every point, twice.
    """
    step = steps(links)
    one, two = np.diff(step.indptr), np.diff((step @ step).indptr)
    growth: np.ndarray = two / one
    for _ in range(2):
        growth = (step @ growth) / one
    return growth


def steps(links: csr_matrix) -> csr_matrix:
    """1 for every place itself and those that it is linked with."""
    step = csr_matrix(links + identity(links.shape[0]))
    step.data[:] = 1
    return step


def join_pieces(places: np.ndarray, links: csr_matrix, longest: np.ndarray) -> tuple[csr_matrix, np.ndarray]:
    """Join the connected pieces of a graph where they are nearest to each other, until they are one.

    A gap that neither end points across counts twice. No added link is longer than `longest` (n,) at both of its ends:
    several pieces may remain. Returns the links and the ends of those added, (a, 2), which close no loop.
    """
    # Strategy: in every round the pieces are joined by a minimum spanning tree. Candidates are the gaps between near
    # places of different pieces, and from a piece that has none, but the largest, its shortest gap to another place.
    added = np.empty((0, 2), int)
    piece = connected_components(links, directed=False)[1]
    _, neighbour = nearest_neighbours(places, min(LINK_NEIGHBOURS + 1, len(places)))
    near = steps(links) @ steps(links)
    near.data[:] = 1
    # from the mean of what is within two links of a place to it: where it goes on if it is an end
    outward = unit(places - (near @ places) / np.diff(near.indptr)[:, None])
    while piece.max() > 0:
        row, column = np.nonzero(piece[neighbour] != piece[:, None])
        gaps = [np.stack([row, neighbour[row, column]], axis=1)]
        lonely = np.setdiff1d(piece, piece[row])
        for number in lonely[lonely != np.bincount(piece).argmax()].tolist():
            inside, others = np.flatnonzero(piece == number), np.flatnonzero(piece != number)
            distance, nearest = cKDTree(places[others]).query(places[inside])
            gaps.append(np.array([[inside[distance.argmin()], others[nearest[distance.argmin()]]]]))
        ends = np.concatenate(gaps)
        gap = places[ends[:, 1]] - places[ends[:, 0]]
        length = norm(gap)
        short = length <= longest[ends].max(axis=1)
        ends, gap, length = ends[short], gap[short], length[short]
        if len(ends) == 0:
            break
        ahead = np.maximum(dot(outward[ends[:, 0]], gap), -dot(outward[ends[:, 1]], gap)) / np.maximum(length, TINY)
        fresh = ends[spanning(piece, ends, length * (2 - np.maximum(ahead, 0)))]
        added = np.concatenate([added, fresh])
        piece = component_labels(int(piece.max()) + 1, piece[fresh])[piece]
    return linked(places, np.concatenate([np.stack(links.nonzero(), axis=1), added])), added


def spanning(piece: np.ndarray, ends: np.ndarray, length: np.ndarray) -> np.ndarray:
    """Of links (e, 2) between pieces, (n,) int array, which are those of minimum spanning trees, int array."""
    m = int(piece.max()) + 1
    low, high = np.sort(piece[ends], axis=1).T
    order = np.lexsort((length, high, low))
    pair = (low * m + high)[order]
    first: Ints = order[np.append(True, pair[1:] != pair[:-1])]  # the shortest of each two pieces
    between = coo_matrix((np.maximum(length[first], TINY), (low[first], high[first])), shape=(m, m))
    tree = minimum_spanning_tree(csr_matrix(between)).tocoo()
    return first[np.isin(low[first] * m + high[first], tree.row.astype(int) * m + tree.col)]


def slice_centres(points: np.ndarray, links: csr_matrix, distance: np.ndarray, width: float) -> np.ndarray:
    """The centre of the slice that every point is in the middle of, (n, 3) float array.

    Slices are connected pieces between two geodesic distances from the root, a `width` apart (Verroust and Lazarus
    1999, "Extracting skeletal curves from 3D scattered data"), and again half a width farther on.
    """
    n = len(points)
    row, column = links.nonzero()
    centre, nearest = np.empty((n, 3)), np.full(n, np.inf)
    for shift in (0, 0.5):
        place = distance / width + shift
        inside = np.floor(place[row]) == np.floor(place[column])
        piece = component_labels(n, np.stack([row[inside], column[inside]], axis=1))
        mean = group_sum(points, piece, piece.max(initial=-1) + 1) / np.bincount(piece)[:, None]
        off = np.abs(place % 1 - 0.5)
        nearer = off < nearest
        nearest[nearer], centre[nearer] = off[nearer], mean[piece[nearer]]
    return centre
