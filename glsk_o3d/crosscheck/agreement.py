"""How the rings of a cloud and a mesh agree, and how their skeletons do."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.spatial import cKDTree

from ..analysis.curves import distances
from ..interop.packages import require
from ..numerics.components import component_labels
from ..numerics.cotangent import cotangent_laplacian
from ..numerics.mesh_rings import border_lengths, common_share, umbrellas
from .mesh_contraction import curvature_normals, mesh_areas, mesh_laplacian, ring_areas
from .reconstruction import INVENTED_DISTANCE, spacing

# All fitted.
FLAT_LAPLACIAN = 1e-3  # of the ring's size: smaller Laplacian coordinates have no direction
TEAR_EDGES = 12  # edges of a border: ball pivoting leaves shorter ones everywhere
MOST_BORDER = 0.05  # share of vertices on borders: half a ring is a strip with one border or two, closed it has no hole
COMPARISON_STEP = 0.002  # of the diagonal: spacing of the places where skeletons are compared


@dataclass(frozen=True)
class RowAgreement:
    """How the Laplacian coordinates of a cloud's rings agree with those of a mesh.

    Attributes
    ----------
    rows, closed : int
        Distinct points of the cloud, and those of them whose ring closes.
    compared : int
        Closed rings at which the mesh has a closed umbrella as well.
    covered : float
        The share `compared` of `closed`.
    one_to_one : bool
        Whether vertices of the mesh are points of the cloud, so that rows of the two matrices were compared. Otherwise
        mean curvature normals were: ours, and the mesh's interpolated at the nearest place on it.
    same_rings : float or None
        Share of the compared rings that are the mesh's one-rings: the same neighbours in the same cyclic order. None
        without `one_to_one`, as the next.
    common_triangles : float or None
        Mean over the compared rings of the triangles in both over those in either.
    flat : float
        Share of the compared rows that are flat in both, and so have no direction.
    angle : dict of str to float
        Quantiles over the compared rows of the angle between the two, in degrees; 0 is best.
    length : dict of str to float
        Quantiles of our length over the mesh's; 1 is best.
    """

    rows: int
    closed: int
    compared: int
    covered: float
    one_to_one: bool
    same_rings: float | None
    common_triangles: float | None
    flat: float
    angle: dict[str, float]
    length: dict[str, float]


@dataclass(frozen=True)
class MeshFit:
    """How well a mesh describes a cloud.

    Attributes
    ----------
    far : float
        Share of the cloud's points that lie more than a point spacing from the mesh.
    open : float
        Share of the mesh's vertices on a border of more than 12 edges, less that of the cloud's points whose rings do
        not close: above 0 the mesh has holes where the cloud has none.
    pieces, parts : int
        Into how many pieces the mesh falls, and the cloud, where no ring has an edge longer than three spacings.
    torn : float
        Share of the mesh's vertices that are not in the largest piece of the mesh on their part of the cloud: crumbs
        count for little, and parts of the cloud that are apart for nothing.
    genus : int or None
        Holes that pass through the mesh, its borders closed; None where a twentieth of its vertices lie on borders of
        more than 12 edges, or three faces share an edge.
    """

    far: float
    open: float
    pieces: int
    parts: int
    torn: float
    genus: int | None


@dataclass(frozen=True)
class SkeletonAgreement:
    """How the skeleton of a cloud and that of a mesh agree.

    Attributes
    ----------
    distance, distance_in_radii : float
        Mean distance from one to the nearest place on the other, the mean of both directions: as a share of the
        diagonal that lengths in percent refer to, and in local radii (the mean of the two skeletons' at these places).
    hausdorff95, hausdorff95_in_radii : float
        The 95 % quantile of these distances, of the worse direction.
    components, loops, leaves : (int, int)
        Of the cloud's and of the mesh's.
    """

    distance: float
    distance_in_radii: float
    hausdorff95: float
    hausdorff95_in_radii: float
    components: tuple[int, int]
    loops: tuple[int, int]
    leaves: tuple[int, int]

    @property
    def topology(self) -> bool:
        """Whether components and loops agree."""
        return self.components[0] == self.components[1] and self.loops[0] == self.loops[1]


def compare_rows(state, vertices, faces):
    """Compare the Laplacian coordinates of a cloud with those of a mesh, row by row.

    Parameters
    ----------
    state : Contraction
        Fresh from the ring builder.
    vertices : (V, 3) float array
        In its frame; rows are one to one if this is `state.cloud` itself.
    faces : (F, 3) int array

    Returns
    -------
    angle, length, share : (m,) float array
        As in `CrossCheck`, but of the distinct points.
    rows : RowAgreement
    """
    points, rings = state.cloud, state.rings
    matrix, other = cotangent_laplacian(points, rings), mesh_laplacian(vertices, faces)
    size = -matrix.diagonal() * rings.mean_lengths(points)  # of Laplacian coordinates as long as the ring is wide
    one_to_one = vertices is points
    if one_to_one:
        ours, theirs = matrix @ points, other @ points
        there = umbrellas(len(points), faces)
        share = common_share(rings, faces)
    else:
        areas = ring_areas(points, rings)
        ours = curvature_normals(matrix, areas, points)
        normals = curvature_normals(other, mesh_areas(vertices, faces), vertices)
        normals[~umbrellas(len(vertices), faces)] = np.nan
        theirs, distance = _on_mesh(points, vertices, faces, normals)
        there = np.isfinite(theirs).all(axis=1) & (distance < INVENTED_DISTANCE * spacing(points))
        share = np.full(len(points), np.nan)
        size = size / np.where(areas > 0, 2 * areas, np.inf)
    compared = rings.closed & there & np.isfinite(ours).all(axis=1)
    a, b = np.linalg.norm(ours, axis=1), np.linalg.norm(theirs, axis=1)
    flat = compared & (np.maximum(a, b) <= FLAT_LAPLACIAN * np.abs(size))
    with np.errstate(invalid="ignore", divide="ignore"):
        cosine = np.einsum("ij,ij->i", ours, theirs) / (a * b)
        angle, length = np.degrees(np.arccos(np.clip(cosine, -1, 1))), a / b
    angle[flat], length[flat] = 0, 1
    angle[~compared] = length[~compared] = np.nan
    n = int(compared.sum())
    rows = RowAgreement(
        rows=len(points),
        closed=int(rings.closed.sum()),
        compared=n,
        covered=n / max(int(rings.closed.sum()), 1),
        one_to_one=one_to_one,
        same_rings=float((share[compared] == 1).mean()) if one_to_one and n else None,
        common_triangles=float(share[compared].mean()) if one_to_one and n else None,
        flat=float(flat.sum() / max(n, 1)),
        angle=_quantiles(angle[compared & ~flat], {"median": 50, "p75": 75, "p90": 90}),
        length=_quantiles(length[compared & ~flat], {"p10": 10, "median": 50, "p90": 90}),
    )
    return angle, length, share, rows


def mesh_fit(state, vertices, faces):
    """How well a mesh, its faces as from `clean_faces` and its vertices in the frame, describes a cloud.

    The state is fresh from the ring builder.
    """
    points, rings, step = state.cloud, state.rings, spacing(state.cloud)
    squared = require("igl", "libigl").point_mesh_squared_distance(points, vertices, faces)[0]
    used = np.unique(faces)
    border = border_lengths(len(vertices), faces)[used] > TEAR_EDGES
    piece = component_labels(len(vertices), np.concatenate([faces[:, :2], faces[:, 1:]]))[used]
    edges = np.column_stack([rings.centres, rings.indices])
    near = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1) < INVENTED_DISTANCE * step
    part = component_labels(len(points), edges[near])
    on = part[cKDTree(points).query(vertices[used])[1]]
    shared = coo_array((np.ones(len(used), int), (on, piece))).tocsr()  # vertices of each piece on each part
    return MeshFit(
        far=float((squared > step**2).mean()),
        open=float(border.mean() - (~rings.closed).mean()),
        pieces=len(np.unique(piece)),
        parts=int(part.max()) + 1,
        torn=float(1 - shared.max(axis=1).sum() / len(used)),
        genus=_genus(faces) if border.mean() <= MOST_BORDER else None,
    )


def _genus(faces):
    """Holes that pass through a mesh, by its Euler characteristic with a disc in each border; None if it has none."""
    n = len(faces)
    corner = np.arange(3 * n).reshape(n, 3)
    ends = np.stack([corner, np.roll(corner, -1, axis=1)], axis=2).reshape(-1, 2)  # of every side
    vertices = faces.ravel()[ends]
    turned = vertices[:, 0] > vertices[:, 1]
    ends[turned], vertices[turned] = ends[turned, ::-1], vertices[turned, ::-1]
    edge = np.unique(vertices, axis=0, return_inverse=True)[1].ravel()
    sides = np.bincount(edge)
    if sides.max(initial=0) > 2:
        return None
    by_edge = np.argsort(edge, kind="stable")
    pairs = by_edge[sides[edge[by_edge]] == 2].reshape(-1, 2)
    # corners in one fan around a vertex are one: where fans touch in a vertex alone, the surface does not hang together
    fan = component_labels(3 * n, ends[pairs].transpose(0, 2, 1).reshape(-1, 2))
    at, border = np.unique(fan[ends[sides[edge] == 1]], return_inverse=True)
    borders = int(component_labels(len(at), border.reshape(-1, 2)).max(initial=-1)) + 1
    points = int(fan.max(initial=-1)) + 1
    pieces = int(component_labels(points, fan[ends]).max(initial=-1)) + 1
    euler = points - len(sides) + n
    return (2 * pieces - borders - euler) // 2


def _on_mesh(points, vertices, faces, values):
    """Values at the vertices, interpolated at the places on the mesh nearest to the points; and how far these are."""
    squared, face, place = require("igl", "libigl").point_mesh_squared_distance(points, vertices, faces)
    corner = vertices[faces[face]]
    weight = np.stack(
        [
            np.linalg.norm(np.cross(corner[:, i - 2] - place, corner[:, i - 1] - place), axis=1)
            for i in range(3)  # the area opposite to each corner
        ],
        axis=1,
    )
    weight /= weight.sum(axis=1, keepdims=True)
    return np.einsum("ni,nij->nj", weight, values[faces[face]]), np.sqrt(squared)


def _quantiles(values, which):
    values = values[np.isfinite(values)]
    return {name: float(np.percentile(values, at)) for name, at in which.items()} if len(values) else {}


def compare_skeletons(ours, theirs, diagonal):
    """How two skeletons agree, in a cloud with this diagonal in their units."""
    step = COMPARISON_STEP * diagonal
    both = [distances(ours, theirs, step), distances(theirs, ours, step)]
    return SkeletonAgreement(
        distance=float(np.mean([distance.mean() for distance, _ in both]) / diagonal),
        distance_in_radii=float(np.mean([(distance / radius).mean() for distance, radius in both])),
        hausdorff95=float(max(np.percentile(distance, 95) for distance, _ in both) / diagonal),
        hausdorff95_in_radii=float(max(np.percentile(distance / radius, 95) for distance, radius in both)),
        components=(ours.n_components, theirs.n_components),
        loops=(ours.n_loops, theirs.n_loops),
        leaves=(len(ours.leaves), len(theirs.leaves)),
    )
