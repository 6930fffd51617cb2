"""What is left to do when the skeletons of all tiles are side by side: merge, tie up, and tell."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from ..analysis.graph import simple_edges
from ..numerics.components import component_labels
from ..numerics.vectors import norm
from ..skeleton import Skeleton
from .grid import Grid

if TYPE_CHECKING:
    from .joining import Joint

LONGEST_STUB = 2.0  # fitted: of its scale, up to which what ends at a seam is the foot of a limb that forks beyond it


@dataclass(frozen=True)
class Seams:
    """How cut ends met at the seams of tiles.

    Attributes
    ----------
    joined : int
        Pairs that were made one, and ends that were tied to a curve beside them.
    unmatched : int
        Ends that nobody went on from: one of two tiles lost what the other has. They are kept as ends.
    thick : int
        Cut ends where the part is thicker than the overlap allows, so that the ends of what was cut out reach there;
        and ends so near to where a tile's points were cut off that the part may go on.
    thickest : float
        Radius of the thickest part at a seam.

    Examples
    --------
    >>> Seams(joined=4, unmatched=0, thick=1, thickest=0.3).messages(Grid((0, 0, 0), (2, 2, 2), (2, 1, 1), 0.4))
    ['1 ends at seams are of parts thicker than the overlap of 0.4 allows, radius up to 0.3: give 0.8 or more']
    """

    joined: int
    unmatched: int
    thick: int
    thickest: float

    def messages(self, grid: Grid) -> list[str]:
        """What is to be beware of, in sentences."""
        told = []
        if self.unmatched:
            told.append(
                f"{self.unmatched} of {self.joined + self.unmatched} cuts at seams have nothing to meet on the other "
                "side, and end there: give larger tiles, or more overlap"
            )
        if self.thick:
            need = grid.overlap * self.thickest / grid.thickest
            told.append(
                f"{self.thick} ends at seams are of parts thicker than the overlap of {grid.overlap:g} allows, radius "
                f"up to {self.thickest:.3g}: give {need:.3g} or more"
            )
        return told


def finished(joint: Joint, grid: Grid) -> tuple[Skeleton, Seams]:
    """The skeleton that was brought together, and how."""
    values = np.concatenate([np.empty((0, 8)), *(strands.values for strands in joint.strands)])
    edges = np.concatenate(
        [np.empty((0, 2), np.int64)]
        + [strands.edges + at for strands, at in zip(joint.strands, joint.first, strict=False)]
    )
    same = np.arange(len(values))
    one, other = np.array(joint.merged, np.int64).reshape(-1, 2).T
    same[one] = other
    values[other] = (values[other] + values[one]) / 2
    alive = same == np.arange(len(values))
    touching = np.array(joint.touching, np.int64).reshape(-1, 2)
    edges, loose = _tied(simple_edges(same[edges]), same[touching], alive)
    ends = np.concatenate([np.array(joint.open, np.int64), loose])
    ends = ends[np.bincount(edges.ravel(), minlength=len(values))[ends] < 2]  # where curves fork, some go on
    gone, ends = _stubs(values, edges, ends)
    alive[gone] = False
    edges = edges[alive[edges].all(axis=1)]
    ends = ends[_unmet(values[ends], joint.met)]
    radii = np.concatenate([values[np.concatenate([other, touching[:, 0], ends]), 3], *joint.short])
    seams = Seams(
        joined=len(other) + len(touching) - len(loose),
        unmatched=len(ends),
        thick=int((radii > grid.thickest).sum()),
        thickest=float(np.nanmax(radii, initial=0)),
    )
    number, kept, none = np.cumsum(alive) - 1, values[alive], np.empty((0, 3))
    edges = simple_edges(number[edges])
    known = dict(zip(("radii", "confidence", "half_width", "half_thickness"), kept.T[[3, 4, 6, 7]], strict=True))
    return Skeleton(kept[:, :3], edges, vertex_of_point=none, points=none, normals=none, **known), seams


def _tied(edges: np.ndarray, touching: np.ndarray, alive: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Edges from cut ends to the curves beside them, where they close no loop; and the ends that got none."""
    piece = component_labels(len(alive), edges)
    new, loose = [], []
    for one, other in touching.tolist():
        if piece[one] == piece[other]:
            loose.append(one)
        else:
            new.append((one, other))
            piece[piece == piece[one]] = piece[other]
    return simple_edges(np.concatenate([edges, np.array(new, np.int64).reshape(-1, 2)])), np.array(loose, np.int64)


def _stubs(values: np.ndarray, edges: np.ndarray, ends: np.ndarray) -> tuple[list[int], np.ndarray]:
    """Vertices of short limbs that end in a cut: on the other side they fork elsewhere; and the other cut ends."""
    gone: list[int] = []
    left: list[int] = []
    around: dict[int, set[int]] = {}
    for a, b in edges.tolist() if len(ends) else ():
        around.setdefault(a, set()).add(b)
        around.setdefault(b, set()).add(a)
    for end in ends.tolist():
        path, length = [end], 0.0
        while len(around.get(path[-1], ())) == 1 and length <= LONGEST_STUB * values[end, 5]:
            (onward,) = around[path[-1]]
            length += float(norm(values[None, onward, :3] - values[path[-1], :3])[0])
            around[onward].discard(path[-1])
            path.append(onward)
        forks = len(path) > 1 and len(around[path[-1]]) > 1 and length <= LONGEST_STUB * values[end, 5]
        if forks:
            gone += path[:-1]
        else:
            left.append(end)
            for here, onward in pairwise(path):
                around[onward].add(here)
    return gone, np.array(left, np.int64)


def _unmet(ends: np.ndarray, met: list[np.ndarray]) -> np.ndarray:
    """Which cut ends have no end of the object beside them that another tile saw."""
    others = np.concatenate([np.empty((0, 8)), *met])
    if not len(ends) or not len(others):
        return np.ones(len(ends), bool)
    distance, nearest = cKDTree(others[:, :3]).query(ends[:, :3])
    return distance > ends[:, 5] + others[nearest, 5]
