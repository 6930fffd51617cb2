"""How the rings of a cloud and a mesh agree, and how their skeletons do, in numbers and as a verdict."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.spatial import cKDTree

from ..analysis.curves import distances
from ..interop.packages import require
from ..numerics.cotangent import cotangent_laplacian
from ..numerics.groups import component_labels
from ..report import REFUSED
from .mesh import COVERED_SHARE, INVENTED_DISTANCE, curvature_normals, mesh_areas, mesh_laplacian, ring_areas, spacing
from .mesh_rings import border_lengths, common_share, spokes, umbrellas

ANGLE_QUANTILES = {"median": 50, "p75": 75, "p90": 90}

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

AGREES, IN_PART, DISTRUST, UNTOLD = VERDICTS = "agrees", "agrees in part", "do not trust", "cannot tell"
MEANINGS = {
    AGREES: "as of clean, dense clouds; gaps that cloud and mesh share, as of scans from one or two sides, do not show",
    IN_PART: "usual with noise, even little: of 48 test clouds 44 had a good skeleton all the same; look at --labelled",
    DISTRUST: "rare, and a call to look at --labelled: of 12 test clouds 8 had a good skeleton all the same",
    UNTOLD: "usual with much noise or few points: no word against the skeleton; look at --labelled, or 'glsk evaluate'",
}
"""What to expect of each verdict; the numbers are measured, see docs/crosscheck.md."""


@dataclass(frozen=True)
class RowAgreement:
    """How the Laplacian coordinates of a cloud's rings agree with those of a mesh."""

    closed: int  # distinct points of the cloud whose ring closes
    compared: int  # closed rings at which the mesh has a closed umbrella as well
    covered: float  # the share of the closed ones that were compared
    one_to_one: bool  # vertices of the mesh are points of the cloud; else mean curvature normals were compared
    same_rings: float | None  # share of compared rings with the mesh's neighbours in its order; None unless one to one
    angle: dict[str, float]  # quantiles of the angle between ours and the mesh's, in degrees; 0 is best


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

    distance_in_radii: float  # mean to the nearest place on the other, of both directions, in local radii
    hausdorff95_in_radii: float  # 95 % quantile of the worse direction
    components: tuple[int, int]
    loops: tuple[int, int]


def compare_rows(state, vertices, faces):
    """Compare the Laplacian coordinates of a cloud, fresh from the ring builder, with those of a mesh in its frame.

    Rows are one to one if the vertices are `state.cloud` itself. Gives the angle at every distinct point, (m,) float
    array, 0 where both are flat and NaN where none is compared, and a RowAgreement.
    """
    points, rings = state.cloud, state.rings
    matrix, other = cotangent_laplacian(points, rings), mesh_laplacian(vertices, faces)
    size = -matrix.diagonal() * rings.mean_lengths(points)  # of Laplacian coordinates as long as the ring is wide
    one_to_one = vertices is points
    if one_to_one:
        ours, theirs = matrix @ points, other @ points
        there = umbrellas(len(points), faces)
    else:
        areas = ring_areas(points, rings)
        ours = curvature_normals(matrix, areas, points)
        normals = curvature_normals(other, mesh_areas(vertices, faces), vertices)
        normals[~umbrellas(len(vertices), faces)] = np.nan
        theirs, distance = _on_mesh(points, vertices, faces, normals)
        there = np.isfinite(theirs).all(axis=1) & (distance < INVENTED_DISTANCE * spacing(points))
        size = size / np.where(areas > 0, 2 * areas, np.inf)
    compared = rings.closed & there & np.isfinite(ours).all(axis=1)
    a, b = np.linalg.norm(ours, axis=1), np.linalg.norm(theirs, axis=1)
    flat = compared & (np.maximum(a, b) <= FLAT_LAPLACIAN * np.abs(size))
    with np.errstate(invalid="ignore", divide="ignore"):
        cosine = np.einsum("ij,ij->i", ours, theirs) / (a * b)
        angle = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    angle[flat], angle[~compared] = 0, np.nan
    n, n_closed, told = int(compared.sum()), int(rings.closed.sum()), angle[compared & ~flat]
    told = told[np.isfinite(told)]
    rows = RowAgreement(
        closed=n_closed,
        compared=n,
        covered=n / max(n_closed, 1),
        one_to_one=one_to_one,
        same_rings=float((common_share(rings, faces)[compared] == 1).mean()) if one_to_one and n else None,
        angle={name: float(np.percentile(told, at)) for name, at in ANGLE_QUANTILES.items()} if len(told) else {},
    )
    return angle, rows


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
    vertex, other, sides, fan = spokes(int(faces.max(initial=-1)) + 1, faces)
    if sides.max(initial=0) > 2:
        return None
    # each fan is a vertex: where fans touch in a vertex alone, the surface does not hang together
    edges = np.column_stack([fan, fan[np.lexsort((vertex, other))]])
    n, rim = int(fan.max(initial=-1)) + 1, edges[sides == 1]
    n_pieces = len(np.unique(component_labels(n, edges)))
    n_borders = len(np.unique(component_labels(n, rim)[rim]))
    return (2 * n_pieces - n_borders - (n - len(edges) // 2 + len(faces))) // 2


def _on_mesh(points, vertices, faces, values):
    """Values at the vertices, interpolated at the places on the mesh nearest to the points; and how far these are."""
    squared, face, place = require("igl").point_mesh_squared_distance(points, vertices, faces)
    arm = vertices[faces[face]] - place[:, None]
    weight = np.linalg.norm(np.cross(arm[:, [1, 2, 0]], arm[:, [2, 0, 1]]), axis=2)  # the area opposite to each corner
    weight /= weight.sum(axis=1, keepdims=True)
    return np.einsum("ni,nij->nj", weight, values[faces[face]]), np.sqrt(squared)


def compare_skeletons(ours, theirs, step):
    """How two skeletons agree, by places on both that are `step` apart."""
    both = [distances(*pair, step) for pair in ((ours, theirs), (theirs, ours))]
    in_radii = [distance / radius for distance, radius in both]
    return SkeletonAgreement(
        distance_in_radii=float(np.mean([each.mean() for each in in_radii])),
        hausdorff95_in_radii=float(max(np.percentile(each, 95) for each in in_radii)),
        components=(ours.n_components, theirs.n_components),
        loops=(ours.n_loops, theirs.n_loops),
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
