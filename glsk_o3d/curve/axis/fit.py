"""Fit the curve to the axis of the surface around it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.sparse import bsr_array, csc_array

from ...geometry.groups import group_sum
from ...geometry.neighbourhoods import nearest_neighbours
from ...geometry.numbers import derived, fitted, measured, precision
from ...geometry.polylines import incident_edges, nearest_on_edges, places_on_edges
from ...geometry.radii import plane_distance_radii, robust_radii
from ...geometry.solver import factorised
from ...geometry.vectors import COLUMNS, FULL, ROWS, TINY, Floats, Ints, box, cross, dot, norm, unit
from ..curve import Curve
from ..numbers import CURVE
from ..surface import Surface
from .sections import Sections, half_axes, normal_moments


@dataclass(frozen=True)
class FitNumbers:
    """Numbers of `fit_axis`."""

    diffusion: float = fitted(0.6, "length over which places are smoothed on the surface, over the half width")
    spread: float = fitted(2**0.5, "half width where normals say nothing, over that of the points")
    widest: float = fitted(10.0, "most half width over the spacing of the vertices, which may be in one place")
    centroid: float = fitted(0.5, "weight of the points themselves where their normals say nothing")
    open: float = derived(
        1 / 2 - 1 / np.pi, "share of the squared normals of a quarter of a tube that stand across the others"
    )
    sides: float = fitted(20.0, "weight of the sides of a flat section; 10 and 30 are as good")
    walk: int = measured(3, "vertices by which a point may move along the curve in a pass")
    beyond: float = derived(
        0.05, "how far out of the box of its points an axis may be, over the diagonal: they show a third of it"
    )
    half_tube: float = derived(
        (2 / np.pi) / np.sqrt(1 - (2 / np.pi) ** 2),
        "distance of the axis of half a tube from the mean of its points, over their scatter",
    )
    held: float = precision(1e-3, "share of the mean number of points that holds vertices without points")


FIT = FitNumbers()


def pull_back_detached(curve: Curve) -> Curve:
    """Pull vertices as near to the mean of their points as half a tube's axis is.

    Thin tips leave their points in late solves. A vertex without points stays.
    """
    cloud, m = curve.cloud, len(curve.vertices)
    count = np.maximum(cloud.count, 1)
    mean = group_sum(cloud.offset, cloud.vertex, m) / count[:, None]
    spread = group_sum((cloud.points - (curve.vertices + mean)[cloud.vertex]) ** 2, cloud.vertex, m).sum(axis=1)
    reach, away = FIT.half_tube * np.sqrt(spread / count), norm(mean)
    back = 1 - np.minimum(reach, away) / np.maximum(away, TINY)
    return curve.changed(vertices=curve.vertices + back[:, None] * mean)


def fit_axis(curve: Curve, passes: int, surface: Surface | None = None, settle: bool = False) -> Curve:
    r"""Move the vertices to the axis of the surface; measure how well the points say where it is, and how far it is.

    The plane through a point p of a limb, spanned by its normal n and the tangent t of the axis, contains the axis:
    with b = n x t and the place x(p) of the curve that p belongs to, b (x(p) - p) = 0. On a flat section the same sum
    of squares is least at the middle of the width. Each pass minimises, over all vertices at once,

    .. math:: \sum_p (b \cdot (x(p) - p))^2 + (x(p) - p)^T K (x(p) - p)
        + \sum_v c (|\Lambda (x_v - chord)|^2 + \epsilon |x_v - old|^2 + ((x_v - old) \cdot t)^2)

    with c points at a vertex. :math:`\Lambda` is :math:`(w / h)^2` with the half width w and the spacing h of the
    vertices, so that the curve does not bend within a half width. The nearest place of a wiggly curve has its wiggle:
    it is smoothed on the surface by .6 half widths, and x(p) is the place nearest to that.

    K is 0, since the axis of half a tube is off the centroid of its points, but where it is to `settle` a curve that
    was fitted before, whose half widths are known:

    .. math:: K = \mu d I_\perp + \max(1 - a / a_0, 0)\, e e^T

    The doubt d, from 0 to 1, is the share of the distance from the curve that the normals do not explain: noise as wide
    as the part, whose points say more than their normals. Of a leaf seen from one side the normals hardly differ, and
    meet far behind it: e is the direction most of them have, a the share of their squares across it, and a_0 that of a
    quarter of a tube. An edge has the mean K of its two ends, and of it what is across the edge. Then
    :math:`\Lambda` has the half thickness in place of w in its direction: a strap bends where it is thin. And where
    both sides of a flat section were seen, they say where the middle of its width is: the face of a plate that goes on
    into another bar says it wrongly. See `_middle`.

    The confidence is (1 - d) c / (c + 8), where c counts over the vertex and its neighbours; where the curve settles,
    at least that of a section with two flat sides, see `_flat_doubt`. The radii are those of circles with the area of
    the section, see `robust_radii`, or without passes `plane_distance_radii`. Points belong to the vertex nearest to
    their place.
    """
    m, ends = len(curve.vertices), curve.edges
    points, owner = curve.supporting_points, curve.vertex_of_point.copy()
    points = points[curve.degree[owner[points]] > 0]
    if len(points) == 0:
        radii = plane_distance_radii(curve.vertices, owner, curve.points, curve.normals, curve.radii)
        return curve.changed(confidence=np.zeros(m), radii=radii)
    centre = curve.vertices.mean(axis=0)
    x, p, n = curve.vertices - centre, curve.points[points] - centre, curve.normals.take(points, axis=0)
    vertex, edges_at = owner[points], incident_edges(ends, m)
    pattern = _Pattern(curve, edges_at)
    low, high = axis_box(p)
    onto = nearest_on_edges(x, ends, edges_at[vertex], p)
    if passes:
        surface = surface or Surface.of(curve)
        smooth = _smoother(surface, points, p)
        spacing = surface.spacing * np.sqrt(len(surface.points) / len(points))
        width = curve.half_width if settle else _nearest(x, ends, *onto, p, n, curve.radii).width
    for again in range(passes):
        onto = nearest_on_edges(x, ends, edges_at[vertex], p) if again else onto
        place = smooth(places_on_edges(x, ends, *onto), FIT.diffusion * width[vertex])
        vertex, edge, t = _walked(x, ends, edges_at, vertex, place)
        near = _nearest(x, ends, edge, t, p, n, curve.radii, sides=settle)
        x, width = _solve(x, near, p, pattern, settle), near.width
        # normals that mean nothing may meet anywhere
        x = np.where(curve.degree[:, None] > 0, np.clip(x, low, high), x)
    onto = nearest_on_edges(x, ends, edges_at[vertex], place) if passes else onto
    near = _nearest(x, ends, *onto, p, n, curve.radii, sides=settle)
    owner[points] = vertex
    radii = plane_distance_radii(x + centre, owner, curve.points, curve.normals, curve.radii)
    if passes:  # the distance from a curve that nobody has centred is no radius
        equal = np.where(near.support > 0, near.sections.radius, radii)
        radii = robust_radii(equal, norm(near.offset), near.doubt, n, vertex)
    doubt = np.minimum(near.doubt, _flat_doubt(near, spacing)) if passes and settle else near.doubt
    confidence = (1 - doubt) * near.support / (near.support + CURVE.half_support)
    fields = dict(vertices=x + centre, confidence=confidence, radii=radii, vertex_of_point=owner)
    return curve.changed(**fields, half_width=near.width, half_thickness=near.sections.half_thickness)


def _walked(
    x: np.ndarray, ends: np.ndarray, edges_at: np.ndarray, vertex: np.ndarray, place: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The vertex near each place, a few steps from the one it had; and the nearest edge there, and where on it."""
    vertex, going = vertex.copy(), np.arange(len(place))
    edge, t = nearest_on_edges(x, ends, edges_at[vertex], place)
    for _ in range(FIT.walk):  # only what got to another vertex is asked again
        ahead = ends[edge[going], (t[going] > 0.5).astype(int)]
        on = ahead != vertex[going]
        going = going[on]
        vertex[going] = ahead[on]
        edge[going], t[going] = nearest_on_edges(x, ends, edges_at[vertex[going]], place[going])
    return vertex, edge, t


