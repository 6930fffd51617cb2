"""Cylinders of trees to files: as tables of TreeQSM and as tree files of treetools, both in metres.

A branch of TreeQSM is an axis: from where it leaves its parent to its tip. Its cylinders follow each other, counted
from 1, and the trunk is branch 1, of order 0 (Raumonen et al. 2013, https://github.com/InverseTampere/TreeQSM).

A tree file of raycloudtools and treetools (CSIRO) has, after comments and a line of names, a line per tree. It has the
root, whose parent is -1, and a segment per cylinder, its tip and radius; the cylinder reaches from the tip of the
parent, counted from 0 in its line, to its own.
"""

import io
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.io import savemat

from ..analysis.trees import Cylinders, metres
from ..interop.atomic import write_atomically
from ..numerics.vectors import unit as directions
from .formats.graphs import text
from .paths import unknown_ending

CYLINDER_ENDINGS = (".qsm.csv", ".mat", ".txt", ".csv")
"""Longer ones before those that they end in."""
SEGMENT_NAMES = ("x", "y", "z", "radius", "parent_id", "curve_length", "order")
"""Of the numbers of a segment. treetools itself adds ``length``, ``volume``, ``diameter``, ``branch`` and more, and
refuses files that have them.
"""


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
        return
    lengths = ("start_point", "end_point", "radius", "length")
    tree = replace(tree, **{name: factor * getattr(tree, name) for name in lengths})
    writers: dict[str, Callable[[Cylinders], bytes]]
    writers = {".qsm.csv": treeqsm_table, ".mat": treeqsm_matrix, ".txt": tree_file}
    data = writers[ending](tree)
    write_atomically(path, lambda temporary: temporary.write_bytes(data))


def cylinders_ending(path: str | os.PathLike) -> str:
    """The one of `CYLINDER_ENDINGS` that a file name has; FileFormatError if there is none."""
    for ending in CYLINDER_ENDINGS:
        if Path(path).name.lower().endswith(ending):
            return ending
    raise unknown_ending(Path(path), CYLINDER_ENDINGS)


def treeqsm_table(tree: Cylinders) -> bytes:
    """A CSV file that rTwig's ``run_rtwig`` and ``update_cylinders`` take for a table of TreeQSM."""
    columns = {
        f"{name}{end}": column.tolist()
        for name, array in treeqsm_fields(tree).items()
        for end, column in zip((".x", ".y", ".z") if array.shape[1] == 3 else ("",), array.T, strict=True)
    }
    rows = [columns, *zip(*columns.values(), strict=True)]
    return text(",".join(map(str, row)) for row in rows)


def treeqsm_matrix(tree: Cylinders) -> bytes:
    """A MATLAB file with TreeQSM's struct ``cylinder``, as rTwig's ``export_mat`` writes it, too."""
    stream = io.BytesIO()
    savemat(stream, {"cylinder": treeqsm_fields(tree)})
    return stream.getvalue()


def treeqsm_fields(tree: Cylinders) -> dict[str, np.ndarray]:
    """The fields of TreeQSM's struct ``cylinder``, sorted by branch: (K, 1) or (K, 3) arrays by name.

    Numbers of cylinders and branches count from 1, 0 stands for none. Where several cylinders grow from the root
    the first is the parent of the others: TreeQSM knows one without.
    """
    k = len(tree)
    begins = (tree.parent < 0) | (tree.order != tree.order[tree.parent])
    axis = np.cumsum(begins)
    for row in np.flatnonzero(~begins).tolist():  # parents come first
        axis[row] = axis[tree.parent[row]]
    sort = np.argsort(axis, kind="stable")
    number = np.argsort(sort) + 1
    axis, first = axis[sort], np.r_[True, np.diff(axis[sort]) > 0]
    parent = np.where(tree.parent < 0, 1, number[tree.parent])[sort]
    parent[0] = 0
    position = np.arange(k) - np.flatnonzero(first)[axis - 1] + 1
    last = np.r_[first[1:], True]
    columns = {
        "radius": tree.radius[sort],
        "length": tree.length[sort],
        "start": tree.start_point[sort],
        "axis": directions(tree.end_point - tree.start_point)[sort],
        "parent": parent,
        "extension": np.where(last, 0, np.arange(k) + 2),
        "added": np.zeros(k, int),
        "UnmodRadius": tree.radius[sort],
        "branch": axis,
        "BranchOrder": tree.order[sort],
        "PositionInBranch": position,
    }
    return {name: column.reshape(k, -1) for name, column in columns.items()}


def tree_file(*trees: Cylinders) -> bytes:
    """A tree file of raycloudtools and treetools, a line per tree; lengths in metres."""
    lines = ["# trees written by glsk-o3d, in metres", ",".join(SEGMENT_NAMES)]
    for tree in trees:
        root = (*tree.start_point[0].tolist(), float(tree.radius[0]), -1, 0.0, 0)
        columns = (*tree.end_point.T, tree.radius, tree.parent + 1, tree.length, tree.order)
        segments = zip(*(column.tolist() for column in columns), strict=True)
        lines.append(", ".join(",".join(map(str, segment)) for segment in (root, *segments)))
    return text(lines)
