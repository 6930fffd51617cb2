"""``glsk benchmark``: shapes with known axes, and how well any program finds them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from glsk_o3d.cli.console import echo, print_json, print_rows, progress, say
from glsk_o3d.cli.options import Json, Quiet, Verbose
from glsk_o3d.cli.reporting import WrongUsage, reporting

if TYPE_CHECKING:
    from .running import Outcome

app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["--help", "-h"]},
    help="Score any program on shapes with known axes.",
)

Folder = Annotated[Path, typer.Argument(metavar="FOLDER", help="Of the benchmark, as 'glsk benchmark make' made it.")]
Answers = Annotated[Path, typer.Argument(metavar="ANSWERS", help="A folder of skeletons named SHAPE_VARIANT.")]
Jobs = Annotated[
    int | None, typer.Option("--jobs", metavar="N", min=1, help="Processes; by default one for each core.")
]


@app.command()
def make(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="Made if needed; what it has is not made again.")],
    families: Annotated[
        list[str] | None, typer.Option(metavar="NAMES", help="Of shapes, with commas; by default all of the version.")
    ] = None,
    seeds: Annotated[
        list[str] | None,
        typer.Option(
            metavar="FIRST:BEYOND", help="Or numbers with commas; others than the version's make other shapes."
        ),
    ] = None,
    variants: Annotated[
        list[str] | None, typer.Option(metavar="NAMES", help="Of clouds, with commas; by default all of the version.")
    ] = None,
    version: Annotated[
        str, typer.Option(metavar="NAME", help="Of the benchmark: v1, round shapes; v2 or v3, things.")
    ] = "v1",
    jobs: Jobs = None,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Make the clouds and true axes. The same command again goes on where it was left."""
    with reporting(quiet=quiet, verbose=verbose):
        from . import make as make_folder

        with progress(remaining=True) as update:
            update("drawing shapes")
            made = make_folder(
                folder,
                version,
                families=_words(families),
                seeds=[seed for text in seeds for seed in _seeds(text)] if seeds else None,
                variants=_words(variants),
                jobs=jobs,
                on_shape=update,
            )
        cells = [cloud for told in made.shapes.values() for cloud in told["clouds"].values()]
        same = [cell["sameness"] for cell in cells]
        sameness = {kind: same.count(kind) for kind in ("bits", "rounding", "other")}
        told = {
            **{"folder": str(folder), "version": made.version, "shapes": len(made.shapes), "clouds": len(cells)},
            **{"scored": len(made.scored), "whole": made.whole},
            "sameness": sameness,
        }
        words = ", ".join(f"{count} {kind}" for kind, count in sameness.items() if count)
        _tell(told, {**told, "whole": "yes" if made.whole else "no", "sameness": words or None}, as_json, quiet)
        if same.count("other") and not quiet:
            say("warning", f"{same.count('other')} clouds are not those that {made.version} means: see benchmark.json")
        lacking = ((shape, variant) for shape, each in made.shapes.items() for variant in each.get("not_made", {}))
        impossible = [f"{shape}_{variant}" for shape, variant in lacking]
        if impossible and not quiet:
            say("warning", f"{len(impossible)} clouds cannot be made, see benchmark.json: {', '.join(impossible)}")


