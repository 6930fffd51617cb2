"""The surface of a solid: which of its holes contraction has shut, and the curve on its medial axis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..data.contraction import Contraction
from ..errors import InvalidCloudError
from ..geometry.groups import component_labels, group_sum
from ..geometry.inscribed_balls import outward_normals
from ..geometry.medial_axis import Burnt, MedialAxis, medial_curve, without_waves
from ..geometry.neighbourhoods import nearest_neighbours, spacing, uprightness
from ..geometry.numbers import fitted
from ..geometry.vectors import TINY, dot, norm
from ..geometry.winding import AREA_NEIGHBOURS, point_areas
from ..interop.poisson import inside_of, poisson_mesh
from .numbers import CURVE


@dataclass(frozen=True)
class ClosedNumbers:
    """Numbers of closed surfaces."""

    open: float = fitted(0.03, "length of the sum of all normals over their area, from which a surface is not closed")
    turned: float = fitted(0.015, "share of flat links between opposite normals, from which signs are wrong")
    noisy: float = fitted(0.3, "mean share of noise from which so many are turned, and with less of it fewer")
    least_turned: float = fitted(0.1, "share of them without noise")
    enough: int = fitted(
        2000, "points from which a patch is seen; in fewer it must be larger, as contraction oversteps"
    )
    most_shut: float = fitted(0.2, "share of it facing from which the solid must confirm: signs may be wrong")


CLOSED = ClosedNumbers()
CELL_SIZES = (1.0, 1.4, 0.7)  # measured: of a reconstruction, in those of the first


class MedialGraph(NamedTuple):
    """A curve on a medial axis."""

    places: np.ndarray  # (p, 3)
    radii: np.ndarray  # (p,) of the balls inscribed there before the curve was smoothed
    edges: np.ndarray  # (e, 2)
    genus: int  # of the surface: handles of the solid

    @property
    def is_sound(self) -> bool:
        """Whether it has as many loops as the surface has handles."""
        return self.n_loops == self.genus

    @property
    def n_loops(self) -> int:
        """The cycle rank."""
        return len(self.edges) - len(self.places) + components(len(self.places), self.edges)

    def merged(self, group: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Groups (p,) parted where edges do not join them, so that loops stay: those of the places, and edges."""
        same = group[self.edges[:, 0]] == group[self.edges[:, 1]]
        part = component_labels(len(self.places), self.edges[same])
        ends = np.sort(part[self.edges[~same]], axis=1)
        return part, np.unique(ends, axis=0)

    @classmethod
    def of(cls, points: np.ndarray, outward: np.ndarray) -> MedialGraph:
        """That of the closed surface through points (n, 3); the largest ball where the axis burns down to one place.

        Where it has other loops than the surface, as tetrahedra cross that at sharp edges, a coarser and a finer one is
        tried. InvalidCloudError where no surface goes through the points.
        """
        apart = spacing(points)
        graphs = (cls._of(poisson_mesh(points, outward, cell * apart)) for cell in CELL_SIZES)
        first = next(graphs)
        return first if first.is_sound else next((other for other in graphs if other.is_sound), first)

    @classmethod
    def _of(cls, mesh: Any) -> MedialGraph:
        vertices, triangles = np.asarray(mesh.vertices), np.asarray(mesh.triangles)
        axis = MedialAxis.of(vertices, inside_of(mesh))
        if len(axis.places) == 0:
            raise InvalidCloudError(f"a surface with {len(vertices)} vertices has no inside")
        if (burnt := Burnt.of(axis)).has_sheets:
            raise InvalidCloudError("the solid has a cavity: sheets around it are no curve")
        curve, half_widths = medial_curve(axis, burnt, vertices)
        used, edges = np.unique(curve, return_inverse=True)
        edges, handles = edges.reshape(-1, 2), genus(len(vertices), triangles)
        if len(curve) == 0:
            used = np.array([axis.radii.argmax()])
            return cls(axis.places[used], axis.radii[used], edges, handles)
        places = without_waves(axis.places[used], edges, 2 * half_widths[used])  # fire from two sides meets in zigzags
        return cls(places, axis.radii[used], edges, handles)


