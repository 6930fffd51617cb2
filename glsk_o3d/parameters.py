"""Parameters of filters and stopping rules, which describe and check themselves."""

import dataclasses
import inspect
import math
import re
from collections.abc import Mapping
from numbers import Integral, Rational, Real
from typing import Any, ClassVar, TypeVar

from .errors import InvalidParameterError

__all__ = ["Parameters", "documented", "parameter", "resolve_length"]  # what plugins use

_Class = TypeVar("_Class", bound=type)

LARGEST_WHOLE = 2**63 - 1  # derived: of the numbers that NumPy counts with
LARGEST, SMALLEST_LENGTH = 1e100, 1e-100  # derived: a float64 holds their cubes
LONGEST_SHOWN = 200  # fitted: characters of a value that say what was meant


def parameter(
    default: Any,
    doc: str,
    *,
    type: str | None = None,
    unit: str = "-",
    low: float | None = None,
    high: float | None = None,
    open_low: bool = False,
    choices: tuple[str, ...] = (),
) -> Any:
    """A dataclass field that carries its own documentation and limits.

    Parameters
    ----------
    default : object
    doc : str
        One sentence; it appears in the class's docstring and in ``glsk filters``.
    type : {"int", "float", "bool", "length", "point", "choice", "reducer", "stop"}, optional
        By default that of `default`, of a string "choice". A length is a float in the cloud's units or a string such
        as ``"2%"`` of the diagonal of the box that `Sampler.frame` names, a point ``(0.5, 0, 2)`` or ``"0.5,0,2"``.
        A trailing ``?`` allows None.
    unit : str
    low, high : float, optional
        Inclusive limits (`low` is exclusive with `open_low`), which do not apply to a length in percent.
    open_low : bool
    choices : tuple of str
        The values of the type ``"choice"``; any other type may also be one of these words.
    """
    kind = type or ("choice" if isinstance(default, str) else default.__class__.__name__)
    facts = dict(doc=doc, type=kind, unit=unit, low=low, high=high, open_low=open_low, choices=choices)
    return dataclasses.field(default=default, metadata=facts)


def allowed_values(facts: Mapping[str, Any]) -> str:
    """Type, unit and limits in words, such as ``"'auto' or int [points], at least 4"``, of a field's metadata."""
    kinds = [repr(choice) for choice in facts["choices"]]
    kinds += [facts["type"].replace("?", " or None")] * (facts["type"] != "choice")
    words = [" or ".join(kinds) + f" [{facts['unit']}]" * (facts["unit"] != "-")]
    if facts["low"] is not None:
        words.append(f"{'above' if facts['open_low'] else 'at least'} {facts['low']:g}")
    if facts["high"] is not None:
        words.append(f"at most {facts['high']:g}")
    return ", ".join(words)


def documented(cls: _Class) -> _Class:
    """Class decorator: append the numpydoc "Parameters" section made from the fields' own facts.

    The docstrings of this package's own classes also name the page of the options.

    Parameters
    ----------
    cls : dataclass
        All of whose fields are made by `parameter`; it is returned.
    """
    lines = []
    for field in dataclasses.fields(cls):
        words, doc = allowed_values(field.metadata), field.metadata["doc"]
        lines += [f"{field.name} : {words}, default {field.default!r}", f"    {doc}"]
    if lines:
        text = inspect.cleandoc(cls.__doc__ or "")
        if is_own(cls):
            page = f"docs/filters/{cls.__module__.rpartition('.')[2]}.md"
            prose, *rest = re.split(r"(?=\n\n\w[\w ]*\n-{3,}\n)", text, maxsplit=1)
            text = f"{prose}\n\nEvery option, and when to touch it: {page}.{''.join(rest)}"
        cls.__doc__ = f"{text}\n\nParameters\n----------\n" + "\n".join(lines) + "\n"
    return cls


def is_own(cls: type) -> bool:
    """Whether a class is of this package, not of a plugin."""
    return cls.__module__.startswith(f"{__package__}.")


NONE, UNWRITTEN, FROM = "none", "unwritten", "from"
RESERVED_WORDS = ("filter", "rule", UNWRITTEN, FROM)
"""Names that no parameter has, since recipes use them."""


class Parameters:
    """Mixin of frozen dataclasses whose fields are made by `parameter`: they are checked when it is made."""

    kind: ClassVar[str] = "rule"
    """What a recipe calls it."""

    def __post_init__(self) -> None:
        self.check()

    def check(self) -> None:
        """Raise InvalidParameterError if a parameter has the wrong type or is out of range."""
        for field in dataclasses.fields(self):  # type: ignore[arg-type]
            value = getattr(self, field.name)
            problem = problem_with(value, field.metadata)
            if problem:
                raise InvalidParameterError(f"{type(self).__name__}.{field.name} = {shown(value)}: {problem}")
            if isinstance(value, Parameters):
                value.check()

    def table(self) -> dict[str, Any]:
        """Name and parameters as a plain table for a recipe.

        Returns
        -------
        dict
            Of dicts, strings, numbers and bools, with the class under ``"filter"`` or ``"rule"`` and, unless it is of
            this package, its module under ``"from"``. A value that a file cannot hold is a table with the key
            ``"unwritten"``, which names it.
        """
        cls = type(self)
        origin = {} if is_own(cls) else {FROM: cls.__module__}
        names = [field.name for field in dataclasses.fields(self)]  # type: ignore[arg-type]
        return {self.kind: cls.__name__, **origin, **{name: _plain(getattr(self, name)) for name in names}}


