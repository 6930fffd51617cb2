"""From what a script says to what will be run: every name and value checked before anything is."""

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...errors import GlskError, InvalidParameterError, ScriptError, did_you_mean
from . import builtin
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
            message = str(error).replace("drop_invalid (--drop-invalid)", "the parameter sampler_drop_invalid")
            raise ScriptError(f"{place}filter {self.call.name!r}: {message}") from error


def step(verb: Verb, values: Mapping[str, Any]) -> Step:
    """One of our filters with its parameters, checked and as it is written into a script."""
    verb.plan(values)
    return Step(verb.name, dict(values), Call(verb.title, [verb.slots[name].written(v) for name, v in values.items()]))


def read_steps(path: str | os.PathLike[str]) -> list[Step]:
    """Read a filter script and check all of it.

    Errors are those of `read_script`; a ScriptError for a filter, parameter, type or value that is wrong names file,
    line, filter and the nearest valid name. MissingPackageError for filters of MeshLab's own without pymeshlab.
    """
    return [_step(call, path) for call in read_script(path)]


def _step(call: Call, path: str | os.PathLike[str]) -> Step:
    """A filter of a script with its values, all checked."""
    ours = {verb.title: verb for verb in verbs().values()}
    verb = ours.get(call.name)
    if verb is None and call.name not in builtin.names():
        known = [*ours, *builtin.names()]
        raise ScriptError(f"{path}, line {call.line}: {did_you_mean(call.name, known, 'filter')}")
    line, about = call.line, ""
    values: dict[str, Any] = {}
    try:
        name = verb.name if verb is not None else builtin.names()[call.name]
        slots: Mapping[str, Any] = verb.slots if verb is not None else builtin.slots(name)
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


def find_script(name: str | os.PathLike[str]) -> Path:
    """The file of a script: a path that ends in .mlx or names a folder, or the name of one that comes with the package.

    InvalidParameterError if there is none of that name.
    """
    path, known = Path(name), scripts()
    if path.suffix.lower() == ".mlx" or str(name) != path.name:
        return path
    if str(name) not in known:
        raise InvalidParameterError(f"{did_you_mean(str(name), known, 'filter script')} (a file's name ends in .mlx)")
    return known[str(name)]
