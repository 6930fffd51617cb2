"""From what a script says to what will be run: every name and value checked before anything is."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

from ..errors import GlskError, InvalidParameterError, MissingPackageError, ScriptError, did_you_mean
from ..interop.packages import require
from . import builtin
from .layers import Layer
from .script import Call, read_script
from .verb import Verb
from .verbs import verbs


@dataclass(frozen=True)
class Step:
    """A filter that is going to be run, or was.

    Attributes
    ----------
    name : str
        In Python.
    values : dict of str to object
        Keyword arguments.
    call : Call
        The same as it stands in a script.
    place : str
        File and line for messages, empty where there is no file.
    """

    name: str
    values: dict[str, Any]
    call: Call
    place: str = ""

    @property
    def verb(self) -> Verb | None:
        """None for MeshLab's own filters."""
        return verbs().get(self.name)

    @property
    def needs_pymeshlab(self) -> bool:
        """Whether it is a filter of MeshLab's own."""
        return self.verb is None

    @contextmanager
    def named_in_errors(self) -> Iterator[None]:
        """Say in every error of ours where in the script it happened."""
        try:
            yield
        except GlskError as error:
            place = f"{self.place}: " if self.place else ""
            slots = self.verb.slots if self.verb is not None else ()
            cure = next((f"its parameter {name}" for name in slots if name.endswith("drop_invalid")), "")
            said = str(error).replace("drop_invalid=True", cure or "the RingBuilder's drop_invalid")
            raise ScriptError(f"{place}filter {self.call.name!r}: {said}") from error


def step(verb: Verb, values: Mapping[str, Any]) -> Step:
    """One of our filters with its parameters, checked and as it is written into a script.

    Parameters
    ----------
    verb : Verb
    values : mapping of str to object
        Those that differ from the defaults; the script gets all of them, so that it stays true when defaults change.

    Returns
    -------
    Step

    Raises
    ------
    InvalidParameterError
    """
    params = tuple(verb.slots[name].written(value) for name, value in verb.values(values).items())
    return Step(verb.name, dict(values), Call(verb.title, params))


def read_steps(path: str | os.PathLike, any_filter: bool = False) -> list[Step]:
    """Read a filter script and check all of it.

    Parameters
    ----------
    path : path-like
    any_filter : bool
        Take also filters of MeshLab's that write, read or send files, from a script that is trusted.

    Returns
    -------
    list of Step

    Raises
    ------
    FileNotFoundError, FileFormatError
    ScriptError
        It is malformed, or a filter, parameter, type or value is wrong; the message names file, line, filter and the
        nearest valid name.
    MissingPackageError
        It has filters of MeshLab's, and pymeshlab is not there to check and run them; the message names all of them.
    """
    calls = read_script(path)
    foreign = meshlabs_own(calls, path)
    if foreign:
        try:
            require("pymeshlab")
        except MissingPackageError as error:
            raise MissingPackageError(f"{path}: {_listed(foreign)}: {error}", name=error.name) from error
    ours = {verb.title: verb for verb in verbs().values()}
    return [
        _ours(ours[call.name], call, path) if call.name in ours else _theirs(call, path, any_filter) for call in calls
    ]


def meshlabs_own(calls: Sequence[Call], path: str | os.PathLike) -> list[Call]:
    """The filters of a script that need pymeshlab; ScriptError if it has one that nobody knows.

    Parameters
    ----------
    calls : sequence of Call
    path : path-like
        The script, for messages.

    Returns
    -------
    list of Call
    """
    ours = [verb.title for verb in verbs().values()]
    foreign = [call for call in calls if call.name not in ours]
    for call in foreign:
        if call.name not in builtin.names():
            known = [*ours, *builtin.names()]
            raise ScriptError(f"{path}, line {call.line}: {did_you_mean(call.name, known, 'filter')}")
    return foreign


def _listed(calls: Sequence[Call]) -> str:
    """Such as "'Select None' (lines 3, 9), 'Close Holes' (line 5) are filters of MeshLab's own"."""
    lines: dict[str, list[str]] = {}
    for call in calls:
        lines.setdefault(call.name, []).append(str(call.line))
    told = [f"{name!r} (line{'s' * (len(at) > 1)} {', '.join(at)})" for name, at in lines.items()]
    return f"{', '.join(told)} {'are filters' if len(told) > 1 else 'is a filter'} of MeshLab's own"


def _ours(verb: Verb, call: Call, path: str | os.PathLike) -> Step:
    values = {}
    for param in call.params:
        if param.name not in verb.slots:
            raise _refused(path, call, did_you_mean(param.name, verb.slots, "parameter"), param.line)
        try:
            values[param.name] = verb.slots[param.name].read(param)
        except ValueError as error:
            raise _refused(path, call, f"parameter {param.name!r}: {error}", param.line) from None
    try:
        verb.plan(values)
    except InvalidParameterError as error:
        raise _refused(path, call, str(error)) from None
    return Step(verb.name, values, call, f"{path}, line {call.line}")


def _theirs(call: Call, path: str | os.PathLike, any_filter: bool) -> Step:
    name = builtin.names()[call.name]
    try:
        values = builtin.arguments(name, call.params, any_filter)
    except ValueError as error:
        raise _refused(path, call, *error.args) from None
    return Step(name, values, call, f"{path}, line {call.line}")


def _refused(path: str | os.PathLike, call: Call, message: str, line: int | None = None) -> ScriptError:
    return ScriptError(f"{path}, line {line or call.line}: filter {call.name!r}: {message}")


def scripts() -> dict[str, Path]:
    """The filter scripts that come with the package, by name.

    Returns
    -------
    dict of str to Path
    """
    package = Path(str(resources.files("glsk_o3d")))
    places = (package / "filters", package.parent / "filters")  # installed, and in a checkout
    folder = next((place for place in places if place.is_dir()), None)
    return {path.stem: path for path in sorted(folder.glob("*.mlx"))} if folder else {}


def find_script(name: str | os.PathLike) -> Path:
    """The file of a script: a path that ends in .mlx or names a folder, or the name of one that comes with the package.

    Such a name may end in .mlx, too, where no such file is in the working folder.

    Parameters
    ----------
    name : str or path-like

    Returns
    -------
    Path

    Raises
    ------
    InvalidParameterError
        There is no script of that name; the message says which there are.
    """
    path, known = Path(name), scripts()
    if path.suffix.lower() == ".mlx" or str(name) != path.name:
        return known.get(path.stem, path) if str(name) == path.name and not path.exists() else path
    if str(name) not in known:
        raise InvalidParameterError(f"{did_you_mean(str(name), known, 'filter script')} (a file's name ends in .mlx)")
    return known[str(name)]


class PlainLayers:
    """Layers, and our filters run on them: what a `MeshSet` does, without pymeshlab.

    Parameters
    ----------
    layer : Layer
        The first one, number 0.
    """

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
