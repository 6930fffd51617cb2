"""``glsk batch``: many clouds."""

from __future__ import annotations

from collections import Counter
from itertools import count
from pathlib import Path
from typing import Annotated, Any

from typer import Option

from ..apps import batch as batches
from . import options
from .console import echo, flags, print_rows, progress, say
from .options import SKELETON_ENDINGS, argument, option, output_option
from .outputs import print_result
from .reporting import WrongUsage


def batch(
    inputs: Annotated[list[str], argument("DIR|LIST|SCAN...", "Folders, lists (.txt, a path per line), and scans.")],
    output: Annotated[Path, output_option("FOLDER", "For the skeletons and the ledger; made if needed.")],
    formats: Annotated[str, option("NAMES", f"With commas: {', '.join(SKELETON_ENDINGS)}.", "--format")] = "ply",
    preview: Annotated[bool, Option("--preview", help="Also draw each cloud with its skeleton (png).")] = False,
    recursive: Annotated[bool, Option("--recursive", "-r", help="Take also the sub-folders of folders.")] = False,
    pipeline: options.PipelineName = "default",
    settings: options.Settings = None,
    sample: options.Sample = None,
    drop_invalid: options.DropInvalid = False,
    cut_loops: options.CutLoops = False,
    accept: Annotated[
        str | None,
        option("VERDICT", "Write only skeletons with this verdict, good or doubtful, or a better one."),
    ] = None,
    workers: Annotated[int | None, option("N", "Processes; by default one for each core at hand.", min=1)] = None,
    shard: Annotated[
        str | None, option("I/N", "Take every N-th scan from the I-th on, such as 2/8: a job of an array.")
    ] = None,
    where: options.Where = None,
    tiles: Annotated[
        float | None, option("SIZE", "Skeletonise scenes in tiles of at most this size, and join them.")
    ] = None,
    overlap: Annotated[
        float | None, option("LENGTH", "Of tiles, at least 2.7 radii of what is cut; by default an eighth of SIZE.")
    ] = None,
    force: Annotated[bool, Option("--force", help="Do everything again, also scans that are done.")] = False,
    dry_run: Annotated[bool, Option("--dry-run", help="Only say what would be done, and why.")] = False,
) -> None:
    """Skeletonise many scans, several at a time.

    A scan that fails does not stop the others. FOLDER/ledger.jsonl has a line for each; the same command again skips
    what is done, and tries again what failed or was in work at Ctrl-C. The exit code is 1 if a scan failed.
    """
    from .overrides import choose

    what: dict[str, Any] = dict(
        pipeline=choose(pipeline, settings, drop_invalid, sample),
        formats=[word.strip() for word in formats.split(",") if word.strip()],
        preview=preview,
        cut_loops=cut_loops,
        accept=accept,
        recursive=recursive,
        shard=_shard(shard),
        where=where,
        tiles=tiles,
        overlap=overlap,
        force=force,
    )
    if dry_run:
        _print_plan(batches.plan_batch(inputs, output, **what))
        return
    left_out, total, done = dict[str, str](), 0, count(1)
    with progress(remaining=True) as update:
        update("looking for what is done")

        def begin(plan: batches.Plan) -> None:
            nonlocal left_out, total
            left_out, total = plan.left_out, len(plan.todo)
            _print_left_out(plan)

        def step(row: dict[str, Any]) -> None:
            update(f"done: {row['input']}", next(done), total)
            if row["status"] == "failed" and not flags.quiet:
                say("warning", f"{row['input']}: {row['error']}")

        what |= dict(workers=workers, on_plan=begin, on_result=step)
        result = batches.run_batch(inputs, output, **what)
    _print_result(result, left_out)


def _shard(text: str | None) -> tuple[int, int] | None:
    if text is None:
        return None
    index, slash, count = text.partition("/")
    if not (slash and index.isdecimal() and count.isdecimal()):
        raise WrongUsage(f"--shard: {text!r}: write it as I/N, for example 2/8")
    return int(index), int(count)


def _print_result(result: batches.BatchResult, left_out: dict[str, str]) -> None:
    """Print what a batch did; BatchError if something failed."""
    from ..errors import BatchError

    rows = result.rows.values()
    failures = [{"input": row["input"], "error": row["error"]} for row in rows if row["status"] == "failed"]
    facts: dict[str, Any] = {name: getattr(result, name) for name in ("done", "skipped", "failed")}
    facts |= {"seconds": round(result.seconds, 3), "clouds_per_second": round(result.rate, 3)}
    facts |= {"with_warnings": sum(bool(row.get("warnings")) for row in rows), "ledger": str(result.ledger)}
    print_result({**facts, "failures": failures, "left_out": left_out}, lambda: print_rows(facts))
    if failures:
        raise BatchError(f"{len(failures)} of {len(rows)} scans failed: {result.ledger} says why")


def _print_plan(plan: batches.Plan) -> None:
    def words() -> None:
        for task in plan.todo:
            echo(f"{task.source} ({task.why}) -> {', '.join(task.outputs)}")
        echo(f"{len(plan.todo)} to do, {plan.skipped} to skip")
        _print_left_out(plan)

    tasks = [{"input": task.source, "why": task.why, "outputs": task.outputs} for task in plan.tasks]
    facts = {"todo": len(plan.todo), "skipped": plan.skipped, "output": str(plan.out_dir)}
    print_result({**facts, "tasks": tasks, "left_out": plan.left_out}, words)


def _print_left_out(plan: batches.Plan) -> None:
    """Say how many files are not taken, and why; their names are in JSON."""
    for reason, n in Counter(plan.left_out.values()).items():
        if not flags.quiet:
            say("info", f"left out {n}: {reason}")
