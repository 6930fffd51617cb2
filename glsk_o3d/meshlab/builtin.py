"""What MeshLab's own filters are called and what they take."""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import cache
from importlib import resources
from typing import Any

import numpy as np

from ..errors import did_you_mean
from ..interop.packages import require
from .script import BOOL, FLOAT, INT, LENGTH, MATRIX, POINT, TEXT, Param

ON_LAYERS = ("apply_", "compute_", "create_", "delete_", "generate_", "get_", "meshing_", "set_", "transfer_")
"""Beginnings of the names of filters that work on layers; others save, load, export or build files."""


@cache
def names() -> dict[str, str]:
    """What MeshLab calls its filters in menus and scripts, and what pymeshlab does. (pymeshlab cannot be asked.)

    Such as ``{"Select Outliers": "compute_selection_point_cloud_outliers", ...}``.
    """
    text = resources.files(__package__).joinpath("filter_names.txt").read_text("utf-8")
    pairs = (line.split(maxsplit=1) for line in text.splitlines())
    return {human: name for name, human in pairs}


@cache
def trial() -> Any:
    """A MeshSet to ask what filters take: they raise, or crash the process, where there is nothing to apply them to."""
    pymeshlab = require("pymeshlab")
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], np.int32)
    ones, white = np.ones(4), np.ones((4, 4))
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(
        pymeshlab.Mesh(
            **dict(vertex_matrix=corners, face_matrix=faces, v_scalar_array=ones, f_scalar_array=ones),
            **dict(v_color_matrix=white, f_color_matrix=white),
        )
    )
    return meshes


def defaults(name: str) -> dict[str, Any]:
    """The parameters of a filter, by pymeshlab's name, with their defaults for a mesh of size 1."""
    return dict(trial().filter_parameter_values(name))


def arguments(name: str, params: tuple[Param, ...], any_filter: bool = False) -> dict[str, Any]:
    """Parameters in a script as keyword arguments for pymeshlab, checked by pymeshlab itself.

    Parameters
    ----------
    name : str
        As pymeshlab calls the filter.
    params : tuple of Param
    any_filter : bool
        Take also filters that do not work on layers, see `ON_LAYERS`.

    Returns
    -------
    dict of str to object
        MeshLab's lengths are in the units of the mesh (``PureValue``); in percent they are a share of whatever MeshLab
        takes percentages of there (``PercentageValue``).

    Raises
    ------
    ValueError
        With the line of the parameter as its second argument, or None.
    MissingPackageError
    """
    if not (any_filter or name.startswith(ON_LAYERS)):
        raise ValueError(
            "it writes or reads files, or sends them: scripts run only filters that work on layers, unless "
            "any_filter=True says that this one is trusted",
            None,
        )
    if name not in require("pymeshlab").filter_list():
        raise ValueError("the pymeshlab that is installed has no such filter", None)
    known, found = defaults(name), {}
    for param in params:
        key = keyword(param.name, known)
        if key is None:
            raise ValueError(did_you_mean(param.name, known, "parameter"), param.line)
        if key in found:
            raise ValueError(f"parameter {param.name!r} is given twice", param.line)
        try:
            found[key] = _argument(name, key, param, known[key])
        except ValueError as error:
            raise ValueError(f"parameter {param.name!r}: {error}", param.line) from None
    return found


def _argument(name, key, param, default):
    param.check_type(_fitting(default))
    pymeshlab = require("pymeshlab")
    value = param.value()
    if param.type in LENGTH:
        try:
            percent = isinstance(value, str)
            value = pymeshlab.PercentageValue(float(value[:-1])) if percent else pymeshlab.PureValue(value)
        except Exception as error:  # here and below: pymeshlab's exceptions have no base of their own
            raise ValueError(str(error)) from None
    elif param.type == "RichColor":
        value = pymeshlab.Color(*value)
    elif isinstance(value, list):
        value = np.reshape(value, np.shape(default))
    elif is_layer(key, default) and value < 0:
        raise ValueError(f"there is no layer {value}")
    try:
        trial().filter_parameter_values(name, **{key: value})
    except Exception as error:
        reason = str(error).partition("\n")[0]
        raise ValueError(f"a {param.type} is not what it takes" if "Unable to cast" in reason else reason) from None
    return value


def keyword(name: str, known: Iterable[str]) -> str | None:
    """Which of pymeshlab's keywords a parameter in a script is, or None: its ``lambda_`` is ``lambda`` there."""
    return next((key for key in known if key.rstrip("_") == pythonic(name)), None)


def is_layer(key: str, value: Any) -> bool:
    """Whether a parameter is the number of a layer, of which pymeshlab does not tell and which MeshLab never checks."""
    return type(value) is int and ("mesh" in key or key == "point_cloud")


def pythonic(name: str) -> str:
    """What pymeshlab makes of the name of a parameter.

    Examples
    --------
    >>> pythonic("Target number (x/y)")
    'target_number_x_y'
    """
    return re.sub(r"[().,'\":+]+", "", re.sub(r"[ /-]", "_", name.lower()))


def _fitting(default) -> tuple[str, ...]:
    """The types that a parameter with such a default may have in a script."""
    for kind, types in ((bool, BOOL), (int, INT), (float, FLOAT + LENGTH), (str, TEXT)):
        if isinstance(default, kind):
            return types
    if isinstance(default, np.ndarray):
        return POINT if default.size == 3 else MATRIX
    return ("RichColor",) if type(default).__name__ == "Color" else ()
