"""Measures of things: sections that are no circles, ends that are flat, parts whose axis is a matter of taste.

They come beside those of `glsk_o3d.analysis.compare`. A local radius is that of a circle of the section's area, at the
nearest place of the true axis.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from glsk_o3d.analysis.comparison import (
    JUNCTION_REACH,
    PLACE_SPACING,
    TIP_REACH,
    matching_f1,
    merged_junctions,
    nearest_pairs,
)
from glsk_o3d.analysis.curves import along, pieces, places_along, simple_edges
from glsk_o3d.data.skeleton import Skeleton
from glsk_o3d.errors import InvalidParameterError
from glsk_o3d.geometry.polylines import arc_lengths, place_at
from glsk_o3d.geometry.vectors import dot, norm, unit

from .truths import ThingTruth

HOOK_ANGLE = 30.0  # fitted: degrees by which an end may turn; what is seen to bend bends by more
# Fitted: where an end is looked at, in radii behind its tip: the last radius turns, the run is where it came from
LAST, RUN_START, RUN_END = 1.0, 1.5, 3.5
REACH_BEHIND, REACH_BEYOND = 4.0, 2.0  # fitted: how far before and beyond where an end should be it is sought, in radii
REACH_BESIDE = 1.2  # fitted: how far beside, in radii; in wide sections, half the width
CLEAR_OF_JUNCTIONS = 1.5  # fitted: local radii around a true junction where lengths are not compared
LEAST_COMPARED = 3.0  # fitted: length in median radii below which lengths are not compared


class _Pair:
    """A skeleton and the axis of a thing, cut into places: what all measures are made of."""

    def __init__(self, truth: ThingTruth, found: Skeleton):
        self.truth, self.found, self.radii = truth, found, truth.radii
        self.axis = Skeleton(truth.nodes, simple_edges(truth.edges), truth.radii, (), (), ())  # type: ignore[arg-type]
        step = PLACE_SPACING * np.median(truth.radii)
        row, part = pieces(truth.nodes, truth.edges, step)
        self.place, self.radius = (along(truth.edges, row, part, values) for values in (truth.nodes, truth.radii))
        length = norm(truth.nodes[truth.edges[:, 0]] - truth.nodes[truth.edges[:, 1]])
        self.counts, self.length = truth.judged[row], (length / np.bincount(row, minlength=len(length)))[row]
        edge, self.curve, _ = places_along(found, step)
        share = found.edge_lengths / np.bincount(edge, minlength=len(found.edges)) if len(found.edges) else None
        self.span = np.zeros(len(self.curve)) if share is None else share[edge]
        self.tree = cKDTree(self.place)
        self.away, nearest = self.tree.query(self.curve)
        self.back = cKDTree(self.curve).query(self.place)[0]
        self.mine, self.here = self.counts[nearest], self.radius[nearest]
        self.all_judged = bool(truth.judged.all())
        self.tips, self.leaves = self.axis.leaves, found.leaves
        if not self.all_judged:
            touched = np.bincount(truth.edges[truth.judged].ravel(), minlength=len(truth.nodes)) > 0
            self.tips = self.tips[touched[self.tips]]
            self.leaves = self.leaves[self.counts[self._nearest(self.leaves)]]

    def _nearest(self, vertices: np.ndarray) -> np.ndarray:
        return self.tree.query(self.found.vertices[vertices])[1] if len(vertices) else np.empty(0, int)

    def of_judged(self, topology: bool) -> dict[str, Any]:
        """The measures of `compare` where not all is judged: those that are changed."""
        ends, tips, radii = self.found.vertices[self.leaves], self.axis.vertices[self.tips], self.radii[self.tips]
        tips_f1, mine = matching_f1(ends, tips, TIP_REACH * radii), self.mine
        return {
            "error": float(np.mean(self.away[mine] / self.here[mine])) if mine.any() else None,
            "inside": float(np.mean(self.away[mine] < self.here[mine])) if mine.any() else 0.0,
            "completeness": float(np.mean(self.back[self.counts] < self.radius[self.counts])),
            "leaves": len(ends) - len(tips),
            "tips_f1": tips_f1,
            "ends": float(np.mean(cKDTree(ends).query(tips)[0] / radii)) if len(ends) and len(tips) else None,
            **dict.fromkeys(("length", "junctions", "junctions_f1")),
            "perfect": topology and tips_f1 == 1,
        }

    def hooks(self) -> float | None:
        """Share of the ends that turn, beyond what the true end nearby turns; None if none is long enough."""
        turns = last_turns(self.found, self.leaves, self.radius[self._nearest(self.leaves)])
        if np.isnan(turns).all():
            return None
        owed = np.zeros(len(turns))
        if len(self.tips):
            radii = self.radii[self.tips]
            apart = cdist(self.found.vertices[self.leaves], self.axis.vertices[self.tips])
            apart[apart >= TIP_REACH * radii] = np.inf
            true = np.nan_to_num(last_turns(self.axis, self.tips, radii))
            owed = np.where(np.isfinite(apart).any(axis=1), true[apart.argmin(axis=1)], 0.0)
        return hook_share(turns - owed)

    def overshoots(self) -> np.ndarray:
        """How far beyond the true tip the skeleton goes, for each tip at a flat face, in radii."""
        edges, nodes = self.axis.edges, self.axis.vertices
        flat = self.truth.flat[self.axis.degree[self.truth.flat] == 1]
        before = np.bincount(edges.ravel(), edges[:, ::-1].ravel(), len(nodes)).astype(int)  # of a tip: its neighbour
        places, found = np.vstack([self.curve, self.found.vertices]), np.full(len(flat), -REACH_BEHIND)
        outward = unit(nodes[flat] - nodes[before[flat]])
        beside = np.maximum(REACH_BESIDE * self.radii[flat], self.truth.half_width[flat])
        for i, (tip, out, radius) in enumerate(zip(nodes[flat], outward, self.radii[flat], strict=True)):
            beyond = (places - tip) @ out
            near = (beyond > -REACH_BEHIND * radius) & (beyond < REACH_BEYOND * radius)
            near &= norm(places - tip - np.outer(beyond, out)) < beside[i]
            if near.any():
                found[i] = beyond[near].max() / radius
        return found

    def wiggle(self) -> float | None:
        """Length of the skeleton over that of the axis, less 1, where each runs beside the other."""

        def clear(places: np.ndarray, radius: np.ndarray) -> np.ndarray | bool:
            forks = self.axis.vertices[self.axis.junctions]
            return cKDTree(forks).query(places)[0] > CLEAR_OF_JUNCTIONS * radius if len(forks) else True

        here = (self.away < self.here) & self.mine & clear(self.curve, self.here)
        there = (self.back < self.radius) & self.counts & clear(self.place, self.radius)
        length = float(self.length[there].sum())
        return float(self.span[here].sum()) / length - 1 if length > LEAST_COMPARED * np.median(self.radii) else None

    def mirror(self) -> float | None:
        """Mean distance of the skeleton from its mirror image; None for what has no plane of symmetry."""
        if len(self.truth.mirror) == 0:
            return None
        point, normal = self.truth.mirror
        image = self.curve - 2 * np.outer((self.curve - point) @ normal, normal)
        return float(np.mean(cKDTree(self.curve).query(image)[0] / self.here))

    def junction_offset(self) -> float | None:
        """Mean distance of the junctions from the true ones that they are paired with; None if there are no pairs."""
        if not self.all_judged or not len(self.axis.junctions) or not len(self.found.junctions):
            return None
        true, local = merged_junctions(self.axis.vertices[self.axis.junctions], self.place, self.radius)
        forks, _ = merged_junctions(self.found.vertices[self.found.junctions], self.place, self.radius)
        apart = cdist(forks, true) / local
        pairs = np.array(nearest_pairs(np.where(apart <= JUNCTION_REACH, apart, np.inf)), int).reshape(-1, 2)
        return float(apart[tuple(pairs.T)].mean()) if len(pairs) else None


def of_thing(truth: ThingTruth, found: Skeleton, topology: bool) -> dict[str, Any]:
    """The measures of things, and those of `compare` that differ since not all of the axis is judged.

    `topology` says whether that is right.
    """
    if not truth.judged.any():
        raise InvalidParameterError("no edge of the truth is judged: there is nothing to score")
    pair = _Pair(truth, found)
    beyond = pair.overshoots()
    return {
        **({} if pair.all_judged else pair.of_judged(topology)),
        "hooks": pair.hooks(),
        "reach": float(np.abs(beyond).mean()) if len(beyond) else None,
        "overshoot": float(beyond.mean()) if len(beyond) else None,
        "wiggle": pair.wiggle(),
        "mirror": pair.mirror(),
        "junction_offset": pair.junction_offset(),
    }


def last_turns(skeleton: Skeleton, leaves: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """By how many degrees ends turn: the last radius from the tip, against the run from 1.5 to 3.5 radii behind it.

    (k,) float array for leaves, (k,), with a radius for each; NaN where the branch is shorter than 3.5 radii.
    """
    paths = {int(way[0]): way for path in skeleton.branches for way in (path, path[::-1])}
    ways = np.full((len(leaves), 2, 3), np.nan)
    for i, (leaf, radius) in enumerate(zip(leaves.tolist(), radii, strict=True)):
        path = skeleton.vertices[paths[leaf]]
        lengths = arc_lengths(path)
        if lengths[-1] >= RUN_END * radius:
            places = place_at(path, lengths, radius * np.array([0, LAST, RUN_START, RUN_END]))
            ways[i] = places[[0, 2]] - places[[1, 3]]
    ways = unit(ways.reshape(-1, 3)).reshape(-1, 2, 3)
    return np.degrees(np.arccos(np.clip(dot(ways[:, 0], ways[:, 1]), -1, 1)))


def hook_share(turns: np.ndarray) -> float:
    """Share of the ends, of those long enough, that turn by more than may be; NaN if there are none."""
    return float(np.mean(turns[~np.isnan(turns)] > HOOK_ANGLE))