@app.command()
def run(
    folder: Folder,
    answers: Answers,
    pipeline: Annotated[
        str | None, typer.Option(metavar="NAME", help="One of ours; default, if there is no command.")
    ] = None,
    command: Annotated[
        str | None,
        typer.Option(
            metavar="WORDS", help="Any program: 'mytool {cloud} {skeleton}', the files that it reads and writes."
        ),
    ] = None,
    ending: Annotated[str, typer.Option(metavar="ENDING", help="Of the files that the command writes.")] = ".ply",
    time_limit: Annotated[float, typer.Option(metavar="SECONDS", help="For each cloud.")] = 600.0,
    memory_limit: Annotated[
        float | None, typer.Option(metavar="GB", help="Of address space for each process, on Linux.")
    ] = None,
    jobs: Annotated[int, typer.Option(metavar="N", min=1, help="Clouds at a time; several disturb the seconds.")] = 1,
    retry: Annotated[bool, typer.Option("--retry", help="Run again what failed before.")] = False,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Run a program over all clouds, each in a process of its own. The same command again goes on where it was left.

    Failures are counted, and do not change the exit code: ANSWERS/times.json says why there is no answer.
    """
    with reporting(quiet=quiet, verbose=verbose):
        from . import run as run_program

        with progress(remaining=True) as update:

            def step(name: str, outcome: Outcome, done: int, total: int) -> None:
                update(name, done, total)
                if outcome.failure is not None and not quiet:
                    say("warning", f"{name}: {outcome.failure}")
                elif verbose:
                    say("info", f"{name}: {outcome.seconds:.2f} s")

            update("starting")
            result = run_program(
                folder,
                answers,
                pipeline=pipeline,
                command=command,
                ending=ending,
                time_limit=time_limit,
                memory_limit=memory_limit,
                jobs=jobs,
                retry=retry,
                on_cloud=step,
            )
        told = {"answers": str(answers), "done": result.done, "failed": result.failed, "skipped": result.skipped}
        _tell({**told, "failures": result.failures}, told, as_json, quiet)


@app.command()
def score(
    folder: Folder,
    answers: Answers,
    output: Annotated[Path, typer.Option("--output", "-o", metavar="JSON", help="Where to write the scores.")],
    name: Annotated[
        str | None, typer.Option(metavar="NAME", help="Of the program, for the table; by default that of its folder.")
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Score the answers of a program. What is missing or unreadable counts as a failure."""
    with reporting(quiet=quiet, verbose=verbose):
        from glsk_o3d.cli.outputs import Output, check_outputs

        from . import Results, leaderboard, score_answers

        check_outputs([Output(output, (".json",), "report is JSON", Results.save)])
        with progress(remaining=True) as update:
            update("reading")
            results = score_answers(folder, answers, name=name, on_cloud=update)
        results.save(output)
        found = leaderboard([results]).entries[0]["all"]
        means = {measure: told[0] for measure, told in found.items() if isinstance(told, list)}
        rows = {"name": results.name, "clouds": found["clouds"], "failures": found["failures"], **means}
        _tell({"name": results.name, **found, "files": [str(output)]}, rows, as_json, quiet, [output])


@app.command()
def sample(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="Made if needed; what it has is not drawn again.")],
    meshes: Annotated[
        Path | None, typer.Argument(metavar="MESHES", help="A folder of meshes; else things of the benchmark.")
    ] = None,
    version: Annotated[str, typer.Option(metavar="NAME", help="Of the benchmark, without MESHES.")] = "v2",
    draws: Annotated[int, typer.Option(metavar="N", min=2, help="Clouds of each object.")] = 5,
    points: Annotated[int, typer.Option(metavar="N", min=1, help="Of each cloud.")] = 4096,
    noise: Annotated[float, typer.Option(metavar="SHARE", min=0, help="Of the diagonal, on every coordinate.")] = 0.0,
    double: Annotated[
        bool, typer.Option("--float64", help="The first one also in float64, as OBJECT_float64.")
    ] = False,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Draw several clouds of each object, for 'run' and 'repeat'."""
    with reporting(quiet=quiet, verbose=verbose):
        from . import sample as sample_objects

        with progress(remaining=True) as update:
            update("reading")
            options: dict[str, Any] = {
                "version": version,
                "draws": draws,
                "n": points,
                "noise": noise,
                "double": double,
            }
            made = sample_objects(folder, meshes, **options, on_object=update)
        told = {"folder": str(folder), "objects": len(made.shapes), "clouds": len(made.clouds)}
        _tell(told, told, as_json, quiet)


@app.command()
def repeat(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="As 'glsk benchmark sample' made it.")],
    answers: Annotated[Path, typer.Argument(metavar="ANSWERS", help="A folder of skeletons named OBJECT_DRAW.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="JSON", help="Write all numbers there.")
    ] = None,
    name: Annotated[
        str | None, typer.Option(metavar="NAME", help="Of the program; by default that of its folder.")
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Compare the answers to several clouds of each object with each other. What is missing counts as a failure."""
    with reporting(quiet=quiet, verbose=verbose):
        from glsk_o3d.cli.outputs import Output, check_outputs

        from . import Repeat
        from . import repeat as compare_answers

        files = [] if output is None else [output]
        check_outputs([Output(output, (".json",), "report is JSON", Repeat.save)])
        with progress(remaining=True) as update:
            update("reading")
            found = compare_answers(folder, answers, name=name, on_object=update)
        for path in files:
            found.save(path)
        names = [str(path) for path in files]
        _tell({**found.as_dict(), "files": names}, found.markdown().rstrip(), as_json, quiet, files)


