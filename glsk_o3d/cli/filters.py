"""``glsk filters``: what the code says about itself."""

from __future__ import annotations

import dataclasses
import inspect
import re
from typing import TYPE_CHECKING, Annotated, Any

from .console import echo, heading, print_table
from .options import argument
from .outputs import tell
from .reporting import WrongUsage

if TYPE_CHECKING:
    from ..parameters import Parameters


def filters(
    name: Annotated[str | None, argument("NAME", "One filter, stopping rule or pipeline, in full.")] = None,
) -> None:
    """List filters and their parameters, and pipelines.

    Everything is taken from the code: the filters, the stopping rules and the named pipelines, those of plugins too.
    """
    from ..errors import did_you_mean
    from ..recipes.catalogue import catalogue, known_pipelines

    known, pipelines = catalogue(), known_pipelines()
    if name is not None and name not in known and name not in pipelines:
        raise WrongUsage(did_you_mean(name, [*known, *pipelines], "filter or pipeline"))
    filter_facts = [_filter_facts(cls) for key, cls in known.items() if name in (None, key)]
    pipeline_facts = [_pipeline_facts(key, make) for key, make in pipelines.items() if name in (None, key)]

    def words() -> None:
        for facts in filter_facts:
            flow = f"{facts['consumes']} -> {facts['produces']}" if facts["consumes"] else facts["kind"]
            _print_facts(facts, flow, map(_parameter_row, facts["parameters"]), name is not None)
        for facts in pipeline_facts:
            stages = (("  |" if i else "", stage) for i, stage in enumerate(facts["stages"]))
            _print_facts(facts, "pipeline", stages, name is not None)

    tell({"filters": filter_facts, "pipelines": pipeline_facts}, words)


def _filter_facts(cls: type[Parameters]) -> dict[str, Any]:
    """What a filter or stopping rule says about itself; a rule consumes and produces None."""
    from ..pipeline import Cloud, Filter

    flow: dict[str, str | None] = {"consumes": None, "produces": None}
    if issubclass(cls, Filter):
        kinds = {name: getattr(cls, name) for name in flow}
        flow = {name: "cloud" if kind is Cloud else kind.__name__ for name, kind in kinds.items()}
    fields = dataclasses.fields(cls)  # type: ignore[arg-type]
    return {
        "name": cls.__name__,
        "kind": "filter" if flow["consumes"] else "stopping rule",
        "plugin": _plugin(cls),
        **flow,
        "doc": _prose(cls),
        "parameters": [
            {"name": field.name, **field.metadata, "default": _default(field), "limits": limits(field.metadata)}
            for field in fields
        ],
    }


def _pipeline_facts(name: str, make) -> dict[str, Any]:
    made = make()
    stages = [repr(stage) for stage in made.stages]
    return {"name": name, "plugin": _plugin(make), "doc": _prose(make), "expression": repr(made), "stages": stages}


def limits(metadata) -> str:
    """The limits of a parameter in words, such as "above 0, at most 1"; empty if it has none."""
    words = [" or ".join(metadata["choices"])] if metadata["choices"] else []
    if metadata["low"] is not None:
        words.append(f"{'above' if metadata['open_low'] else 'at least'} {metadata['low']:g}")
    if metadata["high"] is not None:
        words.append(f"at most {metadata['high']:g}")
    return ", ".join(words)


def _default(field: dataclasses.Field[Any]) -> Any:
    return repr(field.default) if dataclasses.is_dataclass(field.default) else field.default


def _plugin(thing) -> str | None:
    """The package that a filter or pipeline is from, None for this one."""
    package = getattr(thing, "__module__", "").partition(".")[0]
    return None if package == __package__.partition(".")[0] else package


def _prose(documented) -> str:
    """The docstring up to its first section, a line per paragraph, with the markup of formulas and code taken off."""
    text = re.split(r"\n\n\w[\w ]*\n-{3,}\n", inspect.getdoc(documented) or "", maxsplit=1)[0]
    text = re.sub(r"(?<!\n)\n(?!\n)", " ", text)
    return re.sub(r":math:`([^`]*)`|``([^`]*)``|`([^`]*)`", lambda m: m[1] or m[2] or m[3], text)


def _print_facts(facts: dict[str, Any], kind: str, rows, full: bool) -> None:
    heading(f"{facts['name']}  {kind}" + f", from {facts['plugin']}" * bool(facts["plugin"]))
    print_table([[facts["doc"] if full else facts["doc"].partition("\n\n")[0]]], wrap=True)
    print_table(rows, wrap=True)
    echo()


def _parameter_row(parameter: dict[str, Any]) -> tuple[str, str]:
    default = "none" if parameter["default"] is None else parameter["default"]
    kind = parameter["type"].replace("stop", "stopping rule").replace("?", " or none")
    unit = "" if parameter["unit"] == "-" else f" [{parameter['unit']}]"
    bounds = f", {parameter['limits']}" if parameter["limits"] else ""
    shape = parameter["limits"] if parameter["type"] == "choice" else kind + unit + bounds
    return f"  {parameter['name']}", f"{parameter['doc']}\n{shape}; default {default}"
