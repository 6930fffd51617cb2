"""MeshLab's filter scripts (.mlx), read and written without MeshLab."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.parsers import expat
from xml.sax.saxutils import quoteattr

from ..errors import FileFormatError, ScriptError
from ..interop.atomic import write_atomically

MOST_BYTES, LONGEST_NAME = 1 << 20, 200
_ELEMENTS = ("FilterScript", "filter", "Param")  # by depth

BOOL = ("RichBool",)
INT = ("RichInt", "RichEnum", "RichMesh")
FLOAT = ("RichFloat", "RichDynamicFloat")
LENGTH = ("RichAbsPerc", "RichPercentage")
TEXT = ("RichString", "RichOpenFile", "RichSaveFile", "RichFileOpen", "RichFileSave")
POINT = ("RichPosition", "RichDirection", "RichPoint3f")
MATRIX = ("RichMatrix44f", "RichMatrix44")
VECTORS = {
    "RichColor": ("r", "g", "b", "a"),
    **dict.fromkeys(POINT, ("x", "y", "z")),
    **dict.fromkeys(MATRIX, tuple(f"val{i}" for i in range(16))),
}
"""The attributes of the types that have their value in several."""


@dataclass(frozen=True)
class Param:
    """A parameter as it stands in a script: its attributes are text, most types have their value in ``value``."""

    name: str
    type: str
    attributes: dict[str, str]
    line: int = 0

    def value(self, types: Sequence[str]) -> Any:
        """A bool, int, float, str, list of floats (of ints for a colour), or for a length a float or text as "2%".

        ValueError if the type is none of those, or what stands there is not of that type.
        """
        if self.type not in types:
            fitting = f"it may be a {' or '.join(types)}" if types else "scripts cannot give it"
            raise ValueError(f"a {self.type} is not what it takes: {fitting}")
        if self.type in VECTORS:
            return self._vector(VECTORS[self.type])
        if "value" not in self.attributes:
            raise ValueError("it has no value")
        text = self.attributes["value"].strip()
        if self.type in TEXT:
            return self.attributes["value"]
        if self.type in BOOL:
            if text.lower() not in ("true", "false"):
                raise ValueError(f"{text[:40]!r} is neither true nor false")
            return text.lower() == "true"
        if self.type in LENGTH and text.endswith("%"):
            _number(text[:-1], float)
            return text
        return _number(text, int if self.type in INT else float)

    def _vector(self, names: Sequence[str]) -> list[float]:
        lost = [name for name in names if name not in self.attributes]
        if lost:
            raise ValueError(f"a {self.type} has the attributes {', '.join(names)}, and {lost[0]} is not there")
        numbers = [_number(self.attributes[name], int if self.type == "RichColor" else float) for name in names]
        if self.type == "RichColor" and not all(0 <= number <= 255 for number in numbers):
            raise ValueError("a RichColor is of whole numbers from 0 to 255")
        return numbers


def _number(text: str, kind: type) -> Any:
    try:
        number = kind(text.replace("_", "?"))  # Python alone reads 1_0 as 10
    except ValueError:
        raise ValueError(f"{text[:40]!r} is not {'an int' if kind is int else 'a number'}") from None
    if kind is float and not math.isfinite(number):
        raise ValueError(f"{text!r} is not finite")
    return number


@dataclass(frozen=True)
class Call:
    """A filter as it stands in a script, by the name that MeshLab's menus have; line 0 where it is not from a file."""

    name: str
    params: tuple[Param, ...] = ()
    line: int = 0


def read_script(path: str | os.PathLike) -> list[Call]:
    """The filters of a script, at least one. Whether they exist is not asked here.

    FileFormatError for a folder, a device, or an empty or huge file. ScriptError, with the line, for what is not XML,
    for elements other than those of a script, and for what scripts never need and attacks do: entities, and a DOCTYPE
    with declarations or a reference.
    """
    path = Path(path)
    if not path.exists():
        raise FileNotFoundError(f"{path}: no such file")
    if not path.is_file():
        raise FileFormatError(f"{path}: is a folder or a device, not a filter script")
    with path.open("rb") as stream:
        data = stream.read(MOST_BYTES + 1)
    if not data.strip():
        raise FileFormatError(f"{path}: the file is empty")
    if len(data) > MOST_BYTES:
        raise FileFormatError(f"{path}: is larger than {MOST_BYTES >> 20} MiB, too large for a filter script")
    return _Reader(path).read(data)