@app.command()
def sheet(
    folder: Folder,
    answers: Answers,
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="PNG", help="The picture; the raters' CSV is put beside it.")
    ],
    n: Annotated[int, typer.Option("--skeletons", metavar="N", min=1, help="Of clouds taken at random.")] = 24,
    seed: Annotated[int, typer.Option(metavar="N", min=0, help="The same takes the same clouds.")] = 0,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Draw skeletons for raters, and the table that each of them fills in: accept, edit or reject."""
    with reporting(quiet=quiet, verbose=verbose):
        from glsk_o3d.cli.outputs import PICTURE, Output, check_outputs

        from .rating import draw_sheet

        draw = partial(draw_sheet, folder, n=n, seed=seed)
        check_outputs([Output(output, *PICTURE, draw)])
        clouds = draw(answers, output)
        files = [output, output.with_suffix(".csv")]
        _tell({"clouds": clouds, "files": [str(path) for path in files]}, "", as_json, quiet, files)


@app.command()
def rates(
    first: Annotated[Path, typer.Argument(metavar="CSV", help="The table of a sheet, filled in by one rater.")],
    second: Annotated[Path, typer.Argument(metavar="CSV", help="The same by another.")],
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """The accept rates of two raters of a sheet, and Cohen's kappa."""
    with reporting(quiet=quiet, verbose=verbose):
        from .rating import rates as of_raters

        told = of_raters(first, second)
        _tell(told, {**told, "kappa": "-" if told["kappa"] is None else told["kappa"]}, as_json, quiet)


@app.command()
def table(
    scores: Annotated[list[Path], typer.Argument(metavar="SCORES...", help="What 'glsk benchmark score' wrote.")],
    output: Annotated[
        list[Path] | None,
        typer.Option(
            "--output", "-o", metavar="FILE", help="Write it: md or json; may be repeated. Else it is printed."
        ),
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Compare programs: means with intervals, for all clouds and by kind."""
    with reporting(quiet=quiet, verbose=verbose):
        from glsk_o3d.cli.outputs import Output, check_outputs

        from . import Leaderboard, leaderboard, read_results

        files = output or []
        endings, what = (".md", ".json"), "table is Markdown or JSON"
        check_outputs([Output(path, endings, what, Leaderboard.save) for path in files], *scores)
        board = leaderboard(map(read_results, scores))
        for path in files:
            board.save(path)
        text = "" if files else board.markdown().rstrip()
        _tell({**board.as_dict(), "files": [str(path) for path in files]}, text, as_json, quiet, files)


def _tell(
    told: dict[str, Any], shown: dict[str, Any] | str, as_json: bool, quiet: bool, files: Sequence[Path] = ()
) -> None:
    """Print what is told as JSON, or what is shown of it, as rows or a text, and the files that were written."""
    if as_json:
        print_json(told)
    elif not quiet:
        if isinstance(shown, dict):
            print_rows(shown)
        elif shown:
            echo(shown)
        for path in files:
            echo(f"wrote {path}")


def _words(texts: list[str] | None) -> list[str] | None:
    """The names in an option that may be repeated, each time with several."""
    return [word.strip() for text in texts for word in text.split(",") if word.strip()] if texts else None


def _seeds(text: str) -> list[int]:
    """What ``--seeds`` says: ``100:112``, or ``100,105``."""
    try:
        if ":" in text:
            first, beyond = map(int, text.split(":"))
            return list(range(first, beyond))
        return [int(word) for word in text.split(",")]
    except ValueError:
        raise WrongUsage(f"--seeds {text}: write FIRST:BEYOND, or numbers with commas between them") from None
