"""From what a script says to what will be run: every name and value checked before anything is."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path
from typing import Any

from ..errors import GlskError, InvalidParameterError, MissingPackageError, ScriptError, did_you_mean
from ..interop.packages import require
from . import builtin
from .layers import Layer
from .script import Call, Param, read_script
from .slots import Slot, facts_of
from .verbs import Verb, verbs

CHANGE_LAYER = "Change the current layer"
"""A filter of MeshLab 2016, which had it for scripts; today's has none."""
_CHANGED = {"mesh": Slot("mesh", facts_of("The layer to go on with.", "int", low=0))}


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
        """None for MeshLab's own filters, and where the layer is changed."""
        return verbs().get(self.name)

    @property
    def goes_to(self) -> int | None:
        """The layer that becomes the current one, where that is all."""
        return self.values["mesh"] if self.call.name == CHANGE_LAYER else None

    @property
    def needs_pymeshlab(self) -> bool:
        """Whether it is a filter of MeshLab's own."""
        return self.verb is None and self.goes_to is None

    @contextmanager
    def named_in_errors(self) -> Iterator[None]:
        """Say in every error of ours where in the script it happened."""
        try:
            yield
        except ScriptError:
            raise
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


def change_of_layer(number: int) -> Step:
    """What makes another layer the current one.

    Parameters
    ----------
    number : int

    Returns
    -------
    Step
    """
    return Step(
        "set_current_mesh", {"mesh": number}, Call(CHANGE_LAYER, (Param("mesh", "RichMesh", {"value": str(number)}),))
    )


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
    return [_step(call, path, any_filter) for call in calls]


def meshlabs_own(calls: Sequence[Call], path: str | os.PathLike) -> list[Call]:
    """The filters of a script that need pymeshlab.

    Parameters
    ----------
    calls : sequence of Call
    path : path-like
        The script, for messages.

    Returns
    -------
    list of Call

    Raises
    ------
    ScriptError
        It has a filter that nobody knows.
    """
    ours = {CHANGE_LAYER, *(verb.title for verb in verbs().values())}
    foreign = [call for call in calls if call.name not in ours]
    for call in foreign:
        if call.name not in builtin.names():
            known = [*ours, *builtin.names()]
            raise ScriptError(f"{path}, line {call.line}: {did_you_mean(call.name, known, 'filter')}")
    return foreign


def _listed(calls: Sequence[Call]) -> str:
    """Such as "'Select None' (lines 3, 9) and 'Close Holes' (line 5) are filters of MeshLab's own"."""
    lines: dict[str, list[str]] = {}
    for call in calls:
        lines.setdefault(call.name, []).append(str(call.line))
    told = [f"{name!r} (line{'s' * (len(at) > 1)} {', '.join(at)})" for name, at in lines.items()]
    told = [", ".join(told[:-1]), told[-1]] if len(told) > 1 else told
    return " and ".join(told) + (" are filters of MeshLab's own" if len(lines) > 1 else " is a filter of MeshLab's own")


def _step(call: Call, path, any_filter: bool) -> Step:
    place = f"{path}, line {call.line}"
    verb = next((verb for verb in verbs().values() if verb.title == call.name), None)
    if verb is not None:
        values = _values(verb.slots, call, path)
        try:
            verb.plan(values)
        except InvalidParameterError as error:
            raise ScriptError(f"{place}: filter {call.name!r}: {error}") from None
        return Step(verb.name, values, call, place)
    if call.name == CHANGE_LAYER:
        values = _values(_CHANGED, call, path)
        if not values:
            raise ScriptError(f"{place}: filter {call.name!r}: its parameter 'mesh' is not there: which layer?")
        return replace(change_of_layer(values["mesh"]), place=place)
    name = builtin.names()[call.name]
    try:
        return Step(name, builtin.arguments(name, call.params, any_filter), call, place)
    except ValueError as error:
        message, line = error.args
        raise ScriptError(f"{path}, line {line or call.line}: filter {call.name!r}: {message}") from None


def _values(slots: Mapping[str, Slot], call: Call, path) -> dict[str, Any]:
    values = {}
    for param in call.params:
        try:
            if param.name not in slots:
                raise ValueError(did_you_mean(param.name, slots, "parameter"))
            values[param.name] = slots[param.name].read(param)
        except ValueError as error:
            known = f"parameter {param.name!r}: " if param.name in slots else ""
            raise ScriptError(f"{path}, line {param.line}: filter {call.name!r}: {known}{error}") from None
    return values


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
        self.layers, self.current = [layer], 0

    def layer(self, number: int = -1) -> Layer:
        """A layer, the current one by default."""
        if number >= len(self.layers):
            raise InvalidParameterError(f"layer = {number}: there are {len(self.layers)}, counted from 0")
        return self.layers[self.current if number == -1 else number]

    def apply_step(self, step: Step, on_iteration: Callable[..., Any] | None = None) -> dict[str, Any]:
        """Run a filter of ours, whose result becomes the current layer, or make another layer the current one.

        Returns
        -------
        dict
            The result in a few numbers.
        """
        with step.named_in_errors():
            if step.goes_to is not None:
                self.layer(step.goes_to)
                self.current = step.goes_to
                return {"layer": self.current}
            assert step.verb is not None
            layer = self.layer(step.values.get("layer", -1))
            self.layers.append(step.verb.run(layer, step.values, on_iteration))
        self.current = len(self.layers) - 1
        return {"layer": self.current, **self.layer().summary()}

    def save(self, path: str | os.PathLike, **options: Any) -> None:
        """Write the current layer. See ``Layer.save``."""
        self.layer().save(path, **options)
