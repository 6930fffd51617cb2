"""What the commands of the benchmarks are given."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from glsk_o3d import Contractor, Pipeline
from glsk_o3d.cli.overrides import override
from glsk_o3d.errors import InvalidParameterError
from glsk_o3d.recipes.catalogue import named_pipeline

PUBLISHED = ("wen2024", "cao2010")


def application(text: str | None) -> typer.Typer:
    """A program of several commands, with its help."""
    return typer.Typer(
        help=text, no_args_is_help=True, pretty_exceptions_enable=False, rich_markup_mode=None, add_completion=False
    )


def writable(path: Path | None) -> Path | None:
    if path is not None and not path.absolute().parent.is_dir():  # found out now, not after an hour
        raise typer.BadParameter(f"there is no folder {path.parent}")
    return path


Folder = Annotated[Path | None, typer.Argument(metavar="DIR", help="Folder of shapes, as the README describes it.")]
Folders = Annotated[
    list[Path] | None, typer.Argument(metavar="DIR", help="Folders of shapes, as the README describes them.")
]
Own = Annotated[bool, typer.Option("--builtin", help="The package's own samples instead of a folder.")]
Variants = Annotated[
    str, typer.Option("--variant", metavar="NAMES", help="KIND_SIZE, with commas; of a folder also *_SIZE.")
]
Shapes = Annotated[str, typer.Option("--shapes", metavar="NAMES", help="With commas, or how many; else all.")]
Pipelines = Annotated[str, typer.Option("--pipeline", metavar="NAMES", help="With commas.")]
Jobs = Annotated[int, typer.Option("--jobs", min=0, help="Processes; 0 stays in this one, for a debugger.")]
Output = Annotated[
    Path | None, typer.Option("--output", "-o", metavar="JSON", help="Write every result.", callback=writable)
]
Markdown = Annotated[bool, typer.Option("--markdown", help="Print Markdown.")]


def named(names: str) -> dict[str, Pipeline]:
    """The pipelines of these names, with commas."""
    try:
        return {name: named_pipeline(name) for name in names.split(",")}
    except InvalidParameterError as error:
        raise typer.BadParameter(str(error)) from None


def with_solves(pipeline: Pipeline, n: int) -> Pipeline:
    """The pipeline with exactly n solves, fewer only where one is refused."""
    if n == 0:
        return Pipeline(*(stage for stage in pipeline.stages if not isinstance(stage, Contractor)))
    at_once = ["Contractor.stop=ExplainedScore", "ExplainedScore.threshold=1e9", f"ExplainedScore.min_iterations={n}"]
    return override(pipeline, at_once)
