"""How the rings of a cloud and a mesh agree, and how their skeletons do, in numbers and as a verdict."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.spatial import cKDTree

from ..analysis.curves import distances
from ..interop.packages import require
from ..numerics.cotangent import cotangent_laplacian
from ..numerics.groups import component_labels
from ..numerics.mesh_rings import border_lengths, common_share, umbrellas
from ..report import REFUSED
from .mesh import COVERED_SHARE, INVENTED_DISTANCE, curvature_normals, mesh_areas, mesh_laplacian, ring_areas, spacing

# All fitted.
FLAT_LAPLACIAN = 1e-3  # of the ring's size: smaller Laplacian coordinates have no direction
TEAR_EDGES = 12  # edges of a border: ball pivoting leaves shorter ones everywhere
MOST_BORDER = 0.05  # share of vertices on borders: half a ring is a strip with one border or two, closed it has no hole
COMPARISON_STEP = 0.002  # of the diagonal: spacing of the places where skeletons are compared

# All measured: what separates clean, dense samples of known shapes from sparse and noisy ones; see docs/crosscheck.md.
TURNED_ANGLE = 30.0  # degrees
NEAR_RADII, FAR_RADII = 0.2, 0.5  # mean distance, in local radii
HAUSDORFF_RADII = 1.0  # local radii, in 95 % of the length
FAULTY_SHARE = 0.05  # of the cloud far from the mesh, or of the mesh torn off or on borders that the cloud has not
GAPLESS_SHARE = 0.99  # of the rings, that close where the cloud has no gaps

AGREES, IN_PART, DISTRUST, UNTOLD = VERDICTS = "agrees", "agrees in part", "do not trust", "cannot tell"
MEANINGS = {
    AGREES: "as of clean, dense clouds; gaps that cloud and mesh share, as of scans from one or two sides, do not show",
    IN_PART: "usual with noise, even little: of 48 test clouds 44 had a good skeleton all the same; look at --picture",
    DISTRUST: "rare, and a call to look at --picture: of 12 test clouds 8 had a good skeleton all the same",
    UNTOLD: "usual with much noise or few points: no word against the skeleton; look at --picture, or 'glsk evaluate'",
}
"""What to expect of each verdict; the numbers are measured, see docs/crosscheck.md."""


@dataclass(frozen=True)
class RowAgreement:
    """How the Laplacian coordinates of a cloud's rings agree with those of a mesh."""

    rows: int  # distinct points of the cloud
    closed: int  # those of them whose ring closes
    compared: int  # closed rings at which the mesh has a closed umbrella as well
    covered: float  # the share of the closed ones that were compared
    one_to_one: bool  # vertices of the mesh are points of the cloud; else mean curvature normals were compared
    same_rings: float | None  # share of compared rings with the mesh's neighbours in its order; None unless one to one
    common_triangles: float | None  # mean of the triangles in ring and mesh over those in either; None as above
    flat: float  # share of the compared rows that are flat in both, and so have no direction
    angle: dict[str, float]  # quantiles of the angle between ours and the mesh's, in degrees; 0 is best
    length: dict[str, float]  # quantiles of our length over the mesh's; 1 is best


@dataclass(frozen=True)
class MeshFit:
    """How well a mesh describes a cloud."""

    far: float  # share of the points that lie more than a point spacing from the mesh
    open: float  # share of the mesh's vertices on long borders, less that of the points whose rings do not close
    pieces: int  # that the mesh falls into
    parts: int  # that the cloud falls into, by ring edges of at most three spacings
    torn: float  # share of the mesh's vertices outside the largest piece on their part of the cloud
    genus: int | None  # holes through the mesh, its borders closed; None with much border or three faces at an edge


