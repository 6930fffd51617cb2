"""What `glsk_o3d.editing` does to skeletons, for MeshLab: a verb for each function, made from its signature."""

from __future__ import annotations

import dataclasses
import inspect
import re
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
from .slots import OF_FRAME, Slot, facts_of
from .verb import WHOLE, Verb, called

_EDITS: dict[str, Callable[..., Any]] = {
    "generate_largest_skeleton_component": editing.largest_component,
    "generate_skeleton_without_loops": editing.cut_loops,
    "generate_rerooted_skeleton": editing.reroot,
    "generate_pruned_skeleton": editing.prune,
    "generate_smoothed_skeleton": editing.smooth,
    "generate_simplified_skeleton": editing.simplify,
}


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

    def checked(self, values):
        for name, value in values.items():
            if isinstance(value, str) and value.endswith(OF_FRAME):
                raise InvalidParameterError(
                    f"{name} = {value!r}: frames are of scans; of a skeleton percentages are of the box of its layer: "
                    f"{value.removesuffix(OF_FRAME)!r}"
                )
        return super().checked(values)

    def plan(self, values):
        made = self.values(values)
        del made["layer"]
        # nobody knows yet which vertices there are, and the function knows best what goes together
        self._applied(_line(), {name: value for name, value in made.items() if name != "root"}, 1.0)
        return made

    def run(self, layer, given, on_iteration=None):
        made = self.plan(given)
        if not layer.is_skeleton:
            raise InvalidCloudError(
                f"the layer ({layer.label}) is no skeleton: make one with {called(WHOLE)[0]}, or name its layer"
            )
        try:
            found = self._applied(layer.to_skeleton(), made, layer.diagonal)
        except InvalidParameterError as error:
            cure = f"cut them with {called('generate_skeleton_without_loops')[0]}"
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
    """A verb for each function, with the names, defaults and sentences of its parameters."""
    found = []
    for stem, function in _EDITS.items():
        text = inspect.getdoc(function) or ""
        doc = text.partition("\n\n")[0].replace("\n", " ").replace("`", "")
        found.append(EditVerb(*called(stem), doc, {slot.name: slot for slot in _slots(function, text)}, function))
    return found


def _slots(function: Callable[..., Any], text: str) -> Iterator[Slot]:
    section = text.partition("Parameters\n----------\n")[2].partition("\n\n")[0]
    told = {name: " ".join(said.split()) for name, said in re.findall(r"^(\w+) : .*\n((?: +.*\n?)*)", section, re.M)}
    _, *parameters = inspect.signature(function).parameters.values()
    for each in parameters:
        doc, may_be_none = told.get(each.name, "").replace("`", ""), "?" * (each.default is None)
        if each.name == "root":
            yield RootSlot("root", facts_of(doc, f"point{may_be_none}", (*AXES, "thickest")), default=each.default)
            continue
        kind = "length" if each.annotation.startswith("float") else "int"  # every float of theirs is one
        yield Slot(each.name, facts_of(doc, kind + may_be_none, low=int(each.name == "n")), default=each.default)
