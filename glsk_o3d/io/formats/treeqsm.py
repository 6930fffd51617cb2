"""The cylinder table of TreeQSM, as CSV for rTwig and as a MATLAB file: keeps cylinders, parents and orders.

A branch of TreeQSM is an axis: from where it leaves its parent to its tip. Its cylinders follow each other, counted
from 1, and the trunk is branch 1, of order 0 (Raumonen et al. 2013, https://github.com/InverseTampere/TreeQSM).
"""

from __future__ import annotations

import csv
import io

import numpy as np
from scipy.io import savemat

from ...analysis.tree_cylinders import Cylinders
from ...numerics.vectors import unit


def write_csv(tree: Cylinders) -> bytes:
    """The content of a CSV file that rTwig's ``run_rtwig`` and ``update_cylinders`` take for a table of TreeQSM.

    Parameters
    ----------
    tree : Cylinders
        In metres, as rTwig takes lengths.

    Returns
    -------
    bytes

    Examples
    --------
    >>> from glsk_o3d import Skeleton
    >>> from glsk_o3d.analysis import cylinders
    >>> stem = Skeleton([[0, 0, 0], [0, 0, 0.5]], [[0, 1]], [0.125, 0.125], (), (), ())
    >>> print(write_csv(cylinders(stem)).decode().splitlines()[1])
    0.125,0.5,0.0,0.0,0.0,0.0,0.0,1.0,0,0,0,0.125,1,0,1
    """
    columns = {
        f"{name}{end}": column.tolist()
        for name, array in fields(tree).items()
        for end, column in zip((".x", ".y", ".z") if array.shape[1] == 3 else ("",), array.T, strict=True)
    }
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerows([columns, *zip(*columns.values(), strict=True)])
    return stream.getvalue().encode()


def write_mat(tree: Cylinders) -> bytes:
    """The content of a MATLAB file with TreeQSM's struct ``cylinder``, as rTwig's ``export_mat`` writes it, too.

    Parameters
    ----------
    tree : Cylinders
        In metres.

    Returns
    -------
    bytes

    Examples
    --------
    >>> from glsk_o3d import Skeleton
    >>> from glsk_o3d.analysis import cylinders
    >>> stem = Skeleton([[0, 0, 0], [0, 0, 0.5]], [[0, 1]], [0.125, 0.125], (), (), ())
    >>> write_mat(cylinders(stem))[:10]
    b'MATLAB 5.0'
    """
    stream = io.BytesIO()
    savemat(stream, {"cylinder": fields(tree)})
    return stream.getvalue()


def fields(tree: Cylinders) -> dict[str, np.ndarray]:
    """The fields of TreeQSM's struct ``cylinder``, sorted by branch.

    Parameters
    ----------
    tree : Cylinders

    Returns
    -------
    dict of str to (K, 1) or (K, 3) array
        Numbers of cylinders and branches count from 1, 0 stands for none. Where several cylinders grow from the root
        the first is the parent of the others: TreeQSM knows one without.

    Examples
    --------
    >>> from glsk_o3d import Skeleton
    >>> from glsk_o3d.analysis import cylinders
    >>> stem = Skeleton([[0, 0, 0], [0, 0, 1]], [[0, 1]], [0.125, 0.125], (), (), ())
    >>> fields(cylinders(stem))["extension"].ravel().tolist()
    [2, 0]
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
        "axis": unit(tree.end_point - tree.start_point)[sort],
        "parent": parent,
        "extension": np.where(last, 0, np.arange(k) + 2),
        "added": np.zeros(k, int),
        "UnmodRadius": tree.radius[sort],
        "branch": axis,
        "BranchOrder": tree.order[sort],
        "PositionInBranch": position,
    }
    return {name: column.reshape(k, -1) for name, column in columns.items()}