class _Reader:
    """The parser of the standard library: it knows lines, and tells of a DOCTYPE's declarations before it reads one."""

    def __init__(self, path: Path):
        self.path, self.depth = path, 0
        self.calls: list[tuple[str, list[Param], int]] = []
        parser = self.parser = expat.ParserCreate()
        parser.StartDoctypeDeclHandler = self.doctype
        parser.StartElementHandler, parser.EndElementHandler = self.start, self.end
        parser.CharacterDataHandler = self.text

    def read(self, data: bytes) -> list[Call]:
        try:
            self.parser.Parse(data, True)
        except expat.ExpatError as error:
            line = min(error.lineno, data.count(b"\n") + 1)
            said = f"not well-formed XML: {expat.ErrorString(error.code)}"
            raise ScriptError(f"{self.path}, line {line}: {said}") from None
        except ScriptError:
            raise
        except (ValueError, LookupError) as error:  # an encoding nobody knows
            raise ScriptError(f"{self.path}, line 1: cannot be read: {error}") from None
        if not self.calls:
            raise self.error("the script has no filters")
        return [Call(name, tuple(params), line) for name, params, line in self.calls]

    def error(self, message: str) -> ScriptError:
        return ScriptError(f"{self.path}, line {self.parser.CurrentLineNumber}: {message}")

    def doctype(self, name, system, public, has_declarations):
        if has_declarations or system or public:
            raise self.error(
                "the DOCTYPE declares entities or refers to a file, which is refused: it may only be "
                "<!DOCTYPE FilterScript>"
            )

    def start(self, element, attributes):
        expected = _ELEMENTS[self.depth] if self.depth < len(_ELEMENTS) else None
        if element != expected:
            inside = f"inside <{_ELEMENTS[self.depth - 1]}>" if self.depth else "as the root of a filter script"
            hint = f": only <{expected}> may" if expected else ": nothing may"
            raise self.error(f"<{element[:40]}> cannot stand {inside}{hint}")
        self.depth += 1
        name, type, line = attributes.get("name", ""), attributes.get("type", ""), self.parser.CurrentLineNumber
        if max(len(name), len(type)) > LONGEST_NAME:
            raise self.error(f"a name of more than {LONGEST_NAME} characters")
        if element == "filter":
            if not name:
                raise self.error("a <filter> without a name")
            self.calls.append((name, [], line))
        elif element == "Param":
            filter, params, _ = self.calls[-1]
            if not (name and type):
                raise self.error(f"filter {filter!r}: a <Param> without a {'type' if name else 'name'}")
            if name in [param.name for param in params]:
                raise self.error(f"filter {filter!r}: parameter {name!r} is given twice")
            params.append(Param(name, type, attributes, line))

    def end(self, element):
        self.depth -= 1

    def text(self, text):
        if text.strip():
            raise self.error(f"the text {text.strip()[:40]!r} cannot stand here: values are attributes")


def script_text(calls: Iterable[Call]) -> str:
    """Filters as the text of a script."""
    lines = ["<!DOCTYPE FilterScript>", "<FilterScript>"]
    for call in calls:
        lines.append(f" <filter name={quoteattr(call.name)}{'' if call.params else '/'}>")
        for param in call.params:
            attributes = {"type": param.type, "name": param.name, **param.attributes}
            lines.append(f"  <Param {' '.join(f'{key}={quoteattr(value)}' for key, value in attributes.items())}/>")
        if call.params:
            lines.append(" </filter>")
    return "\n".join([*lines, "</FilterScript>", ""])


def write_script(path: str | os.PathLike, calls: Iterable[Call]) -> None:
    """Write filters as a script, complete or not at all."""
    write_atomically(path, lambda temporary: temporary.write_text(script_text(calls), encoding="utf-8"))


def comment(path: str | os.PathLike) -> str:
    """The first comment of a script, in one line; empty if it has none."""
    comments: list[str] = []
    parser = expat.ParserCreate()
    parser.CommentHandler = comments.append
    parser.Parse(Path(path).read_bytes(), True)
    return " ".join(comments[0].split()) if comments else ""