def _smoother(surface: Surface, points: np.ndarray, p: np.ndarray) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
    """What smooths places of points on the surface, each over a length of its own.

    Points that the surface leaves out move as far as the one nearest to them.
    """
    diffusion, node = surface.diffusion, np.searchsorted(points, surface.supporting)
    node = np.minimum(node, len(points) - 1)
    has_place = points[node] == surface.supporting  # points of vertices without edges have no place
    nearest = np.arange(len(points))
    if has_place.sum() < len(points):
        nearest = node[has_place][nearest_neighbours(p[node[has_place]], 1, of=p)[1][:, 0]]
    start = surface.points + (p[node[:1]] - surface.points[:1])

    def smooth(place: Floats, length: np.ndarray) -> np.ndarray:
        values = np.where(has_place[:, None], place[node], start)
        moved = np.zeros_like(place)
        moved[node[has_place]] = (diffusion(values, np.where(has_place, length[node], 0)) - values)[has_place]
        return place + moved[nearest]

    return smooth


def axis_box(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest coordinates, (3,), that an axis of points, (n, 3) float array, n > 0, may have."""
    low, high = box(points)
    slack = FIT.beyond * np.linalg.norm(high - low)
    return low - slack, high + slack


class _Nearest(NamedTuple):
    """What the points are to the place of the curve nearest to them."""

    edge: np.ndarray
    share: np.ndarray  # of the edge's two ends in that place
    tangent: np.ndarray  # of every edge
    across: np.ndarray  # b
    offset: np.ndarray  # x(p) - p
    doubt: np.ndarray  # d, of every vertex
    support: np.ndarray  # points at every vertex and its neighbours
    sections: Sections  # at every vertex
    width: np.ndarray  # half of the section's, at every vertex
    faces: np.ndarray  # (m, 6) different entries of the sum of n n^T, at every vertex and its neighbours
    # (m, 12) that of outward normals n, of h n, and of h^2 n n^T, with h from the curve to the plane; or nothing
    outward: np.ndarray


def _nearest(
    x: Floats, ends: Ints, edge: Ints, t: Floats, p: Floats, n: Floats, radii: Floats, sides: bool = False
) -> _Nearest:
    """What every point is to a place of the curve; the radii are half axes in directions nobody saw."""
    share, tangent = np.column_stack([1 - t, t]), unit(x[ends[:, 1]] - x[ends[:, 0]])
    along = tangent.take(edge, axis=0)
    across, offset = cross(n, along), places_on_edges(x, ends, edge, t) - p
    miss, distance = dot(across, offset) ** 2, dot(offset, offset) - dot(offset, along) ** 2
    aside = offset - dot(offset, along)[:, None] * along
    moments = normal_moments(n, offset)
    facts = dict(miss=miss, distance=distance, half=np.full(len(p), 0.5), moments=moments)
    facts["products"] = aside[:, ROWS] * aside[:, COLUMNS]
    inward = dot(n, offset)[:, None]
    signed = [-np.sign(inward) * n, -inward * n, inward**2 * moments[:, :6]] if sides else [np.empty((len(p), 0))]
    facts["outward"] = np.column_stack(signed)
    sums = _around_every_vertex(facts, edge, ends, len(x))
    support, distance = sums["half"][:, 0], np.maximum(sums["distance"][:, 0], 0)  # rounded, a difference of squares
    sections = half_axes(sums["moments"], radii)
    # normals that point anywhere explain half of the distance; without points there is nothing but doubt
    explained = np.minimum(2 * sums["miss"][:, 0], distance) / np.maximum(distance, TINY)
    doubt = np.where(distance > 0, explained, 1)
    # normals of a sheet as thin as its points are apart say nothing of its width, and there is nothing but doubt
    spread = _spread_width(sums["products"] / np.maximum(2 * support, TINY)[:, None])
    width = sections.half_width + doubt * np.maximum(FIT.spread * spread - sections.half_width, 0)
    faces = sums["moments"][:, :6]
    return _Nearest(edge, share, tangent, across, offset, doubt, support, sections, width, faces, sums["outward"])


def _around_every_vertex(facts: dict[str, np.ndarray], edge: Ints, ends: Ints, m: int) -> dict[str, np.ndarray]:
    """Sums of facts of points on edges, over all edges at each vertex and at its neighbours, (m, columns) each."""
    columns = [values.reshape(len(edge), -1) for values in facts.values()]
    a, b = ends.T
    sums = group_sum(np.concatenate(columns, axis=1), edge, len(ends))
    sums = group_sum(np.concatenate([sums, sums]), np.concatenate([a, b]), m)
    sums = sums + group_sum(sums[np.concatenate([b, a])], np.concatenate([a, b]), m)
    stops = np.cumsum([values.shape[1] for values in columns])[:-1]
    return dict(zip(facts, np.split(sums, stops, axis=1), strict=True))


def _pull(near: _Nearest) -> np.ndarray:
    """K of `fit_axis` at every vertex, (m, 3, 3)."""
    share, axes = np.linalg.eigh(near.faces[:, FULL])
    across = share[:, 1] / np.maximum(share[:, 1:].sum(axis=1), TINY)
    face = np.maximum(1 - across / FIT.open, 0)[:, None] * axes[:, :, 2]
    pull: np.ndarray = FIT.centroid * near.doubt[:, None, None] * np.eye(3) + face[:, :, None] * axes[:, None, :, 2]
    return pull


def _middle(near: _Nearest) -> tuple[np.ndarray, np.ndarray]:
    r"""How firmly both sides of a flat section say where its middle is, and this times the way along e, (m,) both.

    With outward normals n, distances h of their planes from the curve, and the direction e and half width w of the
    width, the sides +e and -e have (c + r) / 2 and (c - r) / 2 normals, with :math:`c = \sum (n \cdot e)^2` and
    :math:`r = \sum n \cdot e`. Their planes are (w c + q) / (c + r) and (w c - q) / (c - r) away, where q is the sum of
    :math:`h\, n \cdot e`. Half the difference is the way to the middle, at most w. It counts by what both sides have,
    c - |r|, by how flat the section is, and by how even: by max(1 - v, 0)^2 for the variance v of h over w^2, more than
    1 where a thick part becomes a thin one, and by the same for the faces between the sides, more than 1 where noise is
    thicker than they.
    """
    width, thickness, across = near.sections
    odd, distant = dot(near.outward[:, :3], across), dot(near.outward[:, 3:6], across)
    flat = 1 - thickness / np.maximum(width, TINY)
    sums = _sides_and_faces(near)
    for half, (normals, squares) in zip((width, thickness), sums, strict=True):
        flat *= np.clip(2 - squares / np.maximum(np.maximum(half**2 * normals, squares / 2), TINY), 0, 1) ** 2
    seen = sums[0, 0]
    firm = flat * np.maximum(seen - np.abs(odd), 0)
    offset = flat * seen * (distant - width * odd) / np.maximum(seen + np.abs(odd), TINY)
    return firm, np.clip(offset, -firm * width, firm * width)


def _sides_and_faces(near: _Nearest) -> np.ndarray:
    """Sums of (n . e)^2 and of (h n . e)^2 in the direction of the width, and in that of the thickness, (2, 2, m)."""
    across = near.sections.across
    both = np.stack([near.faces, near.outward[:, 6:]])[:, :, FULL]
    of_sides = np.einsum("mi,kmij,mj->km", across, both, across)
    # rounding leaves less than nothing
    squared_sines: np.ndarray = np.maximum(np.stack([of_sides, np.trace(both, axis1=2, axis2=3) - of_sides]), 0)
    return squared_sines


def _flat_doubt(near: _Nearest, spacing: float) -> np.ndarray:
    r"""How little the points say of an axis in the middle of two sides, (m,): little doubt is left of a bar.

    The planes of both sides are as far from the axis as the half width w and the half thickness t. It is

    .. math:: 1 - (1 - \sigma^2)\, (1 - |R| / C)\, t^2 / (t^2 + \rho^2).

    :math:`\sigma^2` is the variance of their distances h around these, over :math:`w^2 + t^2`, and this over what
    normals that point anywhere have, :math:`\pi^2 / 16 - 1 / 2`. R is the sum of the outward normals and C that of
    their squares, both of what is across the width: how far one side has more of them. And two sides that are nearer to
    each other than two spacings :math:`\rho` of the points may be one, such as a table.
    """
    outward, (width, thickness, across) = near.outward[:, :3], near.sections
    (of_sides, seen), (squares_of_sides, squares) = _sides_and_faces(near).transpose(1, 0, 2)
    spread = squares_of_sides - width**2 * of_sides + squares - thickness**2 * seen
    random = (np.pi**2 / 16 - 1 / 2) * (of_sides + seen) * (width**2 + thickness**2)
    sure = 1 - np.clip(spread / np.maximum(random, TINY), 0, 1)
    odd = norm(outward - dot(outward, across)[:, None] * across)
    sure *= np.maximum(1 - odd / np.maximum(seen, TINY), 0)
    doubt: np.ndarray = 1 - sure * thickness**2 / np.maximum(thickness**2 + spacing**2, TINY)
    return doubt


def _spread_width(moments: np.ndarray) -> np.ndarray:
    r"""Half width of sections by their points: from second moments around the axis, (m, 6) float array.

    With the eigenvalues a >= b across the limb it is :math:`\sqrt{a (3 - b / a)}`: exact around a circle, where a = b =
    r^2 / 2, also for half of one, and on a flat strip, where a = w^2 / 3.
    """
    _, less, most = np.linalg.eigvalsh(moments[:, FULL]).T
    return np.sqrt(np.maximum(3 * most - np.clip(less, 0, most), 0))


def _solve(x: np.ndarray, near: _Nearest, p: np.ndarray, pattern: _Pattern, settle: bool) -> np.ndarray:
    """The minimum of the energy in `fit_axis`: one sparse, symmetric, positive definite system."""
    ends, inner, beside = pattern.ends, pattern.inner, pattern.beside
    m, e = len(x), len(ends)
    pull = _pull(near)[ends].mean(axis=1) if settle else np.zeros((e, 3, 3))
    along = near.tangent[:, :, None] * near.tangent[:, None]
    upright = np.eye(3) - along
    pull = upright @ pull @ upright
    # Of every point b b^T by its six different entries, and that it is there, once for each pair of ends of its edge;
    # and what they say of its place, and where and that it is there, once for each end.
    weight_of_point = np.ones(len(p))
    matrix = np.column_stack([near.across[:, ROWS] * near.across[:, COLUMNS], weight_of_point])
    target = np.column_stack([dot(near.across, p)[:, None] * near.across, p, weight_of_point])
    share, pairs = near.share, near.share[:, [0, 0, 1]] * near.share[:, [0, 1, 1]]
    at_pairs = group_sum(matrix, near.edge[:, None] + e * np.arange(3), 3 * e, pairs)
    at_ends = group_sum(target, near.edge[:, None] + e * np.arange(2), 2 * e, share)
    at_edges = at_pairs[:, FULL].reshape(3, e, 3, 3) + at_pairs[:, 6].reshape(3, e, 1, 1) * pull
    wanted = at_ends[:, :3] + np.einsum("eij,ej->ei", np.tile(pull, (2, 1, 1)), at_ends[:, 3:6])
    facts = np.column_stack([wanted, at_ends[:, 6], np.tile(along.reshape(e, 9), (2, 1))])
    facts = group_sum(facts, ends.T.ravel(), m)
    right, count = facts[:, :3], facts[:, 3]
    along = facts[:, 4:].reshape(m, 3, 3) / np.maximum(np.bincount(ends.ravel(), minlength=m), 1)[:, None, None]
    stay = (CURVE.stay * count + FIT.held * max(count.mean(), 1))[:, None, None] * np.eye(3) + count[
        :, None, None
    ] * along
    right = right + np.einsum("nij,nj->ni", stay, x)
    if settle:
        (firm, offset), across = _middle(near), near.sections.across
        stay = stay + FIT.sides * firm[:, None, None] * across[:, :, None] * across[:, None]
        right = right + FIT.sides * (firm * dot(across, x) + offset)[:, None] * across

    reach = np.linalg.norm(x[beside] - x[inner, None], axis=2)
    chord = reach[:, ::-1] / np.maximum(reach.sum(axis=1, keepdims=True), TINY)
    stencil = np.column_stack([np.ones(len(inner)), -chord])
    squared = np.maximum(reach.prod(axis=1), TINY)
    flat = near.sections.half_thickness / np.maximum(near.sections.half_width, TINY) if settle else np.ones(m)
    half = np.stack([near.width, near.width * flat])[:, inner]
    half = np.minimum(half**2, FIT.widest**2 * squared) / squared
    wide, thin = np.maximum(count[inner], 1) * half**2
    normal = unit(cross(x[beside[:, 1]] - x[beside[:, 0]], near.sections.across[inner]))
    stiff = wide[:, None, None] * np.eye(3) + (thin - wide)[:, None, None] * normal[:, :, None] * normal[:, None]
    bend = (stencil[:, :, None] * stencil[:, None])[..., None, None] * stiff[:, None, None]
    blocks = np.concatenate([at_edges[0], at_edges[1], at_edges[1], at_edges[2], stay, bend.reshape(-1, 3, 3)])
    return factorised(pattern.matrix(blocks)).solve(right.ravel()).reshape(m, 3)


class _Pattern:
    """Where the blocks of `_solve` stand in its system: for both ends of edges, vertices, and these with two beside."""

    def __init__(self, curve: Curve, edges_at: np.ndarray) -> None:
        m, self.ends, self.inner = len(curve.vertices), curve.edges, np.flatnonzero(curve.degree == 2)
        # the other end of either edge
        self.beside = self.ends[edges_at[self.inner, :2]].sum(axis=2) - self.inner[:, None]
        (a, b), every, stencil = self.ends.T, np.arange(m), np.column_stack([self.inner, self.beside])
        rows = np.concatenate([a, a, b, b, every, np.repeat(stencil, 3, axis=1).ravel()])
        columns = np.concatenate([a, b, a, b, every, np.tile(stencil, 3).ravel()])
        places, self._place = np.unique(rows * m + columns, return_inverse=True)
        self._columns = places % m
        self._starts = np.searchsorted(places, m * np.arange(m + 1))

    def matrix(self, blocks: np.ndarray) -> csc_array:
        """The symmetric matrix that has the sum of the blocks, (b, 3, 3), in every place."""
        summed = group_sum(blocks, self._place, len(self._columns))
        rows = bsr_array((summed, self._columns, self._starts)).tocsr()
        return csc_array((rows.data, rows.indices, rows.indptr), shape=rows.shape)
