"""What `glsk_o3d.editing` does to skeletons, for MeshLab: a verb for each function, with its parameters."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from .. import editing
from ..errors import InvalidCloudError, InvalidParameterError
from ..io.formats.graphs import graph_skeleton
from ..numerics.vectors import AXES
from ..parameters import resolve_length
from ..skeleton import Skeleton
from .verb import Slot, Verb, called, facts_of

_EDITS = {
    "generate_largest_skeleton_component": editing.largest_component,
    "generate_skeleton_without_loops": editing.cut_loops,
    "generate_rerooted_skeleton": editing.reroot,
    "generate_pruned_skeleton": editing.prune,
    "generate_smoothed_skeleton": editing.smooth,
    "generate_simplified_skeleton": editing.simplify,
}
_EDIT_PARAMETERS = {
    "length": facts_of("Least length of a branch that ends, from junction to tip.", "length", low=0),
    "radius": facts_of("Least mean radius of a branch that ends.", "length", low=0),
    "order": facts_of("Highest order of branches that stays: 0 for the stem alone.", "int?", low=0),
    "passes": facts_of("How often; more passes make longer waves disappear.", "int", low=0),
    "tolerance": facts_of("How far a dropped vertex may be from the simpler curve.", "length?", low=0),
    "n": facts_of("How many vertices to keep, in place of a tolerance.", "int?", low=1),
}
_ROOT = "Where the tree grows from: the lowest vertex along an axis, the thickest end, a vertex, or a point."


@dataclass(frozen=True)
class RootSlot(Slot):
    """Where a tree grows from: in words, a point, or a vertex by its number."""

    @property
    def types(self):
        return ("RichString", "RichInt", "RichPosition")

    def checked(self, value):
        if isinstance(value, np.generic):
            value = value.item()
        if isinstance(value, str) and value.isdecimal():
            return int(value)
        if isinstance(value, list | tuple | np.ndarray):
            value = ",".join(map(str, np.ravel(value).tolist()))
        if type(value) is int and value >= 0:
            return value
        try:
            return super().checked(value)
        except ValueError as error:
            raise ValueError(f"{error}, or the number of a vertex") from None


@dataclass(frozen=True)
class EditVerb(Verb):
    """A skeleton changed by a function."""

    function: Callable[..., Any]

    def plan(self, values):
        made = self.values(values)
        del made["layer"]
        # tried on a line, since the function knows best what goes together; which vertices there are nobody knows yet
        self._applied(_line(), {name: value for name, value in made.items() if name != "root"}, 1.0)
        return made

    def run(self, layer, given, on_iteration=None):
        made = self.plan(given)
        if not layer.is_skeleton:
            cure = "make one with generate_curve_skeleton_glsk, or name its layer"
            raise InvalidCloudError(f"the layer ({layer.label}) is no skeleton: {cure}")
        try:
            found = self._applied(layer.to_skeleton(), made, layer.diagonal)
        except InvalidParameterError as error:
            cure = "cut them with generate_skeleton_without_loops_glsk"
            raise InvalidParameterError(str(error).replace("see cut_loops()", cure)) from None
        skeleton, *cut = found if isinstance(found, tuple) else (found,)
        told = {"cut": cut[0].mean(axis=1).tolist()} if cut else {}
        return dataclasses.replace(self.shown(skeleton, layer.source or layer), told=told)

    def _applied(self, skeleton: Skeleton, made: dict[str, Any], diagonal: float) -> Any:
        lengths = {name: value for name, value in made.items() if self.slots[name].is_of_box(value)}
        lengths = {name: resolve_length(value, diagonal) for name, value in lengths.items()}
        return self.function(skeleton, **{**made, **lengths})


@cache
def _line() -> Skeleton:
    return graph_skeleton(np.eye(2, 3), [[0, 1]], np.ones(2))


def edits() -> list[EditVerb]:
    """A verb for each function of `glsk_o3d.editing`, with the names and defaults of its parameters."""
    found = []
    for stem, function in _EDITS.items():
        doc = (inspect.getdoc(function) or "").partition("\n\n")[0].replace("\n", " ").replace("`", "")
        found.append(EditVerb(*called(stem), doc, {slot.name: slot for slot in _slots(function)}, function))
    return found


def _slots(function: Callable[..., Any]) -> Iterator[Slot]:
    _, *parameters = inspect.signature(function).parameters.values()
    for each in parameters:
        if each.name == "root":
            kind = "point?" if each.default is None else "point"
            yield RootSlot("root", facts_of(_ROOT, kind, (*AXES, "thickest")), default=each.default)
        else:
            yield Slot(each.name, _EDIT_PARAMETERS[each.name], default=each.default)
