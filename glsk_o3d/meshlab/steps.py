"""From what a script says to what will be run: every name and value checked before anything is."""

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import GlskError, InvalidParameterError, MissingPackageError, ScriptError, did_you_mean
from ..interop.packages import require
from . import builtin
from .layers import Layer
from .script import Call, read_script, scripts
from .verbs import Verb, verbs


@dataclass(frozen=True)
class Step:
    """A filter that is going to be run, or was: its name and keyword arguments in Python, and as it stands in a script.

    `place` is its file and line for messages, empty where there is no file.
    """

    name: str
    values: dict[str, Any]
    call: Call
    place: str = ""

    @property
    def verb(self) -> Verb | None:
        """None for MeshLab's own filters."""
        return verbs().get(self.name)

    @contextmanager
    def named_in_errors(self) -> Iterator[None]:
        """Say in every error of ours where in the script it happened."""
        try:
            yield
        except GlskError as error:
            place = f"{self.place}: " if self.place else ""
            said = str(error).replace("drop_invalid=True", "the parameter sampler_drop_invalid")
            raise ScriptError(f"{place}filter {self.call.name!r}: {said}") from error


def step(verb: Verb, values: Mapping[str, Any]) -> Step:
    """One of our filters with its parameters, checked and as it is written into a script."""
    verb.plan(values)
    return Step(verb.name, dict(values), Call(verb.title, [verb.slots[name].written(v) for name, v in values.items()]))


def read_steps(path: str | os.PathLike, any_filter: bool = False) -> list[Step]:
    """Read a filter script and check all of it; `any_filter` takes also filters that write, read or send files.

    Errors are those of `read_script`; a ScriptError for a filter, parameter, type or value that is wrong names file,
    line, filter and the nearest valid name. A MissingPackageError names the filters of MeshLab's own that need
    pymeshlab, where it is not there to check and run them.
    """
    calls = read_script(path)
    foreign = meshlabs_own(calls, path)
    if foreign:
        try:
            require("pymeshlab")
        except MissingPackageError as error:
            listed = ", ".join(f"{call.name!r} (line {call.line})" for call in foreign)
            raise MissingPackageError(f"{path}: MeshLab's own filters {listed}: {error}", name=error.name) from error
    return [_step(call, path, any_filter) for call in calls]


def meshlabs_own(calls: Sequence[Call], path: str | os.PathLike) -> list[Call]:
    """The filters of a script that need pymeshlab; ScriptError if it has one that nobody knows."""
    ours = [verb.title for verb in verbs().values()]
    foreign = [call for call in calls if call.name not in ours]
    for call in foreign:
        if call.name not in builtin.names():
            known = [*ours, *builtin.names()]
            raise ScriptError(f"{path}, line {call.line}: {did_you_mean(call.name, known, 'filter')}")
    return foreign


def _step(call: Call, path: str | os.PathLike, any_filter: bool) -> Step:
    """A filter of a script with its values, all checked."""
    verb = next((verb for verb in verbs().values() if verb.title == call.name), None)
    line, about = call.line, ""
    values: dict[str, Any] = {}
    try:
        name = verb.name if verb is not None else builtin.names()[call.name]
        slots: Mapping[str, Any] = verb.slots if verb is not None else builtin.slots(name, any_filter)
        for param in call.params:
            line, about = param.line, f"parameter {param.name!r}: "
            spelled = param.name if verb is not None else builtin.pythonic(param.name)
            if spelled not in slots:
                raise ValueError(did_you_mean(param.name, slots, "parameter"))
            if slots[spelled].name in values:
                raise ValueError("is given twice")
            values[slots[spelled].name] = slots[spelled].read(param)
        line, about = call.line, ""
        if verb is not None:
            verb.plan(values)
    except ValueError as error:  # InvalidParameterError, too
        raise ScriptError(f"{path}, line {line}: filter {call.name!r}: {about}{error}") from None
    return Step(name, values, call, f"{path}, line {call.line}")


def find_script(name: str | os.PathLike) -> Path:
    """The file of a script: a path that ends in .mlx or names a folder, or the name of one that comes with the package.

    Such a name may end in .mlx, too, where no such file is in the working folder. InvalidParameterError if there is
    none of that name.
    """
    path, known = Path(name), scripts()
    if path.suffix.lower() == ".mlx" or str(name) != path.name:
        return known.get(path.stem, path) if str(name) == path.name and not path.exists() else path
    if str(name) not in known:
        raise InvalidParameterError(f"{did_you_mean(str(name), known, 'filter script')} (a file's name ends in .mlx)")
    return known[str(name)]


class PlainLayers:
    """Layers by number, and our filters run on them: what a `MeshSet` does, without pymeshlab."""

    def __init__(self, layer: Layer):
        self.layers = [layer]

    def layer(self, number: int = -1) -> Layer:
        """A layer; -1 is the current one, which is the last."""
        if number >= len(self.layers):
            raise InvalidParameterError(f"layer = {number}: there are {len(self.layers)}, counted from 0")
        return self.layers[number]

    def apply_step(self, step: Step, on_iteration: Callable[..., Any] | None = None) -> dict[str, Any]:
        """Run a filter of ours, whose result becomes the current layer, and give the result in a few numbers."""
        with step.named_in_errors():
            assert step.verb is not None
            layer = self.layer(step.values.get("layer", -1))
            self.layers.append(step.verb.run(layer, step.values, on_iteration))
        return {"layer": len(self.layers) - 1, **self.layer().summary()}

    def save(self, path: str | os.PathLike, **options: Any) -> None:
        """Write the current layer. See ``Layer.save``."""
        self.layer().save(path, **options)
