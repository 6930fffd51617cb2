"""What MeshLab's own filters are called and what they take."""

from __future__ import annotations

import re
from collections.abc import Sequence
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
    ones, white = np.ones(4), np.ones((4, 4))
    mesh = pymeshlab.Mesh(
        vertex_matrix=np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]),
        face_matrix=np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], np.int32),
        v_scalar_array=ones,
        f_scalar_array=ones,
        v_color_matrix=white,
        f_color_matrix=white,
    )
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(mesh)
    return meshes


def arguments(name: str, params: Sequence[Param], any_filter: bool = False) -> dict[str, Any]:
    """Parameters in a script as keyword arguments for a filter by pymeshlab's name, checked by pymeshlab itself.

    Filters that do not work on layers are refused without `any_filter`. ValueError has the line of the parameter as
    its second argument, or None.
    """
    if not (any_filter or name.startswith(ON_LAYERS)):
        raise ValueError(
            "it writes or reads files, or sends them: scripts run only filters that work on layers, unless "
            "any_filter=True says that this one is trusted",
            None,
        )
    if name not in require("pymeshlab").filter_list():
        raise ValueError("the pymeshlab that is installed has no such filter", None)
    known = trial().filter_parameter_values(name)
    by_name = {key.rstrip("_"): key for key in known}  # the keyword of `lambda` is `lambda_`
    found: dict[str, Any] = {}
    for param in params:
        key = by_name.get(pythonic(param.name))
        if key is None:
            raise ValueError(did_you_mean(param.name, known, "parameter"), param.line)
        if key in found:
            raise ValueError(f"parameter {param.name!r} is given twice", param.line)
        try:
            found[key] = _argument(param, key, known[key])
            _try(name, key, found[key], param.type)
        except ValueError as error:
            raise ValueError(f"parameter {param.name!r}: {error}", param.line) from None
    return found


def _argument(param: Param, key: str, default: Any) -> Any:
    """The value of a parameter as pymeshlab takes it."""
    pymeshlab, value = require("pymeshlab"), param.value(_fitting(default))
    if param.type in LENGTH:
        try:
            if isinstance(value, str):
                return pymeshlab.PercentageValue(float(value[:-1]))
            return pymeshlab.PureValue(value)
        except Exception as error:  # pymeshlab's exceptions have no base of their own
            raise ValueError(str(error)) from None
    if param.type == "RichColor":
        return pymeshlab.Color(*value)
    if isinstance(value, list):
        return np.reshape(value, np.shape(default))
    if is_layer(key, default) and value < 0:
        raise ValueError(f"there is no layer {value}")
    return value


def _try(name: str, key: str, value: Any, type: str) -> None:
    """Raise ValueError where pymeshlab does not take a value."""
    try:
        trial().filter_parameter_values(name, **{key: value})
    except Exception as error:  # as above
        reason = str(error).partition("\n")[0]
        raise ValueError(f"a {type} is not what it takes" if "Unable to cast" in reason else reason) from None


def is_layer(key: str, value: Any) -> bool:
    """Whether a parameter is the number of a layer, of which pymeshlab does not tell and which MeshLab never checks."""
    return type(value) is int and ("mesh" in key or key == "point_cloud")


def pythonic(name: str) -> str:
    """What pymeshlab makes of the name of a parameter.

    >>> pythonic("Target number (x/y)")
    'target_number_x_y'
    """
    return re.sub(r"[().,'\":+]+", "", re.sub(r"[ /-]", "_", name.lower()))


def _fitting(default: Any) -> tuple[str, ...]:
    """The types that a parameter with such a default may have in a script."""
    for kind, types in ((bool, BOOL), (int, INT), (float, FLOAT + LENGTH), (str, TEXT)):
        if isinstance(default, kind):
            return types
    if isinstance(default, np.ndarray):
        return POINT if default.size == 3 else MATRIX
    return ("RichColor",) if type(default).__name__ == "Color" else ()
