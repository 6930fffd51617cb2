"""The Delaunay star of many points at once, by gift wrapping inverted neighbours."""

import numpy as np

_COINCIDENT = 1e-300  # squared distance below which a neighbour counts as the origin itself
_HUGE = np.finfo(float).max
_COLLINEAR = 1e-12  # sine below which two directions count as one


def delaunay_star(offsets, valid=None):
    """Ring of the origin in the 2-D Delaunay triangulation of the origin and its neighbours, for many origins.

    Inversion about the origin, ``q = x / |x|^2``, turns circles through it into lines. A neighbour shares a
    Delaunay edge with the origin exactly when its image is a corner of the convex hull of the images and of the
    origin, which stands for infinity. An origin inside the hull gives a closed ring; an origin on the hull is a
    border point, and its ring is an open fan that starts and ends there. Gift wrapping walks all hulls in step, so
    no triangulation is made.

    Parameters
    ----------
    offsets : (n, k, 2) float array
        Neighbours relative to their origin.
    valid : (n, k) bool array, optional
        Entries to use; all by default. Neighbours that coincide with the origin are never used.

    Returns
    -------
    ring : (n, r) int array
        Positions ``0 .. k-1`` in counter-clockwise order, padded with -1. A closed ring starts at the nearest
        neighbour, a fan at its first border neighbour.
    closed : (n,) bool array
        Whether the ring closes around the origin.

    Notes
    -----
    Of several neighbours on one empty circle through the origin the two outer ones (seen along the circle) are kept;
    the diagonals of a square grid are therefore not ring edges. Collinear neighbourhoods give the nearest neighbour on
    each side as a fan. Of coincident neighbours one is kept.
    """
    offsets = np.asarray(offsets, float)
    if offsets.shape[1] == 0:
        return np.empty((len(offsets), 0), int), np.zeros(len(offsets), bool)
    n, k = offsets.shape[:2]
    squared = np.einsum("nkc,nkc->nk", offsets, offsets)
    apart = squared > _COINCIDENT
    usable = apart if valid is None else valid & apart
    inverse = np.divide(1.0, squared, out=np.zeros_like(squared), where=usable)
    # Column k is the origin of the inverted plane.
    qx, qy = np.zeros((n, k + 1)), np.zeros((n, k + 1))
    np.multiply(offsets[..., 0], inverse, out=qx[:, :k])
    np.multiply(offsets[..., 1], inverse, out=qy[:, :k])
    open_to = np.ones((n, k + 1), bool)
    open_to[:, :k] = usable

    walk = np.full((n, k + 2), -1)
    start = np.argmax(inverse, axis=1)
    walk[:, 0] = start
    rows = np.flatnonzero(usable.any(axis=1))
    qx, qy, open_to, first = qx[rows], qy[rows], open_to[rows], start[rows]
    here = first
    line = np.arange(len(rows))
    # The farthest image is a hull corner; everything lies to the left of its tangent.
    dx, dy = -qy[line, here], qx[line, here]
    for step in range(1, k + 2):
        vx, vy = qx - qx[line, here][:, None], qy - qy[line, here][:, None]
        length = np.sqrt(vx * vx + vy * vy)
        dot = dx[:, None] * vx + dy[:, None] * vy
        cross = dx[:, None] * vy - dy[:, None] * vx
        open_to[line, here] = False
        open_to[line, first] = here != first
        # Half-angle tangent: monotone on [0, pi], and exact for small angles.
        scale = np.sqrt(dx * dx + dy * dy)[:, None] * length
        ahead = dot > 0
        with np.errstate(divide="ignore", invalid="ignore"):
            turn = np.where(ahead, np.maximum(cross, 0) / (scale + dot), (scale - dot) / np.maximum(cross, 0))
        candidate = open_to & (length > 0)
        best = np.argmin(np.where(candidate, np.minimum(turn, _HUGE), np.inf), axis=1)
        bx, by, bl = vx[line, best], vy[line, best], length[line, best]
        # Among the images on the same hull edge take the farthest, but never step over the origin.
        same = candidate & (np.abs(bx[:, None] * vy - by[:, None] * vx) <= _COLLINEAR * bl[:, None] * length)
        same &= bx[:, None] * vx + by[:, None] * vy > 0
        reach = np.where(same, length, -1.0)
        reach[:, k][same[:, k]] = np.inf
        best = np.where(reach.max(axis=1) > 0, np.argmax(reach, axis=1), first)
        dx, dy = vx[line, best], vy[line, best]
        going = best != first
        walk[rows[going], step] = best[going]
        if not going.any():
            break
        rows, first, here = rows[going], first[going], best[going]
        qx, qy, open_to, dx, dy = qx[going], qy[going], open_to[going], dx[going], dy[going]
        line = np.arange(len(rows))

    # Cut the walk at the origin, where it meets it.
    size = (walk >= 0).sum(axis=1)
    size[~usable.any(axis=1)] = 0
    at_origin = walk == k
    closed = ~at_origin.any(axis=1) & (size > 2)
    cut = np.where(at_origin.any(axis=1), np.argmax(at_origin, axis=1) + 1, 0)
    length = size - at_origin.any(axis=1)
    column = np.arange(max(length.max(initial=0), 1))
    source = (cut[:, None] + column) % np.maximum(size, 1)[:, None]
    ring = np.where(column < length[:, None], np.take_along_axis(walk, source, axis=1), -1)
    return ring, closed
