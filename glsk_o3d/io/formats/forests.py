"""Trees, for the formats that hold nothing else: loops cut, numbered from the root outwards, and near the origin."""

from __future__ import annotations

import numpy as np

from ...analysis.branches import branch_table
from ...editing.graphs import cut_loops, reroot
from ...errors import FileFormatError
from ...refinement.rooted import RootPlace, numbered_from
from ...skeleton import Skeleton

FLOAT32_SHARE = 0.01  # derived: an error of a hundredth of a radius is below what any fit of the axis knows


def as_forest(skeleton: Skeleton, cut: bool, root: RootPlace | None) -> Skeleton:
    """A skeleton as one tree per component: each vertex but the first of a component has one of lower number before it.

    Parameters
    ----------
    skeleton : Skeleton
    cut : bool
        Cut loops open, as `glsk_o3d.editing.cut_loops` does, instead of refusing them.
    root : str, int or (x, y, z), optional
        As for `glsk_o3d.editing.reroot`. By default vertex 0, if the numbers go outwards from it already, or else the
        root of `Skeleton.branch_table`.

    Raises
    ------
    FileFormatError
        There are loops, and they are not to be cut.
    InvalidParameterError
        There is no such root.
    """
    if skeleton.n_loops and not cut:
        raise FileFormatError(
            f"this format holds trees only and the skeleton has {skeleton.n_loops} loop(s): "
            "pass cut_loops=True to drop an edge of each, or choose another format"
        )
    forest = cut_loops(skeleton)[0] if skeleton.n_loops else skeleton
    if len(forest.vertices) == 0:
        return forest
    if root is not None:
        return reroot(forest, root)
    if is_outward(forest):
        return forest
    table = branch_table(forest)
    return numbered_from(forest, int(table.start[np.argmin(table.level)]))


def is_outward(skeleton: Skeleton) -> bool:
    """Whether no vertex has two neighbours of lower number: then it is a forest, numbered from its roots outwards."""
    return len(np.unique(skeleton.edges[:, 1])) == len(skeleton.edges)


def parents(forest: Skeleton) -> np.ndarray:
    """The vertex before each of a forest that is numbered outwards, (M,) int array; -1 for roots."""
    parent = np.full(len(forest.vertices), -1)
    parent[forest.edges[:, 1]] = forest.edges[:, 0]
    return parent


def global_shift(skeleton: Skeleton) -> np.ndarray:
    """What to take off coordinates so that float32 holds them, (3,) float array of whole numbers.

    0 along axes where float32 holds them as they are.
    """
    finite = skeleton.vertices[np.isfinite(skeleton.vertices).all(axis=1)]
    sizes = np.concatenate([skeleton.radii, skeleton.edge_lengths])
    sizes = sizes[sizes > 0]
    if len(finite) == 0 or len(sizes) == 0:
        return np.zeros(3)
    lost = np.abs(finite).max(axis=0) * np.finfo(np.float32).eps > FLOAT32_SHARE * np.median(sizes)
    return np.where(lost, np.floor(finite.min(axis=0)), 0.0)
