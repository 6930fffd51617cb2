"""``glsk filters``: what the code says about itself."""

from __future__ import annotations

import dataclasses
import inspect
import re
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .console import console, echo, print_json, print_table
from .options import Json
from .reporting import WrongUsage, reporting

if TYPE_CHECKING:
    from ..parameters import Parameters


def filters(
    name: Annotated[
        str | None, typer.Argument(metavar="NAME", help="One filter, stopping rule or pipeline, in full.")
    ] = None,
    as_json: Json = False,
) -> None:
    """List filters and their parameters, and pipelines.

    Everything is taken from the code: the filters, the stopping rules and the named pipelines, those of plugins too.
    """
    with reporting():
        from ..errors import did_you_mean
        from ..recipes.catalogue import catalogue, known_pipelines

        known, pipelines = catalogue(), known_pipelines()
        if name is not None and name not in known and name not in pipelines:
            raise WrongUsage(did_you_mean(name, [*known, *pipelines], "filter or pipeline"))
        classes = [cls for key, cls in known.items() if name in (None, key)]
        names = [key for key in pipelines if name in (None, key)]
        if as_json:
            print_json(
                {"filters": [facts(cls) for cls in classes], "pipelines": [_pipeline_facts(key) for key in names]}
            )
            return
        for cls in classes:
            _print_filter(cls, full=name is not None)
        for key in names:
            _print_pipeline(key, full=name is not None)


def facts(cls: type[Parameters]) -> dict[str, Any]:
    """What a filter or stopping rule says about itself.

    That is ``name``, ``kind``, ``plugin`` (the package that it is from, None for this one), ``consumes``, ``produces``
    (None for a rule), ``doc`` and ``parameters``: a list of dicts of the field's metadata, with ``name``, ``default``
    and ``limits`` in words.
    """
    from ..pipeline import Filter

    flow: dict[str, str | None] = {"consumes": None, "produces": None}
    if issubclass(cls, Filter):
        flow = {name: _flow_name(getattr(cls, name)) for name in flow}
    return {
        "name": cls.__name__,
        "kind": "filter" if flow["consumes"] else "stopping rule",
        "plugin": _plugin(cls),
        **flow,
        "doc": _prose(cls),
        "parameters": [
            {
                "name": field.name,
                **field.metadata,
                "default": _plain(field.default),
                "limits": limits(field.metadata),
            }
            for field in dataclasses.fields(cls)  # type: ignore[arg-type]
        ],
    }


def limits(metadata) -> str:
    """The limits of a parameter in words, empty if it has none.

    Parameters
    ----------
    metadata : mapping
        As `glsk_o3d.parameters.parameter` makes it.

    Examples
    --------
    >>> limits({"low": 0, "high": 1, "open_low": True, "choices": ()})
    'above 0, at most 1'
    """
    words = [f"{choice}" for choice in metadata["choices"]]
    said = [" or ".join(words)] if words else []
    if metadata["low"] is not None:
        said.append(f"{'above' if metadata['open_low'] else 'at least'} {metadata['low']:g}")
    if metadata["high"] is not None:
        said.append(f"at most {metadata['high']:g}")
    return ", ".join(said)


def _flow_name(flow: type) -> str:
    from ..pipeline import Cloud

    return "cloud" if flow is Cloud else flow.__name__


def _plain(value):
    return value if isinstance(value, bool | int | float | str | None) else repr(value)


def _prose(documented) -> str:
    """The docstring up to its first section, a line per paragraph, with the markup of formulas and code taken off."""
    text = inspect.cleandoc(documented.__doc__ or "")
    text = re.split(r"\n\n\w[\w ]*\n-{3,}\n", text, maxsplit=1)[0]
    text = re.sub(r":math:`([^`]*)`|``([^`]*)``|`([^`]*)`", lambda m: m[1] or m[2] or m[3], text)
    text = re.sub(r"\\(\w+)", r"\1", text)
    return re.sub(r"(?<!\n)\n(?!\n)", " ", text)


def _from(told) -> str:
    return f", from {told['plugin']}" if told["plugin"] else ""


def _print_filter(cls, full: bool) -> None:
    from rich.table import Table
    from rich.text import Text

    told = facts(cls)
    flow = f"  {told['consumes']} -> {told['produces']}" if told["consumes"] else "  stopping rule"
    out = console()
    out.print(Text.assemble((told["name"], "bold"), (flow + _from(told), "dim")))
    out.print(told["doc"] + "\n" if full else told["doc"].partition("\n\n")[0])
    table = Table.grid(padding=(0, 2))
    table.add_column(no_wrap=True)
    table.add_column()
    for each in told["parameters"]:
        default = "none" if each["default"] is None else each["default"]
        kind = each["type"].replace("stop", "stopping rule").replace("?", " or none")
        unit = "" if each["unit"] == "-" else f" [{each['unit']}]"
        bounds = f", {each['limits']}" if each["limits"] else ""
        shape = each["limits"] if each["type"] == "choice" else kind + unit + bounds
        table.add_row(f"  {each['name']}", Text.assemble(each["doc"], "\n", (f"{shape}; default {default}", "dim")))
    print_table(table)
    echo()


def _pipeline_facts(name: str) -> dict[str, Any]:
    from ..recipes.catalogue import known_pipelines

    make = known_pipelines()[name]
    made = make()
    stages = [repr(stage) for stage in made.stages]
    return {"name": name, "plugin": _plugin(make), "doc": _prose(make), "expression": repr(made), "stages": stages}


def _plugin(thing) -> str | None:
    """The package that a filter or pipeline is from, None for this one."""
    package = getattr(thing, "__module__", "").partition(".")[0]
    return None if package == __package__.partition(".")[0] else package


def _print_pipeline(name: str, full: bool) -> None:
    from rich.table import Table
    from rich.text import Text

    told = _pipeline_facts(name)
    out = console()
    out.print(Text.assemble((name, "bold"), ("  pipeline" + _from(told), "dim")))
    out.print(told["doc"] + "\n" if full else told["doc"].partition("\n\n")[0])
    table = Table.grid(padding=(0, 1))
    for i, stage in enumerate(told["stages"]):
        table.add_row("  |" if i else "", stage)
    print_table(table)
    echo()
