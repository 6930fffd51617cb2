"""MeshLab's filter scripts (.mlx), read and written without MeshLab.

A script is a list of filters, each with the parameters that differ from its defaults::

    <!DOCTYPE FilterScript>
    <FilterScript>
     <filter name="Generate Curve Skeleton (GLSkeleton)">
      <Param type="RichAbsPerc" name="connector_radius" value="2%"/>
     </filter>
    </FilterScript>

Of XML nothing else is taken: no entities, no references to other files, no elements of another kind. The parser is that
of the standard library, because it knows line numbers and says, before it reads one, that a DOCTYPE has declarations.
"""

from __future__ import annotations

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


@dataclass(frozen=True)
class Param:
    """A parameter as it stands in a script.

    Attributes
    ----------
    name : str
    type : str
        ``"RichInt"``, ``"RichAbsPerc"`` and so on.
    attributes : dict of str to str
        All attributes of the element; most types have their value in ``value``.
    line : int
    """

    name: str
    type: str
    attributes: dict[str, str]
    line: int = 0

    def check_type(self, types: Sequence[str]) -> None:
        """Raise ValueError unless the parameter has one of the types."""
        if self.type not in types:
            fitting = f"it may be a {' or '.join(types)}" if types else "scripts cannot give it"
            raise ValueError(f"a {self.type} is not what it takes: {fitting}")

    def value(self) -> Any:
        """What stands there: bool, int, float, str, a list of floats (of ints for a colour), or for a
        length a float or text such as "2%".

        Raises
        ------
        ValueError
            It is not of the type that it claims to be; the message says so.
        """
        if self.type in VECTORS:
            names = VECTORS[self.type]
            lost = [name for name in names if name not in self.attributes]
            if lost:
                raise ValueError(f"a {self.type} has the attributes {', '.join(names)}, and {lost[0]} is not there")
            numbers = [self._number(self._kind, self.attributes[name]) for name in names]
            if self._kind is int and not all(0 <= number <= 255 for number in numbers):
                raise ValueError("a RichColor is of whole numbers from 0 to 255")
            return numbers
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
            self._number(float, text[:-1])
            return text
        return self._number(self._kind, text)

    @property
    def _kind(self):
        return int if self.type in (*INT, "RichColor") else float

    def _number(self, kind, text):
        try:
            number = kind(text.replace("_", "?"))  # Python alone reads 1_0 as 10
        except ValueError:
            raise ValueError(f"{text[:40]!r} is not {'an int' if kind is int else 'a number'}") from None
        if number != number or number in (float("inf"), float("-inf")):
            raise ValueError(f"{text!r} is not finite")
        return number


@dataclass(frozen=True)
class Call:
    """A filter as it stands in a script.

    Attributes
    ----------
    name : str
        What MeshLab calls the filter in its menus.
    params : tuple of Param
    line : int
        0 where it is not from a file.
    """

    name: str
    params: tuple[Param, ...] = ()
    line: int = 0


def read_script(path: str | os.PathLike) -> list[Call]:
    """Read a filter script. Whether its filters exist is not asked here.

    Returns
    -------
    list of Call
        At least one.

    Raises
    ------
    FileNotFoundError
    FileFormatError
        A folder, a device, or an empty or huge file.
    ScriptError
        It is not XML, has elements other than those of a script, or what scripts never need and attacks do: entities,
        and a DOCTYPE with declarations or a reference. The message names file and line.
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
            raise ScriptError(
                f"{self.path}, line {line}: not well-formed XML: {expat.ErrorString(error.code)}"
            ) from None
        except (ValueError, LookupError) as error:
            if isinstance(error, ScriptError):
                raise
            raise ScriptError(f"{self.path}, line 1: cannot be read: {error}") from None  # an encoding nobody knows
        if not self.calls:
            raise self.error("the script has no filters")
        return [Call(name, tuple(params), line) for name, params, line in self.calls]

    @property
    def line(self) -> int:
        return self.parser.CurrentLineNumber

    def error(self, message: str) -> ScriptError:
        return ScriptError(f"{self.path}, line {self.line}: {message}")

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
        if any(len(attributes.get(key, "")) > LONGEST_NAME for key in ("name", "type")):
            raise self.error(f"a name of more than {LONGEST_NAME} characters")
        if element == "filter":
            if not attributes.get("name"):
                raise self.error("a <filter> without a name")
            self.calls.append((attributes["name"], [], self.line))
        elif element == "Param":
            filter, params, _ = self.calls[-1]
            name, type = attributes.get("name"), attributes.get("type")
            if not (name and type):
                raise self.error(f"filter {filter!r}: a <Param> without a {'type' if name else 'name'}")
            if name in [param.name for param in params]:
                raise self.error(f"filter {filter!r}: parameter {name!r} is given twice")
            params.append(Param(name, type, attributes, self.line))

    def end(self, element):
        self.depth -= 1

    def text(self, text):
        if text.strip():
            raise self.error(f"the text {text.strip()[:40]!r} cannot stand here: values are attributes")


def script_text(calls: Iterable[Call]) -> str:
    """Filters as the text of a script."""
    lines = ["<!DOCTYPE FilterScript>", "<FilterScript>"]
    for call in calls:
        inner = [f"  <Param {_attributes(param)}/>" for param in call.params]
        lines.append(f" <filter name={quoteattr(call.name)}{'' if inner else '/'}>")
        lines += [*inner, " </filter>"] if inner else []
    return "\n".join([*lines, "</FilterScript>", ""])


def _attributes(param: Param) -> str:
    ordered = {"type": param.type, "name": param.name, **param.attributes}
    return " ".join(f"{key}={quoteattr(value)}" for key, value in ordered.items())


def write_script(path: str | os.PathLike, calls: Sequence[Call]) -> None:
    """Write filters as a script, as `write_atomically` does."""
    write_atomically(path, lambda temporary: temporary.write_text(script_text(calls), encoding="utf-8"))


def comment(path: str | os.PathLike) -> str:
    """The first comment of a script, in one line; empty if it has none."""
    comments: list[str] = []
    parser = expat.ParserCreate()
    parser.CommentHandler = comments.append
    parser.Parse(Path(path).read_bytes(), True)
    return " ".join(comments[0].split()) if comments else ""
