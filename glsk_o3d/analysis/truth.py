"""A known axis, to measure a skeleton against."""

from __future__ import annotations

import os
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..errors import FileFormatError, InvalidParameterError
from ..interop.files import read_skeleton
from .graph import check_graph


@dataclass(frozen=True, eq=False)
class Truth:
    """A known axis: a graph of straight edges with the distance to the surface at its nodes.

    Attributes
    ----------
    nodes : (M, 3) float64 array
    edges : (E, 2) int64 array
        Without any, the nodes themselves are the axis: a ball has one.
    radii : (M,) float64 array
        Positive, in the units of `nodes`.

    Raises
    ------
    InvalidParameterError
        There are no nodes, shapes do not fit, a number is not finite, a radius is not positive, or an edge names a node
        that is not there.

    Examples
    --------
    >>> from glsk_o3d.samples import torus
    >>> ring = torus(1000)
    >>> truth = Truth(ring.nodes, ring.edges, ring.radii)
    >>> len(truth.nodes) == len(ring.nodes)
    True
    """

    nodes: np.ndarray
    edges: np.ndarray
    radii: np.ndarray

    def __post_init__(self):
        try:
            nodes = np.asarray(self.nodes, float).reshape(-1, 3)
            radii = np.asarray(self.radii, float).reshape(-1)
        except (TypeError, ValueError) as error:
            raise InvalidParameterError(f"the truth has nodes or radii of no use: {error}") from None
        if len(nodes) == 0:
            raise InvalidParameterError("the truth has no nodes: there is no axis to compare with")
        if len(radii) != len(nodes) or not (np.isfinite(radii) & (radii > 0)).all():
            raise InvalidParameterError("the truth must have a positive, finite radius at each of its nodes")
        edges = check_graph(nodes, self.edges, "truth")
        for name, array in (("nodes", nodes), ("edges", edges), ("radii", radii)):
            object.__setattr__(self, name, array)


def read_truth(path: str | os.PathLike) -> Truth:
    """Read a known axis.

    Parameters
    ----------
    path : path-like
        An npz archive with `nodes`, `edges` and `radii`, or any file with radii that `read_skeleton` reads.

    Returns
    -------
    Truth

    Raises
    ------
    FileNotFoundError
    FileFormatError
        It is neither, or what it holds is no axis.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from glsk_o3d.samples import torus
    >>> ring = torus(1000)
    >>> with TemporaryDirectory() as folder:
    ...     np.savez(f"{folder}/ring.npz", nodes=ring.nodes, edges=ring.edges, radii=ring.radii)
    ...     truth = read_truth(f"{folder}/ring.npz")
    >>> len(truth.edges) == len(ring.edges)
    True
    """
    path = Path(path)
    try:
        return _from_archive(path) or _from_skeleton(path)
    except InvalidParameterError as error:
        raise FileFormatError(f"{path}: {error}") from None


def _from_archive(path: Path) -> Truth | None:
    """The axis in an npz archive, None in any other file."""
    names = ("nodes", "edges", "radii")
    if path.suffix.lower() != ".npz" or not zipfile.is_zipfile(path):
        return None
    try:
        with np.load(path, allow_pickle=False) as archive:
            return Truth(*(archive[name] for name in names)) if set(names) <= set(archive.files) else None
    except (ValueError, EOFError, zipfile.BadZipFile) as error:
        if isinstance(error, InvalidParameterError):
            raise
        raise FileFormatError(f"{path}: not a valid .npz truth: {error}") from None


def _from_skeleton(path: Path) -> Truth:
    skeleton = read_skeleton(path)
    return Truth(skeleton.vertices, skeleton.edges, skeleton.radii)
