"""What the shell completes behind options, without Open3D: names of pipelines, parameters and their values, scripts."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator, MutableMapping
from dataclasses import Field
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import typer

from ..errors import GlskError

if TYPE_CHECKING:
    from ..parameters import Parameters
    from ..pipeline import Pipeline

PIPELINES = ("default", "tree", "wen2024", "cao2010")
"""Those of this package, written out, since all filters would have to be imported to name them."""


def complete_pipelines() -> list[str]:
    """Names of pipelines; plugins are not loaded for theirs."""
    from ..interop.packages import PIPELINE_GROUP, entry_points

    return [*PIPELINES, *(entry.name for _, entry in entry_points(PIPELINE_GROUP, []))]


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
        known = dict(_settings(named_pipeline(name) if recipe is None else load_recipe(recipe)))
    except (GlskError, OSError):  # it is said when the command runs
        return []
    if _parted:
        return known.get(_parted, [])
    name, parted, _ = incomplete.partition("=")
    fitting = [name] if parted else [each for each in known if each.startswith(name) and (name or "." in each)]
    if len(fitting) != 1:
        return [f"{each}=" for each in fitting]
    return [f"{fitting[0]}={value}" for value in known.get(fitting[0], [])]


def _settings(pipeline: Pipeline[Any]) -> Iterator[tuple[str, list[str]]]:
    """The parameters of a pipeline, also without their filter where that is clear, each with its values."""
    from dataclasses import fields

    from ..pipeline import parts

    present = {type(part): part for part in parts(pipeline)}
    owned = [(part, field) for part in present.values() for field in fields(part)]  # type: ignore[arg-type]
    names = Counter(field.name for _, field in owned)
    for part, field in owned:
        values = _values(type(part), field, getattr(part, field.name))
        yield f"{type(part).__name__}.{field.name}", values
        if names[field.name] == 1:
            yield field.name, values


def _values(cls: type[Parameters], field: Field[Any], value: Any) -> list[str]:
    """The words that a parameter may be, and else what it is."""
    from ..recipes.catalogue import catalogue, serves

    kind = field.metadata["type"].rstrip("?")
    words = list(field.metadata["choices"])
    if kind in ("reducer", "stop"):
        words += [name for name, other in catalogue().items() if other is not cls and serves(other, kind)]
    elif kind == "bool":
        words += ["true", "false"]
    elif isinstance(value, int | float | str) and str(value) not in words:
        words.insert(0, str(value))
    return words + ["none"] * field.metadata["type"].endswith("?")


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
    if words[here] == "=" or words[here - 1] == "=":
        _parted, _, joined[-1] = joined[-1].partition("=")
    environ.update(COMP_WORDS="\n".join(joined), COMP_CWORD=str(len(joined) - 1))


join_words(os.environ)
