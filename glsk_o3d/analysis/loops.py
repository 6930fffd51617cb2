"""The loops of a skeleton, and how probable it is that each is a handle of the object."""

from dataclasses import dataclass

import numpy as np

from ..numerics.cycles import inscribed_circle, minimum_cycle_basis
from ..refinement.evidence import Evidence
from ..refinement.loops import loop_facts
from ..skeleton import Skeleton


@dataclass(frozen=True, eq=False)
class Loop:
    """A loop of a minimum cycle basis of a skeleton.

    Attributes
    ----------
    vertices : (n,) int array
        In order, each once.
    opening : float
        Radius of the largest circle inside it, in the cloud's units.
    probability : float
        Probability that it is a handle of the object, see `Refiner.handle`; NaN without points and normals, or without
        the confidence of the `Refiner`.

    Examples
    --------
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import torus
    >>> (loop,) = find_loops(skeletonize(torus(2000).points))
    >>> abs(loop.opening - 0.4) < 0.02, loop.probability > 0.9
    (True, True)
    """

    vertices: np.ndarray
    opening: float
    probability: float


def find_loops(skeleton: Skeleton) -> tuple[Loop, ...]:
    """The loops of a minimum cycle basis (Horton 1987), the shortest first: as many as `Skeleton.n_loops`.

    Parameters
    ----------
    skeleton : Skeleton

    Returns
    -------
    tuple of Loop

    Examples
    --------
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import two_rings
    >>> len(find_loops(skeletonize(two_rings(2000).points)))
    2
    """
    cycles = opening_cycles(skeleton)
    chances = np.full(len(cycles), np.nan)
    if cycles and len(skeleton.supporting_points):
        known = [bool(np.isfinite(skeleton.confidence[cycle]).any()) for cycle, _ in cycles]
        found = loop_facts(skeleton, [cycle for cycle, _ in cycles], Evidence.of(skeleton))
        chances = np.where(known, [loop.probability for loop in found], np.nan)
    rows = zip(cycles, chances.tolist(), strict=True)
    return tuple(Loop(cycle, opening, chance) for (cycle, opening), chance in rows)


def opening_cycles(skeleton: Skeleton) -> list[tuple[np.ndarray, float]]:
    """The vertices of each loop of a minimum cycle basis, the shortest first, and how wide it opens."""
    cycles = minimum_cycle_basis(len(skeleton.vertices), skeleton.edges, skeleton.edge_lengths)
    return [(cycle, float(inscribed_circle(skeleton.vertices[cycle])[1])) for cycle in cycles]
