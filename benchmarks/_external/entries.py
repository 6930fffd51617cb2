"""A shape of other people's: its clouds and its axis, as a benchmark takes them."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from glsk_o3d.analysis.curves import simple_edges
from glsk_o3d.errors import FileFormatError

LARGER = 2  # what cloud and axis of one shape may differ by at most, in the diagonals of their boxes

Axis = tuple[np.ndarray, np.ndarray, np.ndarray | None]  # nodes (M, 3), edges (E, 2), radii (M,) where they are known


class Entry(NamedTuple):
    """A shape, read."""

    family: str
    clouds: dict[str, np.ndarray]
    axis: Axis
    left_out: tuple[str, ...] = ()
    """What was left out of its clouds, and why, in words."""


Source = tuple[str, Callable[[], Entry]]
"""The name of a shape, and what reads it."""


def plain(path: Path) -> str:
    """A path as a name that every system can write: what is not plain becomes a hyphen."""
    return re.sub(r"[^\w.+-]+", "-", path.as_posix()).lstrip(".+-") or "unnamed"


def welded(nodes: np.ndarray, edges: np.ndarray, radii: np.ndarray | None = None) -> Axis:
    """An axis whose nodes in one place are one node, with the largest of their radii; nodes without an edge go."""
    places, same = np.unique(nodes, axis=0, return_inverse=True)
    edges = simple_edges(same.reshape(-1)[edges])
    used, ends = np.unique(edges, return_inverse=True)
    if radii is not None:
        widest = np.full(len(places), -np.inf)
        np.maximum.at(widest, same.reshape(-1), radii)
        radii = widest[used]
    return places[used], ends.reshape(-1, 2), radii


def check_sizes(name: str, entry: Entry) -> None:
    """Raise FileFormatError for an axis that is not of the size of its clouds: files of different versions."""
    of_axis, *others = (np.linalg.norm(np.ptp(each, axis=0)) for each in (entry.axis[0], *entry.clouds.values()))
    for variant, size in zip(entry.clouds, others, strict=True):
        if not of_axis / LARGER <= size <= of_axis * LARGER:
            raise FileFormatError(
                f"{name}: cloud {variant} is {size:.3g} across and the axis {of_axis:.3g}: are they of one version?"
            )
