"""From what a script says to what will be run: every name and value checked before anything is."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import GlskError, InvalidParameterError, MissingPackageError, ScriptError, did_you_mean
from . import builtin
from .layers import Layer
from .script import VECTORS, Call, read_script
from .verbs import Verb, verbs


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


def read_steps(path: str | os.PathLike) -> list[Step]:
    """Read a filter script and check all of it.

    Parameters
    ----------
    path : path-like

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
        It has filters of MeshLab's, and pymeshlab is not there to check and run them.
    """
    return [_step(call, f"{path}, line {call.line}", path) for call in read_script(path)]


def _step(call: Call, place: str, path) -> Step:
    ours = {verb.title: verb for verb in verbs().values()}
    theirs = builtin.names()
    if call.name in ours:
        verb, values = ours[call.name], {}
        for param in call.params:
            try:
                if param.name not in verb.slots:
                    raise ValueError(did_you_mean(param.name, verb.slots, "parameter"))
                values[param.name] = verb.slots[param.name].read(param)
            except ValueError as error:
                known = f"parameter {param.name!r}: " if param.name in verb.slots else ""
                raise ScriptError(f"{path}, line {param.line}: filter {call.name!r}: {known}{error}") from None
        try:
            verb.plan(values)
        except InvalidParameterError as error:
            raise ScriptError(f"{place}: filter {call.name!r}: {error}") from None
        return Step(verb.name, values, call, place)
    if call.name not in theirs:
        raise ScriptError(f"{place}: {did_you_mean(call.name, [*ours, *theirs], 'filter')}")
    try:
        return Step(theirs[call.name], builtin.arguments(theirs[call.name], call.params), call, place)
    except MissingPackageError as error:
        raise MissingPackageError(
            f"{place}: filter {call.name!r} is MeshLab's own: {error}", name=error.name
        ) from error
    except ValueError as error:
        message, line = error.args
        raise ScriptError(f"{path}, line {line or call.line}: filter {call.name!r}: {message}") from None


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
        return path
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
        """A layer, the last one by default."""
        if number >= len(self.layers):
            raise InvalidParameterError(f"layer = {number}: there are {len(self.layers)}, counted from 0")
        return self.layers[number]

    def apply_step(self, step: Step, on_iteration: Callable[..., Any] | None = None) -> dict[str, Any]:
        """Run a filter of ours; its result becomes the last layer.

        Returns
        -------
        dict
            The result in a few numbers.
        """
        assert step.verb is not None
        with step.named_in_errors():
            layer = self.layer(step.values.get("layer", -1))
            self.layers.append(step.verb.run(layer, step.values, on_iteration))
        return {"layer": len(self.layers) - 1, **self.layers[-1].summary()}

    def save(self, path: str | os.PathLike, **options: Any) -> None:
        """Write the last layer. See ``Layer.save``."""
        self.layer().save(path, **options)


def exact_digits(step: Step, values: Mapping[str, Any]) -> Step:
    """A step of MeshLab's with the numbers that it was run with, where MeshLab itself writes six digits of them.

    Parameters
    ----------
    step : Step
    values : mapping of str to object
        By pymeshlab's names. MeshLab's numbers and vectors are float32, its matrices float64. What differs by more than
        the digits lost stays as MeshLab wrote it.

    Returns
    -------
    Step
    """

    def exact(param):
        value = values.get(builtin.keyword(param.name, values) or "")
        names = VECTORS.get(param.type, ("value",))
        if not isinstance(value, float | np.ndarray) or np.size(value) != len(names):
            return param
        numbers = dict(zip(names, map(float, np.ravel(value)), strict=True))
        if not all(math.isclose(float(param.attributes[key]), number, rel_tol=1e-5) for key, number in numbers.items()):
            return param
        return replace(param, attributes={**param.attributes, **{key: _digits(n) for key, n in numbers.items()}})

    return replace(step, call=replace(step.call, params=tuple(map(exact, step.call.params))))


def _digits(number: float) -> str:
    """The shortest text that is exactly the number, for float32 in float32."""
    short = np.float32(number)
    return str(short) if float(short) == number else repr(number)
