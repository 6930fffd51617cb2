"""Drop branches that end."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..analysis.branches import branch_table
from ..errors import InvalidParameterError
from ..numerics.vectors import norm
from ..refinement.merging import merge_into
from ..skeleton import Root, Skeleton


def prune(
    skeleton: Skeleton,
    *,
    length: float = 0.0,
    radius: float = 0.0,
    order: int | None = None,
    root: Root = None,
) -> Skeleton:
    """Drop branches that leave a junction and end, and are short, thin, or of a high order.

    Parameters
    ----------
    skeleton : Skeleton
    length : float
        Least length of a branch, from junction to tip, in the cloud's units. Of every junction the shortest goes first,
        and what is left of the junction is measured anew, so that the longest way through it stays.
    radius : float
        Least mean radius of a branch, in the same way.
    order : int, optional
        Highest order that stays, as `branch_table` counts: 0 for the stem alone.
    root : str, int or (x, y, z), optional
        Where orders count from, see `branch_table`.

    Returns
    -------
    Skeleton
        Points of a branch belong to the vertex that it grew from.

    Raises
    ------
    InvalidParameterError
        A number is out of its range, radii are not known, or orders are asked for of a skeleton with loops.

    Examples
    --------
    >>> from glsk_o3d import pipelines
    >>> from glsk_o3d.samples import tree
    >>> whole = pipelines.tree()(tree(8000, forks=3).points)
    >>> len(whole.leaves), len(prune(whole, order=0).leaves)
    (9, 2)
    """
    for name, value in (("length", length), ("radius", radius)):
        if not (np.isfinite(value) and value >= 0):
            raise InvalidParameterError(f"{name} = {value!r}: must be finite and not negative")
    if order is not None:
        skeleton = _without_orders(skeleton, order, root)
    if length:
        skeleton = _without_ends(skeleton, length, _length)
    if radius:
        if not np.isfinite(skeleton.radii).all():
            raise InvalidParameterError("the skeleton has no radii: it cannot be pruned by them")
        skeleton = _without_ends(skeleton, radius, _mean_radius)
    return skeleton


def _without_orders(skeleton: Skeleton, order: int, root: Root) -> Skeleton:
    if isinstance(order, bool) or not isinstance(order, int | np.integer) or order < 0:
        raise InvalidParameterError(f"order = {order!r}: must be an int of at least 0")
    if skeleton.n_loops:
        raise InvalidParameterError(
            f"the skeleton has {skeleton.n_loops} loops: branches have an order in a tree; see cut_loops()"
        )
    table = branch_table(skeleton, root)
    group = np.arange(len(skeleton.vertices))
    for row in np.argsort(table.level, kind="stable").tolist():  # parents before their children
        if table.order[row] > order:
            path = skeleton.branches[row]
            away = path[1:] if path[0] == table.start[row] else path[:-1]
            group[away] = group[table.start[row]]
    return merge_into(skeleton, group)


def _without_ends(skeleton: Skeleton, least: float, measure: Callable[[Skeleton, np.ndarray], float]) -> Skeleton:
    """Without branches that end and measure less, the least of each junction first."""
    while True:
        worst: dict[int, tuple[float, np.ndarray]] = {}
        for path in skeleton.branches:
            path = path[::-1] if skeleton.degree[path[0]] == 1 else path
            if skeleton.degree[path[0]] > 2 and skeleton.degree[path[-1]] == 1:
                size, fork = measure(skeleton, path), int(path[0])
                if size < min(least, worst.get(fork, (np.inf,))[0]):
                    worst[fork] = size, path
        if not worst:
            return skeleton
        group = np.arange(len(skeleton.vertices))
        for fork, (_, path) in worst.items():
            group[path] = fork
        skeleton = merge_into(skeleton, group)


def _length(skeleton: Skeleton, path: np.ndarray) -> float:
    return float(norm(np.diff(skeleton.vertices[path], axis=0)).sum())


def _mean_radius(skeleton: Skeleton, path: np.ndarray) -> float:
    return float(skeleton.radii[path[1:]].mean())
