"""Subdivide the edges of a curve to a share of the local radius."""

import numpy as np

from ...geometry.polylines import incident_edges
from ...geometry.vectors import TINY, dot, norm
from ..curve import Curve
from ..numbers import CURVE

EDGE_PIECES = 1000  # speed: of an edge, where parts have no thickness
SUBDIVISION_CHUNK = 65536  # speed: points at a time: memory stays flat


def subdivide_edges(curve: Curve, spacing: float) -> Curve:
    """Subdivide the edges to a share of the local radius; points go to the nearest sample around their vertex.

    No edge is longer than `spacing` times the mean radius of its ends, but where points are few: a piece for 8.
    """
    ends, m = curve.edges, len(curve.vertices)
    half = curve.sections.radius[ends].mean(axis=1)
    length = np.maximum(spacing * half, np.maximum(curve.edge_lengths / EDGE_PIECES, TINY))
    points = (curve.cloud.mass / np.maximum(curve.degree, 1))[ends].sum(axis=1)
    most = np.maximum(points / CURVE.half_support, 1)
    pieces = np.ceil(np.clip(curve.edge_lengths / length, 1, most)).astype(int)  # also edges of no length are one
    inner = pieces - 1
    edge = np.repeat(np.arange(len(ends)), inner)
    step = np.arange(len(edge)) - np.repeat(np.cumsum(inner) - inner, inner) + 1
    share = np.column_stack([1 - step / pieces[edge], step / pieces[edge]])
    vertices = np.concatenate([curve.vertices, (share[:, :, None] * curve.vertices[ends[edge]]).sum(axis=1)])
    radii = np.concatenate([curve.radii, (share * curve.radii[ends[edge]]).sum(axis=1)])

    first, chain = m + np.cumsum(inner) - inner, np.repeat(np.arange(len(ends)), pieces)
    k = np.arange(len(chain)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    start = np.where(k == 0, ends[chain, 0], first[chain] + k - 1)
    stop = np.where(k == inner[chain], ends[chain, 1], first[chain] + k)
    edges = np.column_stack([start, stop])

    around, vertex_of_point = incident_edges(ends, m), curve.vertex_of_point.copy()
    owned = np.flatnonzero(vertex_of_point >= 0)
    for begin in range(0, len(owned), SUBDIVISION_CHUNK):
        part = owned[begin : begin + SUBDIVISION_CHUNK]
        vertex, points = vertex_of_point[part], curve.points[part]
        choice, best = vertex.copy(), norm(points - curve.vertices.take(vertex, axis=0))
        for column in around[vertex].T:
            rows = np.flatnonzero(column >= 0)
            rows = rows[inner[column[rows]] > 0]
            e = column[rows]
            p, a = points.take(rows, axis=0), curve.vertices.take(ends[e, 0], axis=0)
            along = curve.vertices.take(ends[e, 1], axis=0) - a
            place = pieces[e] * dot(p - a, along) / np.maximum(dot(along, along), TINY)
            sample = first[e] + np.clip(np.rint(place), 1, inner[e]).astype(int) - 1
            distance = norm(p - vertices.take(sample, axis=0))
            nearer = distance < best[rows]
            choice[rows[nearer]], best[rows[nearer]] = sample[nearer], distance[nearer]
        vertex_of_point[part] = choice
    return curve.rewired(edges, vertices=vertices, radii=radii, vertex_of_point=vertex_of_point)
