"""``glsk filters``: what the code says about itself."""

import dataclasses
import inspect
import re
from itertools import chain
from typing import Annotated, Any

from ..parameters import Parameters, allowed_values
from .console import echo, print_table
from .options import argument
from .outputs import print_result
from .reporting import WrongUsage


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
    facts = {
        "filters": [_filter_facts(cls) for key, cls in known.items() if name in (None, key)],
        "pipelines": [
            {"name": key, "kind": "pipeline", **_origin(make), "expression": " | ".join(map(repr, make().stages))}
            for key, make in pipelines.items()
            if name in (None, key)
        ],
    }

    def words() -> None:
        for item in chain(*facts.values()):
            _print(item, full=name is not None)

    print_result(facts, words)


def _filter_facts(cls: type[Parameters]) -> dict[str, Any]:
    """What a filter or stopping rule says about itself; a rule consumes and produces None."""
    from ..interop.clouds import Cloud
    from ..pipeline import Filter

    flow: dict[str, str | None] = {"consumes": None, "produces": None}
    if issubclass(cls, Filter):
        kinds = {name: getattr(cls, name) for name in flow}
        flow = {name: "cloud" if kind is Cloud else kind.__name__ for name, kind in kinds.items()}
    kind = "filter" if flow["consumes"] else "stopping rule"
    fields = dataclasses.fields(cls)  # type: ignore[arg-type]
    plain = {f.name: repr(f.default) if dataclasses.is_dataclass(f.default) else f.default for f in fields}
    parameters = [{"name": f.name, **f.metadata, "default": plain[f.name]} for f in fields]
    return {"name": cls.__name__, "kind": kind, **_origin(cls), **flow, "parameters": parameters}


def _origin(thing: Any) -> dict[str, Any]:
    """The package that a filter or pipeline is from, None for this one, and what its docstring says first.

    That is all up to the first section, a line per paragraph, with the markup of formulas and code taken off.
    """
    package = getattr(thing, "__module__", "").partition(".")[0]
    text = re.split(r"\n\n\w[\w ]*\n-{3,}\n", inspect.getdoc(thing) or "", maxsplit=1)[0]
    text = re.sub(r"(?<!\n)\n(?!\n)", " ", text)
    text = re.sub(r":math:`([^`]*)`|``([^`]*)``|`([^`]*)`", lambda m: m[1] or m[2] or m[3], text)
    return {"plugin": None if package == __package__.partition(".")[0] else package, "doc": text}


def _print(facts: dict[str, Any], *, full: bool) -> None:
    flow = f"{facts['consumes']} -> {facts['produces']}" if facts["kind"] == "filter" else facts["kind"]
    echo(f"{facts['name']}  {flow}" + f", from {facts['plugin']}" * bool(facts["plugin"]), bold=True)
    print_table([[facts["doc"] if full else facts["doc"].partition("\n\n")[0]]], wrap=True)
    rows = [("", facts["expression"])] if facts["kind"] == "pipeline" else []
    for option in facts.get("parameters", ()):
        default = "none" if option["default"] is None else option["default"]
        rows.append((f"  {option['name']}", f"{option['doc']}\n{allowed_values(option)}; default {default}"))
    print_table(rows, wrap=True)
    echo()