def _plain(value: Any) -> Any:
    """A value as files hold it."""
    if value is None:
        return NONE
    if isinstance(value, Parameters):
        return value.table()
    if isinstance(value, tuple) and resolve_point(value):
        return ",".join(map(repr, map(float, value)))
    plain_types: tuple[tuple[type, Any], ...] = ((str, str.__str__), (bool, bool), (Integral, int), (Real, float))
    for kind, plain in plain_types:
        if isinstance(value, kind):
            return plain(value)
    named, article = (value, "") if hasattr(value, "__qualname__") else (type(value), "a ")
    return {UNWRITTEN: f"{article}{named.__module__}.{named.__qualname__} is no number, word, filter or rule"}


def shown(value: Any) -> str:
    """A value as messages show it: as in Python, but no pages of digits."""
    try:
        text = repr(value)
    except ValueError:  # Python writes no number of more than 4300 digits
        text = f"a {type(value).__name__}"
    return text if len(text) <= LONGEST_SHOWN else f"{text[:LONGEST_SHOWN]}..."


def problem_with(value: Any, facts: Any) -> str | None:
    """What is wrong with the value of a parameter with the facts that `parameter` gave it; None where nothing is."""
    kind, choices = facts["type"].removesuffix("?"), facts["choices"]
    if (isinstance(value, str) and value in choices) or (value is None and facts["type"].endswith("?")):
        return None
    listed = ", ".join(map(repr, choices))
    if kind == "bool":
        return None if isinstance(value, bool) else "must be True or False"
    if kind == "choice":
        return f"must be one of {listed}"
    if kind == "point":
        words = f"{listed} or " if choices else ""
        return None if resolve_point(value) else f"must be {words}a point such as '0.5,0,2' or (0.5, 0, 2)"
    if kind in ("reducer", "stop"):
        usable = callable(value) and not isinstance(value, type)
        return None if usable else f"must be a {kind}: an instance, not a class or a name"
    if kind == "length" and isinstance(value, str):
        percent = _percent(value)
        if percent is None:
            return "must be a number in the cloud's units or a percentage of its diagonal such as '2%'"
        return None if SMALLEST_LENGTH <= percent <= 100 else "a percentage of the diagonal: above 0% and up to 100%"
    return _problem_with_number(value, kind == "int", facts)


def check_number(name: str, value: Any, type: str = "float", **limits: Any) -> Any:
    """A number of a type and within limits of `parameter`; InvalidParameterError for anything else."""
    problem = problem_with(value, parameter(None, "", type=type, **limits).metadata)
    if problem:
        raise InvalidParameterError(f"{name} = {shown(value)}: {problem}")
    return float(value) if type == "float" else value


def _problem_with_number(value: Any, whole: bool, facts: Any) -> str | None:
    low, high, above = facts["low"], facts["high"], facts["open_low"]
    fraction = isinstance(value, Rational) and not isinstance(value, Integral)  # arrays hold none
    if isinstance(value, bool) or fraction or not isinstance(value, Integral if whole else Real):
        words = "".join(f", or {choice!r}" for choice in facts["choices"])
        return f"must be {'an int' if whole else 'a number'}{words}"
    number = int(value) if isinstance(value, Integral) else float(value)
    most = LARGEST_WHOLE if whole else LARGEST
    if isinstance(number, float) and not math.isfinite(number):
        return "must be finite"
    if abs(number) > most:  # Python has larger ones, arrays and files do not
        return f"must be at most {most:g}"
    if facts["type"].startswith("length") and 0 < number < SMALLEST_LENGTH:
        return f"must be at least {SMALLEST_LENGTH:g}"
    if low is not None and (number < low or (above and number == low)):
        return f"must be {'above' if above else 'at least'} {low}"
    return f"must be at most {high}" if high is not None and number > high else None


def resolve_point(point: Any) -> tuple[float, ...] | None:
    """A point (x, y, z), a tuple or written as ``"x,y,z"``; None if it is none."""
    if not isinstance(point, str | tuple):
        return None
    try:
        numbers = tuple(map(float, point.split(",") if isinstance(point, str) else point))
    except (TypeError, ValueError, OverflowError):
        return None
    return numbers if len(numbers) == 3 and all(abs(number) <= LARGEST for number in numbers) else None


def _percent(text: str) -> float | None:
    match = re.fullmatch(r"\s*([0-9]*\.?[0-9]+(?:[eE][-+]?[0-9]+)?)\s*%\s*", text)
    return float(match[1]) if match else None


def resolve_length(length: float | str, diagonal: float) -> float:
    """A length in the cloud's units: a number as it is, ``"2%"`` as a share of the diagonal.

    Parameters
    ----------
    length : float or str
    diagonal : float
        In the cloud's units: of the bounding box or of the box with the spread of the points, as `Sampler.frame`
        says.

    Returns
    -------
    float

    Examples
    --------
    >>> resolve_length("2%", 50.0), resolve_length(0.3, 50.0)
    (1.0, 0.3)
    """
    if isinstance(length, str):
        percent = _percent(length)
        if percent is None:
            raise InvalidParameterError(f"length {length!r}: must be a number or a percentage such as '2%'")
        return percent / 100 * diagonal
    return float(length)
