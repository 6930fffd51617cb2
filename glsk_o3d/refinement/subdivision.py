"""Subdivide edges, so that chords do not cut corners."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..numerics.nearest_edges import incident_edges
from ..numerics.vectors import TINY, dot, norm
from ..skeleton import Skeleton
from .sections import measure_sections
from .vertex_points import VertexPoints

POINTS_PER_PIECE = 8  # fitted: an edge is cut into at most one piece for every so many input points, begun ones counted
SUBDIVISION_CHUNK = 65536  # measured: points at a time: memory stays flat


def subdivide_edges(skeleton: Skeleton, spacing: float) -> Skeleton:
    """Subdivide the edges to a share of the local radius; points go to the nearest sample around their vertex.

    No edge is longer than `spacing` times the mean radius of its ends, but where points are few: a piece for 8.
    """
    ends = skeleton.edges
    m = len(skeleton.vertices)
    radii = measure_sections(skeleton).radius
    length = np.maximum(spacing * radii[ends].mean(axis=1), np.maximum(1e-3 * skeleton.edge_lengths, TINY))
    points = (VertexPoints(skeleton).mass / np.maximum(skeleton.degree, 1))[ends].sum(axis=1)
    most = np.maximum(points / POINTS_PER_PIECE, 1)
    pieces = np.ceil(np.clip(skeleton.edge_lengths / length, 1, most)).astype(int)  # also edges of no length are one
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

    around, vertex_of_point = incident_edges(ends, m), skeleton.vertex_of_point.copy()
    owned = np.flatnonzero(vertex_of_point >= 0)
    for begin in range(0, len(owned), SUBDIVISION_CHUNK):
        part = owned[begin : begin + SUBDIVISION_CHUNK]
        vertex, points = vertex_of_point[part], skeleton.points[part]
        choice, best = vertex.copy(), norm(points - skeleton.vertices.take(vertex, axis=0))
        for column in around[vertex].T:
            some = np.flatnonzero(column >= 0)
            some = some[inner[column[some]] > 0]
            e = column[some]
            p, a = points.take(some, axis=0), skeleton.vertices.take(ends[e, 0], axis=0)
            along = skeleton.vertices.take(ends[e, 1], axis=0) - a
            place = pieces[e] * dot(p - a, along) / np.maximum(dot(along, along), TINY)
            sample = first[e] + np.clip(np.rint(place), 1, inner[e]).astype(int) - 1
            distance = norm(p - vertices.take(sample, axis=0))
            nearer = distance < best[some]
            choice[some[nearer]], best[some[nearer]] = sample[nearer], distance[nearer]
        vertex_of_point[part] = choice
    radii = np.concatenate(
        [skeleton.radii, ((1 - t[:, 0]) * skeleton.radii[ends[edge, 0]] + t[:, 0] * skeleton.radii[ends[edge, 1]])]
    )
    return replace(skeleton, vertices=vertices, edges=edges, radii=radii, vertex_of_point=vertex_of_point)
