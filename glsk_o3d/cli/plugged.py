"""Commands of other distributions, which the entry-point group ``glsk_o3d.commands`` names."""

from __future__ import annotations

import typer

from ..errors import MissingPackageError
from ..interop.packages import entry_points
from .console import say
from .reporting import reporting

COMMAND_GROUP = "glsk_o3d.commands"
ELSEWHERE = {
    "benchmark": ("./benchmarks", "Score any program on shapes with known axes (in a distribution of its own)."),
}
"""Commands that are not in this distribution: the folder of the repository that has them, and what they do."""


def add_plugged(app: typer.Typer) -> None:
    """Add what is installed, and for each command of `ELSEWHERE` that is not, one that says how to get it."""
    problems: list[str] = []
    found = {entry.name: entry for _, entry in entry_points(COMMAND_GROUP, problems)}
    for name, entry in sorted(found.items()):
        try:
            plugged = entry.load()
            if not isinstance(plugged, typer.Typer):
                raise TypeError(f"it is a {type(plugged).__name__} and should be a typer.Typer")
            app.add_typer(plugged, name=name)
        except Exception as error:  # the code of others: the other commands work without it
            problems.append(f"the command {name!r} ({entry.value}) is left out: {error}")
    for problem in problems:
        say("warning", problem)
    for name in ELSEWHERE.keys() - found.keys():
        _add_absent(app, name, *ELSEWHERE[name])


def _add_absent(app: typer.Typer, name: str, folder: str, text: str) -> None:
    def absent() -> None:
        with reporting():
            cure = f"pip install {folder} in a clone of glsk-o3d"
            raise MissingPackageError(f"glsk {name} needs another distribution: {cure}")

    settings = {"allow_extra_args": True, "ignore_unknown_options": True, "help_option_names": []}
    app.command(name, help=text, context_settings=settings)(absent)