@dataclass(frozen=True, eq=False)
class OrientedSurface:
    """Points on the surface of a solid, with normals that point out of it."""

    points: np.ndarray  # (n, 3)
    outward: np.ndarray  # (n, 3) unit normals
    areas: np.ndarray  # (n,) that each point stands for
    piece: np.ndarray  # (n,) that each point belongs to, by links of neighbours
    noise: float  # mean share of noise of the neighbourhoods
    shut: float  # share of the surface that faces the place to which it was contracted: walls of holes that were shut
    turned: float  # share of links of neighbours, by how flat the surface is there, between opposite normals

    @classmethod
    def of(cls, state: Contraction) -> OrientedSurface:
        """That of a contracted cloud: its survivors, where they were before they moved."""
        points, rings = state.cloud[state.survivors], state.rings
        outward = outward_normals(points, state.normals[state.survivors], rings)
        areas = point_areas(points, nearest_neighbours(points, min(AREA_NEIGHBOURS + 1, len(points)))[1])
        piece = component_labels(len(points), np.column_stack([rings.centres, rings.indices]))
        facing = dot(points - state.positions, outward) < 0
        is_inward = np.bincount(piece, areas * facing) > CURVE.majority * np.bincount(piece, areas)
        outward, facing = np.where(is_inward[piece, None], -outward, outward), facing ^ is_inward[piece]
        faces, count = facing[:, None].astype(float), rings.sizes[:, None]
        for _ in range(2):  # in patches: noise turns some here and there
            faces = (faces + count * rings.mean_over(faces)) / (1 + count)
        cosine = dot(outward[rings.centres], outward[rings.indices])
        flat = np.abs(cosine) * uprightness(points, outward, rings.centres, rings.indices)
        shut = float(areas[faces[:, 0] > CURVE.majority].sum() / areas.sum())
        turned = float(flat[cosine < 0].sum() / max(flat.sum(), TINY))
        return cls(points, outward, areas, piece, state.report.noise, shut, turned)

    @property
    def is_closed(self) -> bool:
        """Whether the whole surface is seen, so that its normals cancel out (Gauss), and their signs are right."""
        sums = group_sum(self.areas[:, None] * self.outward, self.piece, self.piece.max() + 1)
        openness = norm(sums).sum() / self.areas.sum()
        turned = CLOSED.turned * np.clip(self.noise / CLOSED.noisy, CLOSED.least_turned, 1)
        return bool(openness < CLOSED.open and self.turned < turned)

    def has_shut(self, share: float) -> bool:
        """Whether it is closed and at least this share of it, of few points more, is walls of holes that were shut."""
        return self.is_closed and self.shut * min(len(self.points) / CLOSED.enough, 1) >= share

    def confirms(self, graph: MedialGraph) -> bool:
        """Whether the curve on the medial axis is to be believed: where much faces the curve, only if it is sound."""
        return graph.is_sound or self.shut < CLOSED.most_shut

    def medial_graph(self) -> MedialGraph:
        """The curves on the medial axes of the closed surfaces through the points of each piece.

        InvalidCloudError where no surface goes through one of them.
        """
        pieces = [self.piece == piece for piece in range(self.piece.max() + 1)]
        graphs = [MedialGraph.of(self.points[piece], self.outward[piece]) for piece in pieces]
        places, radii, edges, handles = zip(*graphs, strict=True)
        first = np.cumsum([0, *map(len, places[:-1])])
        shifted = np.concatenate([part + start for part, start in zip(edges, first, strict=True)])
        return MedialGraph(np.concatenate(places), np.concatenate(radii), shifted, sum(handles))


def genus(n: int, triangles: np.ndarray) -> int:
    """Handles of closed surfaces: triangles (t, 3) over n vertices, each of which has one."""
    sides = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    return components(n, sides) - (n - len(triangles) // 2) // 2


def components(n: int, edges: np.ndarray) -> int:
    """How many pieces n vertices with these edges have."""
    return int(component_labels(n, edges).max(initial=-1)) + 1
