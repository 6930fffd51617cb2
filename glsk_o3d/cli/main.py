"""The command ``glsk``.

Exit codes: 0 all went well; 1 the input or the run failed; 2 the command line is wrong; 130 interrupted with Ctrl-C.
An error is one line on stderr, ``glsk: error: ...``. Results go to stdout; warnings, logs and progress to stderr.
"""

import os
import sys
from typing import Annotated, Any

import typer

from .. import __version__
from ..errors import MissingPackageError, in_words
from ..interop.packages import entry_points
from .batch import batch
from .console import echo, say
from .crosscheck import crosscheck
from .edit import convert, edit, rig
from .filters import filters
from .info import info, view
from .measures import branches, evaluate, grasps
from .reporting import FAILURE_CODE, as_command, reporting
from .run import run
from .skeletonize import demo, skeletonize
from .trees import tree

EPILOG = (
    "Exit codes: 0 all went well; 1 the input or the run failed; 2 the command line is wrong; 130 interrupted. "
    "Results go to stdout; errors (one line each), warnings and progress to stderr."
)
COMMAND_GROUP = "glsk_o3d.commands"


class Commands(typer.Typer):
    """The commands; what Typer itself prints, such as help, ends in a line, too, where nobody takes it."""

    def __call__(self, *args: Any, **options: Any) -> Any:
        if not options.get("standalone_mode", True):  # in somebody's program
            return super().__call__(*args, **options)
        try:
            super().__call__(*args, **options)
        except (OSError, SystemExit) as ended:  # SystemExit in the end, and where a pipe is closed
            problem, code = (ended, 0) if isinstance(ended, OSError) else (ended.__context__, ended.code)
        try:
            print(end="", flush=True)
        except OSError as error:
            problem = problem if isinstance(problem, OSError) or code else error  # else it was said
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # for what Python flushes in the end
        if isinstance(problem, OSError) and not isinstance(problem, BrokenPipeError):
            problem.filename = problem.filename or "standard output: cannot be written"
            say("error", in_words(problem))
        sys.exit(FAILURE_CODE if isinstance(problem, OSError) else code)


app = Commands(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["--help", "-h"]},
    epilog=EPILOG,
)
ANALYSES = (evaluate, crosscheck, branches, tree, grasps)


def add_plugged(app: typer.Typer) -> None:
    """Add the commands of other distributions; the benchmark says how to get it where it is not there."""
    problems: list[str] = []
    entries = {entry.name: entry for entry in entry_points(COMMAND_GROUP, problems)}
    for name, entry in sorted(entries.items()):
        try:
            plugged = entry.load()
            if not isinstance(plugged, typer.Typer):
                raise TypeError(f"it is a {type(plugged).__name__} and should be a typer.Typer")
            app.add_typer(plugged, name=name)
        except Exception as error:  # the code of others: the other commands work without it
            problems.append(f"the command {name!r} ({entry.value}) is left out: {error}")
    for problem in problems:
        say("warning", problem)
    if "benchmark" not in entries:
        settings = {"allow_extra_args": True, "ignore_unknown_options": True, "help_option_names": []}
        app.command("benchmark", context_settings=settings)(_absent_benchmark)


def _absent_benchmark() -> None:
    """Score any program on shapes with known axes (in a distribution of its own)."""
    with reporting():
        cure = "pip install ./benchmarks in a clone of glsk-o3d"
        raise MissingPackageError(f"glsk benchmark needs another distribution: {cure}")


def _version(wanted: bool) -> None:
    if wanted:
        echo(f"glsk-o3d {__version__}")
        raise typer.Exit


@app.callback()
def main(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Curve skeletons from point clouds."""


for function in (skeletonize, batch, run, *ANALYSES, edit, convert, rig, view, demo, filters, info):
    app.command(epilog=EPILOG if function is skeletonize else None)(as_command(function))
add_plugged(app)

if __name__ == "__main__":
    app()
