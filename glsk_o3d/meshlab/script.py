"""MeshLab's filter scripts (.mlx), read and written without MeshLab."""

import math
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path
from typing import Any
from xml.parsers import expat
from xml.sax.saxutils import quoteattr

from ..errors import FileFormatError, ScriptError, brief
from ..interop.atomic import write_atomically
from ..io.paths import existing_file

MOST_BYTES = 1 << 20
ENCODINGS = ("utf-8", "utf-16", "iso-8859-1", "us-ascii")
"""Those that expat itself reads: it would leave others to any codec of Python."""
_ELEMENTS = ("FilterScript", "filter", "Param")  # by depth

BOOL = ("RichBool",)
INT = ("RichInt", "RichEnum", "RichMesh")
FLOAT = ("RichFloat", "RichDynamicFloat")
LENGTH = ("RichAbsPerc", "RichPercentage")
TEXT = ("RichString", "RichOpenFile", "RichSaveFile", "RichFileOpen", "RichFileSave")
POINT = ("RichPosition", "RichDirection", "RichPoint3f")
MATRIX = ("RichMatrix44f", "RichMatrix44")
_VECTORS = {
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
            raise ValueError(f"it has the wrong type {brief(self.type)}: {fitting}")
        names = _VECTORS.get(self.type, ("value",))
        if not self.attributes.keys() >= set(names):
            raise ValueError(f"it has no value: a {self.type} has it in {', '.join(names)}")
        texts = [self.attributes[name] for name in names]
        text = texts[0].strip()
        if self.type in TEXT:
            return texts[0]
        if self.type == "RichColor":
            numbers = [_number(text, int) for text in texts]
            if not all(0 <= number <= 255 for number in numbers):
                raise ValueError("a RichColor is of whole numbers from 0 to 255")
            return numbers
        if self.type in _VECTORS:
            return [_number(text, float) for text in texts]
        if self.type in BOOL:
            if text.lower() not in ("true", "false"):
                raise ValueError(f"{brief(text)!r} is neither true nor false")
            return text.lower() == "true"
        if self.type in LENGTH and text.endswith("%"):
            _number(text[:-1], float)
            return text
        return _number(text, int if self.type in INT else float)


def _number(text: str, kind: type) -> Any:
    try:
        number = kind(text.replace("_", "?"))  # Python alone reads 1_0 as 10
    except ValueError:
        raise ValueError(f"{brief(text)!r} is not {'an int' if kind is int else 'a number'}") from None
    if kind is float and not math.isfinite(number):
        raise ValueError(f"{brief(text)!r} is not finite")
    return number


@dataclass(frozen=True)
class Call:
    """A filter as it stands in a script, by the name that MeshLab's menus have; line 0 where it is not from a file."""

    name: str
    params: list[Param] = field(default_factory=list)
    line: int = 0


def read_script(path: str | os.PathLike) -> list[Call]:
    """The filters of a script, at least one. Whether they exist is not asked here.

    FileNotFoundError, or FileFormatError for a folder, a device, or an empty or huge file. ScriptError, with the line,
    for what is not XML, for elements other than those of a script, and for what scripts never need and attacks do:
    entities, and a DOCTYPE with declarations or a reference.
    """
    path = existing_file(path)
    if path.stat().st_size > MOST_BYTES:
        raise FileFormatError(f"{path}: is larger than {MOST_BYTES >> 20} MiB, too large for a filter script")
    data = path.read_bytes()
    calls, parser, depth = [], expat.ParserCreate(), 0  # expat knows lines, and sees declarations before it obeys them

    def wrong(message: object, line: int | None = None) -> ScriptError:
        return ScriptError(f"{path}, line {line or parser.CurrentLineNumber}: {message}")

    def doctype(name, system, public, has_declarations):
        if has_declarations or system or public:
            raise wrong(
                "the DOCTYPE declares entities or refers to a file, which is refused: it may only be "
                "<!DOCTYPE FilterScript>"
            )

    def declaration(version, encoding, standalone):
        if encoding is not None and encoding.lower() not in ENCODINGS:
            raise wrong(f"the encoding is {brief(encoding)!r}: must be one of {', '.join(ENCODINGS)}")

    def start(element, attributes):
        nonlocal depth
        if element not in _ELEMENTS[depth : depth + 1]:
            inside = f"inside <{_ELEMENTS[depth - 1]}>" if depth else "as the root of a filter script"
            raise wrong(f"<{brief(element)}> cannot stand {inside}")
        depth += 1
        name, type, line = attributes.get("name", ""), attributes.get("type", ""), parser.CurrentLineNumber
        if element == "filter":
            if not name:
                raise wrong("a <filter> without a name")
            calls.append(Call(name, [], line))
        elif element == "Param":
            if not (name and type):
                raise wrong(f"filter {brief(calls[-1].name)!r}: a <Param> without a {'type' if name else 'name'}")
            calls[-1].params.append(Param(name, type, attributes, line))

    def end(element):
        nonlocal depth
        depth -= 1

    parser.XmlDeclHandler = declaration
    parser.StartDoctypeDeclHandler, parser.StartElementHandler, parser.EndElementHandler = doctype, start, end
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        line = min(error.lineno, data.count(b"\n") + 1)
        raise wrong(f"not well-formed XML: {expat.ErrorString(error.code)}", line) from None
    except ScriptError:
        raise
    except (ValueError, LookupError) as error:  # an encoding nobody knows
        raise wrong(f"cannot be read: {error}", 1) from None
    if not calls:
        raise wrong("the script has no filters")
    return calls


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


def scripts() -> dict[str, Path]:
    """The files of the filter scripts that come with the package, by name."""
    package = Path(str(resources.files("glsk_o3d")))
    places = (package / "filters", package.parent / "filters")  # installed, and in a checkout
    folder = next((place for place in places if place.is_dir()), None)
    return {path.stem: path for path in sorted(folder.glob("*.mlx"))} if folder else {}
