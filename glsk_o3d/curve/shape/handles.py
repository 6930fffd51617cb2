"""Follow handles to the body that they are on: those of a mug, a pot, a bucket."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from ...geometry.cycles import edges_on_cycles
from ...geometry.groups import quantile
from ...geometry.numbers import derived, precision, speed
from ...geometry.polylines import arc_lengths
from ...geometry.vectors import TINY, Floats, Ints, cross, dot, norm, unit
from ..axis.sections import half_axes, normal_moments
from ..curve import Curve
from ..limbs import Line
from ..numbers import CURVE
from .wide_ends import half_widths


@dataclass(frozen=True)
class HandleNumbers:
    """Numbers of `Handles`."""

    step: float = precision(0.7, "radii from one section to the next; with .3 and .5 the scores are the same")
    open: float = derived(2 / np.pi, "mean outward normal of half a tube; of more, nothing closes around it")
    flat: float = precision(1e-6, "share of a body's squared half width by which a flat one can be inverted")
    points: int = derived(4, "points; fewer say nothing of a section")
    tries: int = speed(4, "places from which a handle is followed until it meets the wall, two radii apart")
    rounds: int = precision(2, "rounds; from then on hardly anything moves")


HANDLE = HandleNumbers()


class Body(NamedTuple):
    """What handles begin at."""

    middle: Floats  # (3,), the mean of its points
    half_width: float
    wall: Floats  # (3, 3), of the ellipsoid with their covariance: on that of a sphere, x^T wall^{-1} x = 1


class Handles:
    """The handles of a curve with points: thin parts of loops, each next to a body at least three times as wide."""

    def __init__(self, curve: Curve) -> None:
        self.curve, self.cloud, self._sections = curve, curve.cloud, curve.sections
        self._width, self._tree = half_widths(curve), cKDTree(self.cloud.points)

    @cached_property
    def bodies(self) -> Ints:
        """The vertices nearest to the middles of bodies without a junction, int array.

        Such a body is the widest part of a branch, between two thin ones that are near each other.
        """
        middles: list[int] = []
        vertices, degree = self.curve.vertices, self.curve.degree
        for branch in self.curve.branches:
            if degree[branch[0]] == 2:  # a ring begins anywhere, but not in a body
                ring = branch[:-1]
                thinnest = int(np.argmin(np.where(self.cloud.count[ring] > 0, self._width[ring], np.inf)))
                branch = np.append(np.roll(ring, -thinnest), ring[thinnest])
            wide = self._width[branch]
            top = int(np.argmax(wide))
            thin = np.flatnonzero((CURVE.neck * wide <= wide[top]) & (self.cloud.count[branch] > 0))
            before, after = thin[thin < top], thin[thin > top]
            if not len(before) or not len(after):
                continue
            distance = np.linalg.norm(vertices[branch[after[0]]] - vertices[branch[before[-1]]])
            body = branch[before[-1] + 1 : after[0]]
            own = self.cloud.members.of(body)
            if distance > CURVE.stub * wide[top] or not len(own):
                continue
            away = norm(vertices[body] - self.cloud.points[own].mean(axis=0))
            if away.min() < wide[top] / 2 and self.on_loop(branch):  # or the middle is that of a thick ring
                middles.append(body[away.argmin()])
        return np.array(middles, int)

    def body(self, paths: list[np.ndarray]) -> Body:
        """The body where some paths begin: as far along these as all vertices are at most their width away from there.

        Without points, its middle is the beginning.
        """
        vertices, parts = self.curve.vertices, []
        for path in [*paths, *(path[::-1] for path in paths if path[0] == path[-1])]:
            inside = norm(vertices[path] - vertices[path[0]]) <= 2 * self._width[path]
            parts.append(path[np.logical_and.accumulate(inside)])
        near = np.unique(np.concatenate(parts))
        own, wide = self.cloud.members.of(near), float(self._width[near].max(initial=0))
        points = self.cloud.points[own] if len(own) else vertices[paths[0][:1]]
        offset = points - points.mean(axis=0)
        wall = 3 * offset.T @ offset / len(points) + HANDLE.flat * wide**2 * np.eye(3)
        return Body(points.mean(axis=0), wide, wall)

    @cached_property
    def _looped(self) -> set[tuple[int, int]]:
        """The edges of loops, in both directions."""
        edges = self.curve.edges
        looped = edges_on_cycles(len(self._width), edges)
        return {(a, b) for i, j in edges[looped].tolist() for a, b in ((i, j), (j, i))}

    def on_loop(self, path: np.ndarray) -> bool:
        """Whether a branch, or a part of one, is on a loop: with its first edge, all are."""
        return tuple(path[:2].tolist()) in self._looped

    def follow(self, path: np.ndarray, body: Body) -> Line | None:
        """Follow a limb from where it is undisturbed to the body where its path begins; None if it is no handle there.

        If it does not come to the wall, it is followed from farther away.
        """
        places, cloud = self.curve.vertices[path], self.cloud
        thin = (CURVE.neck * self._width[path] <= body.half_width) & (cloud.count[path] > 0)
        run = np.flatnonzero(thin)
        if len(run):  # the first of several
            thick = np.flatnonzero(~thin[run[0] :] & (cloud.count[path[run[0] :]] > 0))
            run = run[run < run[0] + (thick[0] if len(thick) else len(path))]
        radius = quantile(self._sections.radius[path[run]]) if len(run) else 0.0
        size = np.maximum(self._sections.radius, cloud.distance)[path[run]]
        run = run[size < CURVE.undisturbed * radius]
        if len(run) < HANDLE.points or not self.on_loop(path):
            return None
        along = arc_lengths(places)
        half_width, half_thickness = (quantile(half[path[run]]) for half in self._sections[:2])
        # the rest is followed from its own end, if that is one of the same body's; else it may be no handle there
        last = along[run].mean() if path[0] == path[-1] else min(along[run].mean(), along[-1] / 2)
        away = along[run[0]] + CURVE.line_length * radius * np.arange(1, HANDLE.tries + 1)
        for start in np.unique(np.minimum(away, last)):
            begin = int(np.searchsorted(along, start, "right")) - 1
            behind, ahead = min(begin + 2, len(path) - 1), max(begin - 2, 0)
            centres, direction = self._followed(
                float(np.linalg.norm(places[begin] - places[0])),
                places[begin],
                unit(places[[ahead]] - places[[behind]])[0],
                half_width,
                half_thickness,
                self._sections.across[path[begin]],
            )
            inwards = body.middle - centres[-1]
            if len(centres) > 1 and inwards @ np.linalg.solve(body.wall, inwards) < CURVE.undisturbed**2:
                # the wall disturbs what the handle says of its direction: the more it turns aside, the less that counts
                straight = max(inwards @ direction, 0.0)
                share = straight**2 / max(inwards @ inwards, TINY)
                direction = unit(((1 - share) * inwards + share * straight * direction)[None])[0]
                return Line(centres[-1], direction, radius, 0.0, float(along[begin]), centres[::-1], radius)
        return None

    def _followed(
        self, far: float, place: Floats, direction: Floats, half_width: float, half_thickness: float, across: Floats
    ) -> tuple[Floats, Floats]:
        """Follow a handle from a place, at most so far, while its sections close around it.

        Returned are the centres of the sections, (k, 3) float array, that place first, and the direction of the last
        two steps. A section stands across the direction of which the normals around have the least share, and its
        centre is nearest to the planes that they span with it, as in `fit_axis`. A point counts by how nearly its
        tangent plane touches an ellipse with the half axes of the handle, so that the wall of the body hardly does.
        """
        radius = max(np.sqrt(half_width * half_thickness), TINY)
        centres = [place]
        for _ in range(int(far / (HANDLE.step * radius))):
            centre, turned = centres[-1] + HANDLE.step * radius * direction, direction
            near = self._tree.query_ball_point(centre, np.hypot(radius, CURVE.undisturbed * half_width))
            points, normals = self.cloud.points[near], self.cloud.normals[near]
            for fits in range(HANDLE.rounds + 1):
                offset = points - centre
                along, lean, side = offset @ turned, (normals @ turned) ** 2, (normals @ across) ** 2
                aside = offset - along[:, None] * turned
                height = dot(normals, aside)
                due = np.sqrt(half_width**2 * side + half_thickness**2 * np.maximum(1 - lean - side, 0))
                weight = np.maximum(1 - (along / radius) ** 2, 0) * np.maximum(1 - 2 * lean, 0)
                weight /= 1 + ((np.abs(height) - due) / (CURVE.touching * radius)) ** 2
                weight *= norm(aside) < CURVE.undisturbed * half_width
                if fits == HANDLE.rounds or np.count_nonzero(weight) < HANDLE.points:
                    break
                stay = CURVE.stay * weight.sum() * np.eye(3)
                squares = (weight[:, None] * normals).T @ normals + stay @ (np.eye(3) - np.outer(turned, turned))
                turn = np.linalg.eigh(squares)[1][:, 0]
                turn = turn if turn @ turned > 0 else -turn
                planes = cross(normals, turn[None])
                pull = (weight[:, None] * planes).T @ planes
                step = np.linalg.solve(pull + stay, (weight * dot(planes, offset)) @ planes)
                centre = centre + step - (step @ turn) * turn
                turned = unit((turned + turn)[None])[0]
            outward = np.linalg.norm(np.copysign(weight, height) @ normals)
            if np.count_nonzero(weight) < HANDLE.points or outward > HANDLE.open * weight.sum():
                break
            centres.append(centre)
            direction = turned
            across = half_axes((weight @ normal_moments(normals, offset))[None], np.array([radius])).across[0]
        # half a ring hardly says where it leads: the last places do
        return np.array(centres), unit((centres[-1] - centres[max(len(centres) - 3, 0)])[None])[0]
