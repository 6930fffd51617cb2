"""Known axes from files."""

from __future__ import annotations

import os
import zipfile
from pathlib import Path

import numpy as np

from ..analysis.truth import Truth
from ..errors import FileFormatError, InvalidParameterError
from .paths import existing_file
from .skeletons import read_skeleton


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
    path = existing_file(path)
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