@dataclass(frozen=True)
class SkeletonAgreement:
    """How the skeletons of a cloud and of a mesh agree; pairs are the cloud's and the mesh's."""

    distance: float  # mean to the nearest place on the other, of both directions, over the diagonal
    distance_in_radii: float  # the same in local radii
    hausdorff95: float  # 95 % quantile of the worse direction, over the diagonal
    hausdorff95_in_radii: float
    components: tuple[int, int]
    loops: tuple[int, int]
    leaves: tuple[int, int]

    @property
    def topology(self) -> bool:
        """Whether components and loops agree."""
        return self.components[0] == self.components[1] and self.loops[0] == self.loops[1]


def compare_rows(state, vertices, faces):
    """Compare the Laplacian coordinates of a cloud, fresh from the ring builder, with those of a mesh in its frame.

    Rows are one to one if the vertices are `state.cloud` itself. Gives for every distinct point the angle, the ratio of
    lengths and the share of common triangles, (3, m) float array, and a RowAgreement.
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
    n, n_closed = int(compared.sum()), int(rings.closed.sum())
    same = share[compared] if one_to_one and n else None
    rows = RowAgreement(
        rows=len(points),
        closed=n_closed,
        compared=n,
        covered=n / max(n_closed, 1),
        one_to_one=one_to_one,
        same_rings=None if same is None else float((same == 1).mean()),
        common_triangles=None if same is None else float(same.mean()),
        flat=float(flat.sum() / max(n, 1)),
        angle=_quantiles(angle[compared & ~flat], median=50, p75=75, p90=90),
        length=_quantiles(length[compared & ~flat], p10=10, median=50, p90=90),
    )
    return np.array([angle, length, share]), rows


def mesh_fit(state, vertices, faces):
    """How well a mesh, its faces as from `clean_faces` and its vertices in the frame, describes a cloud.

    The state is fresh from the ring builder.
    """
    points, rings, step = state.cloud, state.rings, spacing(state.cloud)
    squared = require("igl").point_mesh_squared_distance(points, vertices, faces)[0]
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
    corner = np.arange(faces.size).reshape(-1, 3)
    ends = np.concatenate([corner[:, side] for side in ([0, 1], [1, 2], [2, 0])])
    ends = np.take_along_axis(ends, np.argsort(faces.ravel()[ends], axis=1), axis=1)  # from the lower vertex
    edge, sides = np.unique(faces.ravel()[ends], axis=0, return_inverse=True, return_counts=True)[1:]
    edge = edge.ravel()
    if sides.max(initial=0) > 2:
        return None
    by_edge = np.argsort(edge, kind="stable")
    pairs = by_edge[sides[edge[by_edge]] == 2].reshape(-1, 2)
    # corners in one fan around a vertex are one: where fans touch in a vertex alone, the surface does not hang together
    fan = component_labels(faces.size, ends[pairs].transpose(0, 2, 1).reshape(-1, 2))
    n_vertices = int(fan.max(initial=-1)) + 1
    n_pieces = len(np.unique(component_labels(n_vertices, fan[ends])))
    rim = fan[ends[sides[edge] == 1]]
    n_borders = len(np.unique(component_labels(n_vertices, rim)[rim]))
    return (2 * n_pieces - n_borders - (n_vertices - len(sides) + len(faces))) // 2


def _on_mesh(points, vertices, faces, values):
    """Values at the vertices, interpolated at the places on the mesh nearest to the points; and how far these are."""
    squared, face, place = require("igl").point_mesh_squared_distance(points, vertices, faces)
    arm = vertices[faces[face]] - place[:, None]
    weight = np.linalg.norm(np.cross(arm[:, [1, 2, 0]], arm[:, [2, 0, 1]]), axis=2)  # the area opposite to each corner
    weight /= weight.sum(axis=1, keepdims=True)
    return np.einsum("ni,nij->nj", weight, values[faces[face]]), np.sqrt(squared)


def _quantiles(values, **which):
    values = values[np.isfinite(values)]
    return {name: float(np.percentile(values, at)) for name, at in which.items()} if len(values) else {}


def compare_skeletons(ours, theirs, diagonal):
    """How two skeletons agree, in a cloud with this diagonal in their units."""
    both = [distances(a, b, COMPARISON_STEP * diagonal) for a, b in ((ours, theirs), (theirs, ours))]
    apart, in_radii = [distance for distance, _ in both], [distance / radius for distance, radius in both]
    return SkeletonAgreement(
        distance=float(np.mean([each.mean() for each in apart]) / diagonal),
        distance_in_radii=float(np.mean([each.mean() for each in in_radii])),
        hausdorff95=float(max(np.percentile(each, 95) for each in apart) / diagonal),
        hausdorff95_in_radii=float(max(np.percentile(each, 95) for each in in_radii)),
        components=(ours.n_components, theirs.n_components),
        loops=(ours.n_loops, theirs.n_loops),
        leaves=(len(ours.leaves), len(theirs.leaves)),
    )


def judge(rows, skeletons, fit, warned, mesh_report):
    """The verdict on a cloud, as docs/crosscheck.md has it, and a tuple of what speaks against a better one.

    `warned` is what the cloud's own run warns of, `mesh_report` the report of the mesh's.
    """
    failed, grave, slight = [], [], []  # the mesh is at fault; against trust; against agreement
    if REFUSED in mesh_report.stop_reason:
        failed.append(f"the mesh's own contraction failed: {mesh_report.stop_reason}")  # it explains the others
    for name in ("components", "loops"):
        ours, theirs = getattr(skeletons, name)
        if ours != theirs:
            grave.append(f"{name}: {ours} in the skeleton of the cloud, {theirs} in that of the mesh")
    apart, hausdorff, loops = skeletons.distance_in_radii, skeletons.hausdorff95_in_radii, skeletons.loops[0]
    if apart > NEAR_RADII:
        (grave if apart > FAR_RADII else slight).append(f"the skeletons lie {apart:.2f} local radii apart on average")
    if hausdorff > HAUSDORFF_RADII:
        slight.append(f"5 % of a skeleton are more than {hausdorff:.1f} local radii from the other")
    if fit.genus not in (None, loops):
        slight.append(f"holes: {fit.genus} pass through the mesh, and the skeleton of the cloud has {loops} loops")
    turned = rows.angle and rows.angle["p75"] > TURNED_ANGLE
    if slight or apart > FAR_RADII:
        agree = rows.one_to_one and rows.covered >= COVERED_SHARE and not turned
        if agree and rows.closed >= GAPLESS_SHARE * rows.rows and skeletons.topology and not failed:
            slight.append("the rings agree: it is the shape, not the sampling; in a blob a curve may run anywhere")
    if not rows.compared:
        failed.append("no Laplacian coordinates could be compared")
    elif rows.covered < COVERED_SHARE:
        told = f"the mesh closes around {rows.covered:.0%} of the points whose rings close"
        (failed if grave else slight).append(told)
    if turned:
        slight.append(f"a quarter of the Laplacian coordinates are turned by more than {rows.angle['p75']:.0f} degrees")
    slight += [f"the run itself warns: {message}" for message in warned]
    slight += [f"the mesh's run warns: {message}" for message in mesh_report.warnings if message not in warned]
    if grave:
        failed += [f"the mesh does not describe the cloud: {fault}" for fault in _faults(fit, skeletons, len(grave))]
    reasons = (*failed, *grave, *slight)
    if failed and (grave or not rows.compared):
        return UNTOLD, reasons
    return DISTRUST if grave else IN_PART if reasons else AGREES, reasons


def _faults(fit, skeletons, n_grave):
    """Why a mesh does not describe the cloud."""
    for share, words in (
        (fit.far, "of the points lie more than a point spacing off it"),
        (fit.open, "of it are at holes that the cloud has not"),
        (fit.torn, "of it are torn off where the cloud holds together"),
    ):
        if share > FAULTY_SHARE:
            yield f"{share:.0%} {words}"
    ours, theirs = skeletons.components
    if n_grave == 1 and 0 < theirs - ours <= fit.pieces - fit.parts:  # crumbs explain this, and nothing else
        yield f"{fit.pieces} pieces of it, {fit.parts} of the cloud"
