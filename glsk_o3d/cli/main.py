"""The command ``glsk``.

Exit codes: 0 all went well; 1 the input or the run failed; 2 the command line is wrong; 130 interrupted with Ctrl-C.
An error is one line on stderr, ``glsk: error: ...``. Results go to stdout; warnings, logs and progress to stderr.
"""

from __future__ import annotations

from typing import Annotated

import typer

from .. import __version__
from .batch import batch
from .branches import branches
from .console import echo
from .crosscheck import crosscheck
from .demo import demo
from .edit import convert, edit
from .evaluate import evaluate
from .filters import filters
from .grasps import grasps
from .info import info
from .plugged import add_plugged
from .reporting import reported
from .rerun import rerun
from .rig import rig
from .run import run
from .skeletonize import skeletonize
from .tree import tree
from .view import view

EPILOG = (
    "Exit codes: 0 all went well; 1 the input or the run failed; 2 the command line is wrong; 130 interrupted. "
    "Results go to stdout; errors (one line each), warnings and progress to stderr."
)

app = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["--help", "-h"]},
    epilog=EPILOG,
)
ANALYSES = (evaluate, crosscheck, branches, tree, grasps)
for command in (skeletonize, batch, run, rerun, *ANALYSES, edit, convert, rig, view, demo, filters, info):
    app.command(epilog=EPILOG if command is skeletonize else None)(reported(command))
add_plugged(app)


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


if __name__ == "__main__":
    app()
