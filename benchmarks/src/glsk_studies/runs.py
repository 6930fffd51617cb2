"""Work in parallel processes, a row for each job, and the options that commands share."""

from __future__ import annotations

import os
import signal
import warnings
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import track

from glsk_o3d import Contractor, Pipeline, pipelines, samples
from glsk_o3d.cli.overrides import override
from glsk_o3d.errors import InvalidParameterError
from glsk_o3d.recipes.catalogue import named_pipeline

from .tables import Tables, fill, machine, markdown, present, save, surroundings

DEATHS = {it.value: it.name for it in signal.Signals} | {signal.SIGKILL.value: "killed, perhaps for want of memory"}
PUBLISHED = ("wen2024", "cao2010")


def run(
    work: Callable[..., dict],
    jobs: Sequence[tuple[dict, tuple]],
    processes: int,
    fresh: bool = False,
    limit: float | None = None,
    preload: Sequence[str] = (),
) -> list[dict]:
    """Work through jobs, (facts, arguments), in parallel: rows of the facts and what `work` gives, or a `failure`.

    With 0 processes all is done in this one. `fresh` jobs have a process of their own, whose death is a failure of that
    job alone, and so is more time than the limit [s]; those with modules to preload are copies of one that has loaded
    them, without a warm-up.
    """
    surroundings()  # now: writing a page will change the working tree, and the work itself the load
    if processes == 0:
        with warnings.catch_warnings():
            _warm_up()
            return [_row(work, job) for job in jobs]
    # CPU seconds are those of one thread: NumPy reads this when it is imported, which is in the processes yet to start
    os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")
    pool = ThreadPoolExecutor(processes) if fresh else ProcessPoolExecutor(processes, get_context("spawn"), _warm_up)
    with pool:
        rows = pool.map(partial(_alone, preload, limit, work) if fresh else partial(_row, work), jobs)
        return list(track(rows, "", len(jobs), console=Console(stderr=True), transient=True))


def _warm_up() -> None:
    warnings.simplefilter("ignore")  # what a skeleton warns of shows in its measures
    pipelines.default()(samples.tube(256).points)  # loads what is imported when first needed, so that it is not timed


def _alone(preload, limit, work, job):
    context = get_context("forkserver" if preload else "spawn")
    if preload:
        context.set_forkserver_preload([*preload])
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_send, args=(sender, work, job, not preload), daemon=True)
    process.start()
    sender.close()  # so that the end of the process is the end of the pipe
    try:
        if not receiver.poll(limit):
            return job[0] | {"failure": f"not done after {limit:g} s"}
        row = receiver.recv()
        process.join(10)  # let it tidy up
        return row
    except EOFError:
        process.join()
        return job[0] | {"failure": f"its process died: {cause_of_death(process.exitcode)}"}
    finally:
        process.kill()
        process.join()


def cause_of_death(code: int) -> str:
    """The signal that ended a process, or its exit code."""
    return DEATHS.get(-code, f"exit code {code}")


def _send(sender, work, job, warm_up):
    if warm_up:
        _warm_up()
    sender.send(_row(work, job))


def _row(work, job):
    facts, arguments = job
    try:
        return facts | work(*arguments)
    except Exception as error:  # whatever it is, the other shapes are to be measured
        return facts | {"failure": f"{type(error).__name__}: {error}"}


def application(text: str | None) -> typer.Typer:
    """A program of commands, with its help."""
    return typer.Typer(
        help=text, no_args_is_help=True, pretty_exceptions_enable=False, rich_markup_mode=None, add_completion=False
    )


def writable(path: Path | None) -> Path | None:
    """A path whose folder is there: if not, that is found out now, not after an hour."""
    if path is not None and not path.absolute().parent.is_dir():
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
Page = Annotated[Path | None, typer.Option("--page", exists=True, dir_okay=False, help="Put the tables there, too.")]
FirstPage = Annotated[
    Path | None, typer.Argument(metavar="PAGE", exists=True, dir_okay=False, help="Put the tables there, too.")
]
Sizes = Annotated[str, typer.Option("--sizes", metavar="NUMBERS", help="Points, with commas.")]
Saved = Annotated[Path, typer.Argument(metavar="JSON", exists=True, dir_okay=False)]
File = Annotated[Path, typer.Argument(metavar="PAGE", exists=True, dir_okay=False)]


def publish(
    rows: list[dict],
    make: Callable[[list[dict]], Tables],
    output: Path | None,
    page: Path | None = None,
    part: str = "",
) -> None:
    """Save rows, and print the tables that are made of them and where they were measured, also into a page."""
    save(output, rows)
    tables = make(rows)
    typer.echo(f"{machine()}\n")
    present(tables)
    if page is not None:
        fill(page, {part: f"{machine()}\n\n{markdown(tables)}"})


def named(names: str) -> dict[str, Pipeline]:
    """The pipelines of these names, with commas."""
    try:
        return {name: named_pipeline(name) for name in names.split(",")}
    except InvalidParameterError as error:
        raise typer.BadParameter(str(error)) from None


def numbers(text: str) -> list[int]:
    """Numbers with commas."""
    if not all(word.isdecimal() for word in text.split(",")):
        raise typer.BadParameter(f"{text}: give numbers with commas, such as 1024,4096")
    return [int(word) for word in text.split(",")]


def with_solves(pipeline: Pipeline, n: int) -> Pipeline:
    """The pipeline with exactly n solves, fewer only where one is refused."""
    if n == 0:
        return Pipeline(*(stage for stage in pipeline.stages if not isinstance(stage, Contractor)))
    at_once = ["Contractor.stop=ExplainedScore", "ExplainedScore.threshold=1e9", f"ExplainedScore.min_iterations={n}"]
    return override(pipeline, at_once)
