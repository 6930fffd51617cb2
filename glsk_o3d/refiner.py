"""Refiner: raw graph -> one-dimensional, medial skeleton (Wen et al. 2024, section II-D)."""

from __future__ import annotations

import heapq
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from scipy.spatial import cKDTree

from .filter import Filter, documented, parameter
from .numerics.groups import group_sum
from .skeleton import plane_distance_radii, trust_warnings

KEEP = 0.1  # weight of staying, per point, in the re-centring
SUPPORT = 8  # input points that a piece of a subdivided edge needs


@documented
@dataclass(frozen=True, kw_only=True)
class Refiner(Filter):
    """Collapse triangles until the graph is one-dimensional, then centre its vertices in the surface around them.

    Edges that lie on a triangle are collapsed, those with the least mean degree of their ends first, and among these
    the shortest. A vertex is then moved to the point nearest to the normal lines of the input points that it and its
    neighbours own: on the axis, even if only one side was scanned.

    Warns
    -----
    SkeletonWarning
        Where no curve skeleton is meaningful: sphere-like or sheet-like clouds.

    Notes
    -----
    The published code also merges nearly straight runs; an indexing slip makes that step idle in most clouds. It is
    left out here.

    References
    ----------
    Cao et al. 2010, section 5; Wen et al. 2024, section II-D.
    """

    consumes: ClassVar[str] = "Skeleton"
    produces: ClassVar[str] = "Skeleton"

    spacing: float = parameter(
        0.5,
        "Longest edge over the local thickness, by subdivision; 0 leaves the edges. Long ones cut corners.",
        type="float",
        low=0,
    )
    recentre: int = parameter(
        2,
        "Passes that centre the vertices on the normal lines of their points; 0 leaves them.",
        type="int",
        unit="passes",
        low=0,
    )

    def _run(self, skeleton, on_iteration):
        skeleton = collapse_triangles(skeleton)
        if self.spacing:
            skeleton = resample(skeleton, self.spacing)
        for _ in range(self.recentre):
            skeleton = replace(skeleton, vertices=medial_vertices(skeleton))
        radii = plane_distance_radii(skeleton.vertices, skeleton.vertex_of_point, skeleton.points, skeleton.normals)
        skeleton = replace(skeleton, radii=radii)
        report = skeleton.report
        for message in trust_warnings(skeleton):
            report = report.with_warning(message)
        return replace(skeleton, report=report)


def collapse_triangles(skeleton):
    """Merge the two ends of edges that lie on a triangle, cheapest first, until there is no triangle.

    Parameters
    ----------
    skeleton : Skeleton

    Returns
    -------
    Skeleton
        Without triangles; points of merged vertices belong to the vertex they were merged into.
    """
    position = skeleton.vertices.copy()
    weight = np.bincount(skeleton.vertex_of_point[skeleton.vertex_of_point >= 0], minlength=len(position)).astype(float)
    weight = np.maximum(weight, 1)
    around: list[set[int]] = [set() for _ in position]
    for a, b in skeleton.edges.tolist():
        around[a].add(b)
        around[b].add(a)

    def cost(a, b):
        return (len(around[a]) + len(around[b])) / 2, float(np.linalg.norm(position[a] - position[b]))

    queue = [(*cost(a, b), a, b) for a, b in skeleton.edges.tolist() if around[a] & around[b]]
    heapq.heapify(queue)
    into = np.arange(len(position))
    while queue:
        *priced, a, b = heapq.heappop(queue)
        if b not in around[a] or not around[a] & around[b]:
            continue
        if tuple(priced) != cost(a, b):
            heapq.heappush(queue, (*cost(a, b), a, b))
            continue
        into[b] = a
        position[a] = (weight[a] * position[a] + weight[b] * position[b]) / (weight[a] + weight[b])
        weight[a] += weight[b]
        for c in around[b]:
            around[c].discard(b)
            if c != a:
                around[c].add(a)
                around[a].add(c)
        around[b].clear()
        for c in around[a]:
            if around[a] & around[c]:
                heapq.heappush(queue, (*cost(a, c), a, c))
    for v in range(len(into)):  # a vertex's target may have been merged on
        root = v
        while into[root] != root:
            root = into[root]
        into[v] = root
    keep = into == np.arange(len(into))
    index = np.cumsum(keep) - 1
    edges = index[[(a, b) for a in np.flatnonzero(keep).tolist() for b in around[a] if a < b]]
    owner = skeleton.vertex_of_point
    return replace(
        skeleton,
        vertices=position[keep],
        edges=np.unique(edges.reshape(-1, 2), axis=0),
        radii=skeleton.radii[keep],
        vertex_of_point=np.where(owner >= 0, index[into[owner]], -1),
    )


