"""MeshLab's filter scripts (.mlx), read and written without MeshLab."""

import os
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn
from xml.parsers import expat
from xml.sax.saxutils import quoteattr

from ...errors import FileFormatError, ScriptError, brief
from ...interop.atomic import existing_file, write_atomically

MOST_BYTES = 1 << 20
_ELEMENTS = ("FilterScript", "filter", "Param")  # by depth

_VALUES = ("value", *"xyz", *"rgba", *(f"val{i}" for i in range(16)))
"""The attributes that have the value of a parameter: points, colours and matrices have it in several."""


@dataclass(frozen=True)
class Param:
    """A parameter as it stands in a script."""

    name: str
    type: str
    attributes: dict[str, str]
    line: int = 0

    @property
    def text(self) -> str:
        """Its value, of several attributes with commas between them."""
        return ",".join(self.attributes[name] for name in _VALUES if name in self.attributes).strip()


@dataclass(frozen=True)
class Call:
    """A filter as it stands in a script, by the name that MeshLab's menus have; line 0 where it is not from a file."""

    name: str
    params: list[Param] = field(default_factory=list)
    line: int = 0


def read_script(path: str | os.PathLike[str]) -> list[Call]:
    """The filters of a script, at least one. Whether they exist is not asked here.

    FileNotFoundError, or FileFormatError for a folder, a device, or an empty or huge file. ScriptError, with the line,
    for what is not XML, for elements other than those of a script, and for entities, which attacks need.
    """
    path = existing_file(path)
    if path.stat().st_size > MOST_BYTES:
        raise FileFormatError(f"{path}: is larger than {MOST_BYTES >> 20} MiB, too large for a filter script")
    data = path.read_bytes()
    calls, parser, depth = [], expat.ParserCreate(), 0  # expat knows lines, and sees declarations before it obeys them

    def wrong(message: object, line: int | None = None) -> ScriptError:
        return ScriptError(f"{path}, line {line or parser.CurrentLineNumber}: {message}")

    def entity(name: str, *_: Any) -> NoReturn:
        raise wrong(f"the DOCTYPE declares the entity {brief(name)!r}, which is refused")

    def start(element: str, attributes: dict[str, str]) -> None:
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

    def end(element: str) -> None:
        nonlocal depth
        depth -= 1

    parser.EntityDeclHandler, parser.StartElementHandler, parser.EndElementHandler = entity, start, end
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        line = min(error.lineno, data.count(b"\n") + 1)
        raise wrong(f"not well-formed XML: {expat.ErrorString(error.code)}", line) from None
    except (ValueError, LookupError) as error:  # an encoding nobody knows, but not what is wrong by our own words
        raise error if isinstance(error, ScriptError) else wrong(f"cannot be read: {error}", 1) from None
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


def write_script(path: str | os.PathLike[str], calls: Iterable[Call]) -> None:
    """Write filters as a script, complete or not at all."""
    write_atomically(path, lambda temporary: temporary.write_text(script_text(calls), encoding="utf-8"))


def comment(path: str | os.PathLike[str]) -> str:
    """The first comment of a script, in one line; empty if it has none."""
    comments: list[str] = []
    parser = expat.ParserCreate()
    parser.CommentHandler = comments.append
    parser.Parse(Path(path).read_bytes(), True)
    return " ".join(comments[0].split()) if comments else ""


def scripts() -> dict[str, Path]:
    """The files of the filter scripts that come with the package, by name."""
    own = Path(__file__)
    places = (own.parent / "scripts", own.parents[3] / "filters")  # installed, and in a checkout
    folder = next((place for place in places if place.is_dir()), None)
    return {path.stem: path for path in sorted(folder.glob("*.mlx"))} if folder else {}
