"""The surface of a solid: which of its holes contraction has shut, and the curve on its medial axis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..data.contraction import Contraction
from ..geometry.groups import component_labels
from ..geometry.inscribed_balls import outward_normals
from ..geometry.medial_axis import Burnt, MedialAxis, medial_curve
from ..geometry.neighbourhoods import nearest_neighbours, spacing, uprightness
from ..geometry.numbers import fitted
from ..geometry.vectors import TINY, dot
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
    most_shut: float = fitted(0.2, "share of a surface that can be walls of shut holes; where more is, signs are wrong")


CLOSED = ClosedNumbers()


class MedialGraph(NamedTuple):
    """A curve on a medial axis."""

    places: np.ndarray  # (p, 3)
    radii: np.ndarray  # (p,) of the inscribed balls
    edges: np.ndarray  # (e, 2)
    genus: int  # of the surface: handles of the solid

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


@dataclass(frozen=True, eq=False)
class OrientedSurface:
    """Points on the surface of a solid, with normals that point out of it."""

    points: np.ndarray  # (n, 3)
    outward: np.ndarray  # (n, 3) unit normals
    areas: np.ndarray  # (n,) that each point stands for
    noise: float  # mean share of noise of the neighbourhoods
    shut: float  # share of the surface that faces the place to which it was contracted: walls of holes that were shut
    turned: float  # share of links of neighbours, by how flat the surface is there, between opposite normals

    @classmethod
    def of(cls, state: Contraction) -> OrientedSurface:
        """That of a contracted cloud: its survivors, where they were before they moved."""
        points, rings = state.cloud[state.survivors], state.rings
        outward = outward_normals(points, state.normals[state.survivors], rings)
        areas = point_areas(points, nearest_neighbours(points, min(AREA_NEIGHBOURS + 1, len(points)))[1])
        faces, count = (dot(points - state.positions, outward) < 0)[:, None].astype(float), rings.sizes[:, None]
        for _ in range(2):  # in patches: noise turns some here and there
            faces = (faces + count * rings.mean_over(faces)) / (1 + count)
        cosine = dot(outward[rings.centres], outward[rings.indices])
        flat = np.abs(cosine) * uprightness(points, outward, rings.centres, rings.indices)
        shut, turned = (
            areas[faces[:, 0] > CURVE.majority].sum() / areas.sum(),
            flat[cosine < 0].sum() / max(flat.sum(), TINY),
        )
        return cls(points, outward, areas, state.report.noise, float(shut), float(turned))

    @property
    def shut_for_certain(self) -> float:
        """The same, less of few points, whose contraction oversteps."""
        return self.shut * min(len(self.points) / CLOSED.enough, 1)

    @property
    def is_closed(self) -> bool:
        """Whether the whole surface is seen, so that its normals cancel out (Gauss), and their signs are right."""
        openness = np.linalg.norm(self.areas @ self.outward) / self.areas.sum()
        turned = CLOSED.turned * np.clip(self.noise / CLOSED.noisy, CLOSED.least_turned, 1)
        return bool(openness < CLOSED.open and self.turned < turned and self.shut < CLOSED.most_shut)

    def medial_graph(self) -> MedialGraph:
        """The curve on the medial axis of the closed surface through the points."""
        mesh = poisson_mesh(self.points, self.outward, spacing(self.points))
        vertices, triangles = np.asarray(mesh.vertices), np.asarray(mesh.triangles)
        axis = MedialAxis.of(vertices, inside_of(mesh))
        used, edges = np.unique(medial_curve(axis, Burnt.of(axis), vertices), return_inverse=True)
        return MedialGraph(axis.places[used], axis.radii[used], edges.reshape(-1, 2), genus(len(vertices), triangles))


def genus(n: int, triangles: np.ndarray) -> int:
    """Handles of closed surfaces: triangles (t, 3) over n vertices, each of which has one."""
    sides = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    return components(n, sides) - (n - len(triangles) // 2) // 2


def components(n: int, edges: np.ndarray) -> int:
    """How many pieces n vertices with these edges have."""
    return int(component_labels(n, edges).max(initial=-1)) + 1
