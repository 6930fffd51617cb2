"""The Delaunay star of many points at once, by gift wrapping inverted neighbours."""

import numpy as np

COINCIDENT_SQUARED = 1e-300  # derived: squared distance below which a neighbour counts as the origin itself
COLLINEAR_SINE = 1e-12  # derived: sine below which two directions count as one


def delaunay_star(offsets: np.ndarray, valid: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Ring of the origin in the 2-D Delaunay triangulation of the origin and its neighbours, for many origins.

    `offsets` (n, k, 2) lead from each origin to its neighbours, of which those that are `valid` (n, k) and do not
    coincide with it are used. The rings are (n, r) positions in counter-clockwise order, padded with -1; a closed one
    starts at the nearest neighbour. An origin on the hull of its neighbours is a border point, and its ring an open fan
    from its first border neighbour to its last. Also returned is which rings close, (n,) bool.

    Of several neighbours on one empty circle through the origin the two outer ones are kept, so that the diagonals of a
    square grid are no ring edges. Collinear neighbourhoods give the nearest neighbour on each side as a fan. Of
    coincident neighbours one is kept.
    """
    # Strategy: inversion about the origin, q = x / |x|^2, turns circles through it into lines (Brown 1979, "Voronoi
    # diagrams from convex hulls"). A neighbour shares a Delaunay edge with the origin exactly when its image is a
    # corner of the convex hull of the images and of the origin, which stands for infinity: a ring is closed if the
    # origin is inside, and else opens where the walk around the hull meets it. Gift wrapping (Jarvis 1973) walks all
    # hulls in step, one corner at a time, and drops those that are done. The plane is that of the complex numbers.
    offsets = np.asarray(offsets, float)
    if offsets.shape[1] == 0:
        return np.empty((len(offsets), 0), int), np.zeros(len(offsets), bool)
    n, k = offsets.shape[:2]
    x, y = offsets[..., 0], offsets[..., 1]
    squared = x * x + y * y
    usable = squared > COINCIDENT_SQUARED
    if valid is not None:
        usable &= valid
    inverse = np.divide(1.0, squared, out=np.zeros_like(squared), where=usable)
    q = np.zeros((n, k + 1), complex)  # column k is the origin
    np.multiply(x, inverse, out=q.real[:, :k])
    np.multiply(y, inverse, out=q.imag[:, :k])
    q[:, :k][~usable] = np.nan  # on no line
    walk = np.full((n, k + 2), -1)
    walk[:, 0] = start = np.argmax(inverse, axis=1)
    rows = np.flatnonzero(usable.any(axis=1))
    q, first = q[rows], start[rows]
    passed, corner, line = np.zeros(q.shape), first, np.arange(len(rows))
    # The farthest image is a hull corner; everything lies to the left of its tangent.
    ahead = 1j * q[line, corner]
    widest = 2 * np.abs(ahead)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        direction, turn = _seen(q, line, corner, ahead)
        for step in range(1, k + 2):
            passed[line, first] = 0
            passed[line, corner] = -np.inf
            # The cotangent of the turn: falls on ]0, pi[, and is exact for small turns. 0 / 0 is at the corner itself.
            cotangent = turn.real / np.maximum(turn.imag, 0) + passed
            best = np.argmax(np.fmax(cotangent, -np.inf), axis=1)
            best = np.where(cotangent[line, best] > -np.inf, best, first)  # straight back, along a line
            ahead = direction[line, best]
            onward, turn = _seen(q, line, best, ahead)
            beside = np.abs(turn.imag) <= (COLLINEAR_SINE * widest * np.abs(ahead))[:, None]
            if np.count_nonzero(beside) > 2 * len(line):  # more than this corner and the next
                several = np.flatnonzero(beside.sum(axis=1) > 2)
                best[several] = _farthest(direction[several], passed[several] == 0, best[several])
                ahead = direction[line, best]
                onward[several], turn[several] = _seen(q[several], line[: len(several)], best[several], ahead[several])
            going = best != first
            if not going.any():
                break
            if not going.all():
                kept = np.flatnonzero(going)
                rows, first, best, widest, line = *(a[kept] for a in (rows, first, best, widest)), line[: len(kept)]
                q, passed, onward, turn = (a.take(kept, axis=0) for a in (q, passed, onward, turn))
            walk[rows, step] = corner = best
            direction = onward

    # Cut the walk at the origin, where it meets it.
    size = np.where(usable.any(axis=1), (walk >= 0).sum(axis=1), 0)
    meets = (walk == k).any(axis=1)
    cut = np.where(meets, np.argmax(walk == k, axis=1) + 1, 0)
    length = size - meets
    column = np.arange(max(length.max(initial=0), 1))
    source = (cut[:, None] + column) % np.maximum(size, 1)[:, None]
    ring = np.where(column < length[:, None], np.take_along_axis(walk, source, axis=1), -1)
    return ring, ~meets & (size > 2)


def _seen(q: np.ndarray, line: np.ndarray, corner: np.ndarray, ahead: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Directions of the images from the corner where each walk is, and the same relative to the direction before."""
    direction = q - q[line, corner][:, None]
    return direction, direction * ahead.conj()[:, None]


def _farthest(direction: np.ndarray, usable: np.ndarray, best: np.ndarray) -> np.ndarray:
    """Among the images on one hull edge with the best one, the farthest; but never step over the origin."""
    line, length = np.arange(len(best)), np.abs(direction)
    turn = direction * direction[line, best].conj()[:, None]
    same = np.abs(turn.imag) <= COLLINEAR_SINE * length[line, best][:, None] * length
    reach = np.where(same & usable & (turn.real > 0), length, -1.0)
    reach[:, -1][reach[:, -1] > 0] = np.inf
    return np.argmax(reach, axis=1)
