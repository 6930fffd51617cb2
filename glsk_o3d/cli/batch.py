"""``glsk batch``: many clouds."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .console import echo, print_json, print_rows, progress, say
from .options import (
    SKELETON_ENDINGS,
    CutLoops,
    DropInvalid,
    Json,
    PipelineName,
    Quiet,
    Recipe,
    Settings,
    Verbose,
    Where,
)
from .reporting import WrongUsage, reporting, said_here

if TYPE_CHECKING:
    from ..batch import BatchResult, Plan

SHOWN_NAMES = 5  # fitted: that fit on a line


def batch(
    inputs: Annotated[
        list[str],
        typer.Argument(
            metavar="DIR|GLOB|LIST|SCAN...",
            help="Folders, glob patterns in quotes, lists (.txt, a path per line, from the working folder), and scans.",
        ),
    ],
    output: Annotated[
        Path,
        typer.Option("--output", "-o", metavar="FOLDER", help="For the skeletons and the ledger; made if needed."),
    ],
    formats: Annotated[
        str,
        typer.Option("--format", metavar="NAMES", help=f"With commas: {', '.join(SKELETON_ENDINGS)}."),
    ] = "ply",
    preview: Annotated[bool, typer.Option("--preview", help="Also draw each cloud with its skeleton (png).")] = False,
    recursive: Annotated[bool, typer.Option("--recursive", "-r", help="Take also the sub-folders of folders.")] = False,
    pipeline: PipelineName = "default",
    recipe: Recipe = None,
    settings: Settings = None,
    drop_invalid: DropInvalid = False,
    cut_loops: CutLoops = False,
    workers: Annotated[
        int | None,
        typer.Option("--workers", metavar="N", min=1, help="Processes; by default one for each core at hand."),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            "--scheduler",
            metavar="ADDRESS|FILE",
            help="Work on a Dask cluster: tcp://host:port, or the file that its scheduler wrote. Its workers need the "
            "same files by the same paths.",
        ),
    ] = None,
    where: Where = None,
    by: Annotated[
        str | None,
        typer.Option("--by", metavar="ATTRIBUTE", help="One skeleton for each value of it, such as treeID."),
    ] = None,
    tiles: Annotated[
        float | None,
        typer.Option(
            "--tiles",
            metavar="SIZE",
            help="Take large scenes apart into tiles of at most this size, in the cloud's units, and join their "
            "skeletons into one.",
        ),
    ] = None,
    overlap: Annotated[
        float | None,
        typer.Option(
            "--overlap",
            metavar="LENGTH",
            help="How far tiles look beyond themselves: at least 2.7 times the radius of what crosses their faces; by "
            "default an eighth of SIZE.",
        ),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Do also what is done already.")] = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only say what would be done, and why.")] = False,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Skeletonise many scans, several at a time.

    A scan that fails does not stop the others. FOLDER/ledger.jsonl (and ledger.csv) has a line for each; the same
    command again skips what is done and tries again what failed. Ctrl-C leaves all that in order; press it twice not to
    wait for scans that are in work. The exit code is 1 if a scan failed.
    """
    with reporting(quiet=quiet, verbose=verbose):
        from ..batch import plan_batch, run_batch
        from .overrides import choose

        if workers is not None and scheduler is not None:
            raise WrongUsage("--workers and --scheduler: the cluster has its own workers: give one of them")
        endings = [word.strip() for word in formats.split(",") if word.strip()]
        what: dict[str, Any] = dict(
            pipeline=choose(pipeline, recipe, settings or [], drop_invalid),
            formats=endings,
            preview=preview,
            cut_loops=cut_loops,
            recursive=recursive,
            where=where,
            by=by,
            tiles=tiles,
            overlap=overlap,
            force=force,
        )
        if dry_run:
            _print_plan(plan_batch(inputs, output, **what), as_json, quiet)
            return
        with progress(not quiet, remaining=True) as update:
            watch = _Watch(update, quiet, verbose)
            update("looking for what is done")
            result = run_batch(
                inputs,
                output,
                workers=workers,
                scheduler=scheduler,
                on_plan=watch.begin,
                on_result=watch.step,
                **what,
            )
        _tell(result, watch, as_json, quiet)


def _tell(result: BatchResult, watch: _Watch, as_json: bool, quiet: bool) -> None:
    """Say what a batch did; BatchError if something failed."""
    from ..errors import BatchError

    told = {
        **{"done": result.done, "skipped": result.skipped, "failed": result.failed},
        **{"seconds": round(result.seconds, 3), "clouds_per_second": round(result.rate, 3)},
        "ledger": str(result.ledger),
    }
    if as_json:
        failures = [
            {name: row.get(name) for name in ("input", "error")}
            for row in result.rows.values()
            if row["status"] == "failed"
        ]
        print_json({**told, "failures": failures, "left_out": watch.left_out})
    elif not quiet:
        warned = sum(bool(row.get("warnings")) for row in result.rows.values())
        print_rows({**told, "with_warnings": f"{warned}, see ledger.csv" if warned else None})
    if result.failed:
        table = result.ledger.with_suffix(".csv")
        raise BatchError(f"{result.failed} of {len(result.rows)} scans failed: {table} says why")


class _Watch:
    """Shows how far a batch is; says what fails as soon as it does."""

    def __init__(self, update, quiet: bool, verbose: bool):
        self._update, self._quiet, self._verbose = update, quiet, verbose
        self._done = self._failed = self._total = 0
        self.left_out: dict[str, str] = {}

    def begin(self, plan: Plan) -> None:
        self._start, self._total, self.left_out = time.perf_counter(), len(plan.todo), plan.left_out
        if not self._quiet:
            tell_left_out(plan.left_out)
        self._update("starting", 0, self._total)

    def step(self, row: dict[str, Any]) -> None:
        failed = row["status"] == "failed"
        self._done, self._failed = self._done + 1, self._failed + failed
        rate = self._done / (time.perf_counter() - self._start)
        self._update(f"{rate:.3g} scans/s" + f", {self._failed} failed" * (self._failed > 0), self._done, self._total)
        if failed and not self._quiet:
            say("warning", f"{row['input']}: {said_here(row['error'])}")
        elif self._verbose:
            say("info", f"{row['input']}: {row['vertices']} vertices in {row['seconds']:.2f} s")


def _print_plan(plan: Plan, as_json: bool, quiet: bool) -> None:
    if as_json:
        tasks = [{"input": task.job.source, "why": task.why, "outputs": task.job.outputs} for task in plan.tasks]
        print_json(
            {
                "todo": len(plan.todo),
                "skipped": plan.skipped,
                "output": str(plan.out_dir),
                "tasks": tasks,
                "left_out": plan.left_out,
            }
        )
    elif not quiet:
        for task in plan.todo:
            echo(f"{task.job.source} ({task.why}) -> {', '.join(task.job.outputs)}")
        echo(f"{len(plan.todo)} to do, {plan.skipped} to skip")
        tell_left_out(plan.left_out)


def tell_left_out(left_out: dict[str, str]) -> None:
    """Say which files are not taken, and why: the reason once, with the names of the first files."""
    for reason in dict.fromkeys(left_out.values()):
        files = [Path(path).name for path, why in left_out.items() if why == reason]
        named = ", ".join(sorted(files)[:SHOWN_NAMES]) + ", ..." * (len(files) > SHOWN_NAMES)
        say("info", f"left out {len(files)}: {reason} ({named})")
