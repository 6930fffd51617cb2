"""What the shell completes behind options, without Open3D: names of pipelines, parameters and their values, scripts."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import MutableMapping
from dataclasses import Field
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import typer

from ..errors import GlskError

if TYPE_CHECKING:
    from ..parameters import Parameters
    from ..pipeline import Pipeline

OWN_PIPELINES = ("default", "tree", "wen2024", "cao2010")
"""Those of this package, written out, since all filters would have to be imported to name them."""


def complete_pipelines() -> list[str]:
    """Names of pipelines; plugins are not loaded for theirs."""
    from ..interop.packages import PIPELINE_GROUP, entry_points

    return [*OWN_PIPELINES, *(entry.name for _, entry in entry_points(PIPELINE_GROUP, []))]


def complete_scripts() -> list[str]:
    """Names of the filter scripts that come with the package."""
    from ..meshlab.script import scripts

    return list(scripts())


def complete_settings(ctx: typer.Context, incomplete: str) -> list[str]:
    """What ``--set`` may be, of the pipeline or recipe that stands before it: names, and of one alone its values."""
    from ..recipes import load_recipe
    from ..recipes.catalogue import named_pipeline

    recipe, name = ctx.params.get("recipe"), ctx.params.get("pipeline") or "default"
    try:
        known = _settings(named_pipeline(name) if recipe is None else load_recipe(recipe))
    except (GlskError, OSError):  # it is said when the command runs
        return []
    if _parted:
        return known.get(_parted, [])
    name, parted, _ = incomplete.partition("=")
    fitting = [name] if parted else [each for each in known if each.startswith(name) and (name or "." in each)]
    if len(fitting) != 1:
        return [f"{each}=" for each in fitting]
    return [f"{fitting[0]}={value}" for value in known.get(fitting[0], [])]


def _settings(pipeline: Pipeline[Any]) -> dict[str, list[str]]:
    """The values of the parameters of a pipeline, by their names with their filter and, where it is clear, without."""
    from dataclasses import fields

    from ..pipeline import parts

    present = {type(part).__name__: part for part in parts(pipeline)}
    owned = [(name, part, field) for name, part in present.items() for field in fields(part)]  # type: ignore[arg-type]
    names = Counter(field.name for _, _, field in owned)
    named = {f"{name}.{field.name}": _values(part, field) for name, part, field in owned}
    return named | {field.name: _values(part, field) for _, part, field in owned if names[field.name] == 1}


def _values(part: Parameters, field: Field[Any]) -> list[str]:
    """The words that a parameter may be, and else what it is."""
    from ..recipes.catalogue import catalogue, serves

    kind, is_set = field.metadata["type"], str(getattr(part, field.name))
    words, none = list(field.metadata["choices"]), ["none"] * kind.endswith("?")
    if kind.startswith(("reducer", "stop")):
        words += [name for name, cls in catalogue().items() if cls is not type(part) and serves(cls, kind.rstrip("?"))]
    elif kind == "bool":
        words += ["true", "false"]
    elif is_set not in (*words, "None"):
        words.insert(0, is_set)
    return words + none


_parted = ""
"""The name of the setting whose value is completed, where the shell is bash: a word begins behind ``=`` there."""


def join_words(environ: MutableMapping[str, str]) -> None:
    """Put together again what bash parts: ``--set``, ``k``, ``=``, ``24``; at the cursor the value is left alone."""
    global _parted
    if environ.get("_GLSK_COMPLETE") != "complete_bash":
        return
    words, here = environ.get("COMP_WORDS", "").split("\n"), int(environ.get("COMP_CWORD", 0))
    joined: list[str] = []
    for before, word in pairwise(["", *words[: here + 1]]):
        if joined[-2:-1] == ["--set"] and "=" in (before, word):
            joined[-1] += word
        else:
            joined.append(word)
    if "=" in words[max(here - 1, 0) : here + 1]:
        _parted, _, joined[-1] = joined[-1].partition("=")
    environ.update(COMP_WORDS="\n".join(joined), COMP_CWORD=str(len(joined) - 1))


join_words(os.environ)
