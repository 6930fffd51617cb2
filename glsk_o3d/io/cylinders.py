"""Tables of cylinders to files: the endings, and what they are read by."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from ..analysis.forestry import metres
from ..analysis.tree_cylinders import Cylinders
from ..interop.atomic import write_atomically
from .formats import treeqsm, treetools
from .paths import unknown_ending

IN_METRES: dict[str, Callable[[Cylinders], bytes]] = {
    ".qsm.csv": treeqsm.write_csv,
    ".mat": treeqsm.write_mat,
    ".txt": treetools.write,
}
"""Formats of other programs, which take lengths for metres, by the ending of the file."""
CYLINDER_ENDINGS = (*IN_METRES, ".csv")
"""All endings, longer ones before those that they end in."""


def save_cylinders(tree: Cylinders, path: str | os.PathLike, unit: float | str = 1.0) -> None:
    """Write cylinders to a file; the ending chooses the format.

    ========= ============================================== ================
    ending    read by                                        lengths
    ========= ============================================== ================
    .csv      spreadsheets, pandas; as `Cylinders.to_csv`    the cloud's
    .qsm.csv  rTwig (R), as a table of TreeQSM               metres
    .mat      TreeQSM (MATLAB): the struct ``cylinder``      metres
    .txt      raycloudtools, treetools: a tree file          metres
    ========= ============================================== ================

    Parameters
    ----------
    tree : Cylinders
    path : path-like
        Appears complete or not at all.
    unit : float or {"m", "cm", "mm", "in", "ft"}
        One unit of the cloud, in metres or by its name.

    Raises
    ------
    FileFormatError
        The ending is unknown.
    InvalidParameterError
        `unit` is neither positive nor one of these.
    OSError
        The folder does not exist, or the file cannot be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from glsk_o3d import pipelines
    >>> from glsk_o3d.analysis import cylinders
    >>> from glsk_o3d.samples import y_junction
    >>> table = cylinders(pipelines.tree()(y_junction(2000).points))
    >>> with TemporaryDirectory() as folder:
    ...     save_cylinders(table, f"{folder}/y.txt")
    ...     Path(f"{folder}/y.txt").read_text().splitlines()[1]
    'x,y,z,radius,parent_id,curve_length,order'
    """
    ending, factor = cylinders_ending(path), metres(unit)
    if ending == ".csv":
        tree.to_csv(path)
    else:
        data = IN_METRES[ending](scaled(tree, factor))
        write_atomically(path, lambda temporary: temporary.write_bytes(data))


def cylinders_ending(path: str | os.PathLike) -> str:
    """The one of `CYLINDER_ENDINGS` that a file name has; FileFormatError if there is none.

    Examples
    --------
    >>> cylinders_ending("oak.QSM.csv"), cylinders_ending("qsm.csv")
    ('.qsm.csv', '.csv')
    """
    name = Path(path).name.lower()
    found = [ending for ending in CYLINDER_ENDINGS if name.endswith(ending)]
    if not found:
        raise unknown_ending(Path(path), CYLINDER_ENDINGS)
    return found[0]


def scaled(tree: Cylinders, factor: float) -> Cylinders:
    """The same cylinders in another unit: all lengths times a factor.

    Examples
    --------
    >>> from glsk_o3d import Skeleton
    >>> from glsk_o3d.analysis import cylinders
    >>> stem = Skeleton([[0, 0, 0], [0, 0, 500]], [[0, 1]], [125, 125], (), (), ())
    >>> scaled(cylinders(stem), 0.001).length.tolist()
    [0.5]
    """
    lengths = ("start_point", "end_point", "radius", "length")
    return replace(tree, **{name: factor * getattr(tree, name) for name in lengths})
