"""What MeshLab's own filters are called and what they take."""

import re
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any

import numpy as np

from ...interop.packages import require
from .script import Param

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


@dataclass(frozen=True)
class Builtin:
    """A parameter of a filter of MeshLab's, by pymeshlab's names, with its default."""

    filter: str
    name: str
    default: Any

    def read(self, param: Param) -> Any:
        """The value of a parameter in a script as pymeshlab takes it, who is asked; ValueError if it is wrong."""
        try:
            value = self._value(param.text, param.type in ("RichAbsPerc", "RichPercentage"))
            trial().filter_parameter_values(self.filter, **{self.name: value})
        except Exception as error:  # pymeshlab's exceptions have no base of their own
            raise ValueError(f"{param.text!r}: " + str(error).partition("\n")[0]) from None
        if is_layer(self.name, self.default) and value < 0:
            raise ValueError(f"there is no layer {value}")
        return value

    def _value(self, text: str, is_length: bool) -> Any:
        pymeshlab, kind = require("pymeshlab"), type(self.default)
        if is_length:
            share = text.endswith("%")
            return pymeshlab.PercentageValue(float(text[:-1])) if share else pymeshlab.PureValue(float(text))
        if kind is bool:
            return {"true": True, "false": False}[text.lower()]
        if kind is np.ndarray:
            return np.reshape(list(map(float, text.split(","))), self.default.shape)
        return kind(*map(int, text.split(","))) if kind is pymeshlab.Color else kind(text)


def slots(filter: str) -> dict[str, Builtin]:
    """The parameters of a filter by pymeshlab's name, as `pythonic` has their names.

    Filters that do not work on layers are refused by a ValueError.
    """
    if not filter.startswith(ON_LAYERS):
        raise ValueError(
            "it writes or reads files, or sends them: scripts run only filters that work on layers; call it in Python"
        )
    if filter not in require("pymeshlab").filter_list():
        raise ValueError("the pymeshlab that is installed has no such filter")
    defaults = trial().filter_parameter_values(filter)
    return {name.rstrip("_"): Builtin(filter, name, value) for name, value in defaults.items()}  # as `lambda_`


def is_layer(key: str, value: Any) -> bool:
    """Whether a parameter is the number of a layer, of which pymeshlab does not tell and which MeshLab never checks."""
    return type(value) is int and ("mesh" in key or key == "point_cloud")


def pythonic(name: str) -> str:
    """What pymeshlab makes of the name of a parameter.

    >>> pythonic("Target number (x/y)")
    'target_number_x_y'
    """
    return re.sub(r"[().,'\":+]+", "", re.sub(r"[ /-]", "_", name.lower()))