def resample(skeleton, spacing):
    """Subdivide the edges to a share of the local thickness; points go to the nearest sample around their vertex.

    Parameters
    ----------
    skeleton : Skeleton
    spacing : float
        Longest edge afterwards, over the mean radius of its ends; longer where fewer than 8 points would support it.

    Returns
    -------
    Skeleton
    """
    ends = skeleton.edges
    m = len(skeleton.vertices)
    length = np.maximum(spacing * skeleton.radii[ends].mean(axis=1), np.finfo(float).tiny)
    count = np.bincount(skeleton.vertex_of_point[skeleton.vertex_of_point >= 0], minlength=m)
    support = (count / np.maximum(skeleton.degree, 1))[ends].sum(axis=1)
    pieces = np.ceil(np.minimum(skeleton.edge_lengths / length, np.maximum(support / SUPPORT, 1))).astype(int)
    inner = pieces - 1
    edge = np.repeat(np.arange(len(ends)), inner)
    step = np.arange(len(edge)) - np.repeat(np.cumsum(inner) - inner, inner) + 1
    t = (step / pieces[edge])[:, None]
    a, b = skeleton.vertices[ends[edge, 0]], skeleton.vertices[ends[edge, 1]]
    vertices = np.concatenate([skeleton.vertices, (1 - t) * a + t * b])

    first = m + np.cumsum(inner) - inner
    chain = np.repeat(np.arange(len(ends)), pieces)
    k = np.arange(len(chain)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    start = np.where(k == 0, ends[chain, 0], first[chain] + k - 1)
    stop = np.where(k == inner[chain], ends[chain, 1], first[chain] + k)
    edges = np.sort(np.column_stack([start, stop]), axis=1)
    edges = edges[np.lexsort((edges[:, 1], edges[:, 0]))]

    parents = np.concatenate([np.column_stack([np.arange(m)] * 2), ends[edge]])
    owned = np.flatnonzero(skeleton.vertex_of_point >= 0)
    owner = skeleton.vertex_of_point[owned]
    near = cKDTree(vertices).query(skeleton.points[owned], min(16, len(vertices)))[1].reshape(len(owned), -1)
    related = (parents[near] == owner[:, None, None]).any(axis=2)
    choice = near[np.arange(len(owned)), np.argmax(related, axis=1)]
    vertex_of_point = skeleton.vertex_of_point.copy()
    vertex_of_point[owned] = np.where(related.any(axis=1), choice, owner)
    radii = np.concatenate(
        [skeleton.radii, ((1 - t[:, 0]) * skeleton.radii[ends[edge, 0]] + t[:, 0] * skeleton.radii[ends[edge, 1]])]
    )
    return replace(skeleton, vertices=vertices, edges=edges, radii=radii, vertex_of_point=vertex_of_point)


def medial_vertices(skeleton):
    """Vertices moved to the point nearest to the normal lines of the input points around them.

    For every vertex the points owned by it and its neighbours, p with normal n, give the least-squares point
    min_x sum |(I - n n^T)(x - p)|^2 + small |x - x0|^2, which lies on the axis of a tube even if the points cover only
    one side of it. Only the component across the skeleton is used, so that vertices do not slide along it.

    Parameters
    ----------
    skeleton : Skeleton

    Returns
    -------
    (M, 3) float array
    """
    centre = skeleton.vertices.mean(axis=0)
    x0 = skeleton.vertices - centre
    m = len(x0)
    owned = skeleton.vertex_of_point >= 0
    owner, p, n = skeleton.vertex_of_point[owned], skeleton.points[owned] - centre, skeleton.normals[owned]
    across = np.eye(3) - n[:, :, None] * n[:, None, :]
    lhs = group_sum(across, owner, m)
    rhs = group_sum(np.einsum("nij,nj->ni", across, p), owner, m)
    count = np.bincount(owner, minlength=m).astype(float)
    a, b = skeleton.edges.T
    lhs, rhs, count = (_with_neighbours(q, a, b) for q in (lhs, rhs, count))
    small = (KEEP * count + 1)[:, None, None]
    return np.linalg.solve(lhs + small * np.eye(3), (rhs + small[:, 0] * x0)[:, :, None])[:, :, 0] + centre


def _with_neighbours(values, a, b):
    total = values.copy()
    np.add.at(total, a, values[b])
    np.add.at(total, b, values[a])
    return total
