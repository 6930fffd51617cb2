"""``glsk run``: filter scripts."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import MissingPackageError
from .console import echo, print_json, print_table, progress
from .options import CutLoops, Json, Quiet, Verbose
from .reporting import WrongUsage, holding_interrupts, reporting

if TYPE_CHECKING:
    from ..meshlab.steps import Step


def run(
    script: Annotated[
        str | None,
        typer.Argument(metavar="SCRIPT", help="A filter script (.mlx), or the name of one in --list."),
    ] = None,
    scan: Annotated[Path | None, typer.Argument(metavar="SCAN", help="The cloud or mesh it starts from.")] = None,
    output: Annotated[
        list[Path] | None,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE",
            help="Where to write the layer that is the current one at the end, as a rule the last: a skeleton as in "
            "'glsk skeletonize', points as ply, pcd or xyz, a mesh as ply, obj, off or stl; may be repeated.",
        ),
    ] = None,
    listed: Annotated[bool, typer.Option("--list", help="List the scripts that come with the package.")] = False,
    any_filter: Annotated[
        bool,
        typer.Option(
            "--any-meshlab-filter",
            help="Run also filters of MeshLab's that write, read or send files: for scripts that you trust.",
        ),
    ] = False,
    cut_loops: CutLoops = False,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Run a MeshLab filter script, with MeshLab's filters and ours.

    The whole script is checked before anything is run. Filters of MeshLab's own need pymeshlab; --list tells of which
    scripts that is so.
    """
    with reporting(scan, quiet=quiet, verbose=verbose):
        from ..meshlab.layers import Layer, check_ending
        from ..meshlab.steps import PlainLayers, find_script, read_steps
        from .outputs import check_outputs, write_each
        from .running import tell_files

        if listed:
            _list(as_json)
            return
        if script is None or scan is None:
            raise WrongUsage("a SCRIPT and a SCAN are needed: glsk run SCRIPT SCAN -o FILE, or --list")
        steps = read_steps(find_script(script), any_filter)
        outputs, last = output or [], steps[-1]
        what = last.verb.makes if last.verb else "skeleton, points or mesh"
        if outputs or not last.name.startswith("get_"):  # a script that ends in a measurement needs no file
            check_outputs(outputs, None, scan, check_ending=partial(check_ending, what=what))
        with progress(not quiet and not verbose) as update:
            update(f"reading {scan.name}")
            with holding_interrupts():
                if any(step.needs_pymeshlab for step in steps):
                    from ..meshlab.meshset import MeshSet

                    layers: Any = MeshSet()
                    layers.load_scan(scan)
                else:
                    layers = PlainLayers(Layer.read(scan))
            results = []
            for i, step in enumerate(steps, 1):
                doing = f"{i} of {len(steps)}: {step.call.name}"
                update(doing)
                said = layers.apply_step(step, lambda record, doing=doing: update(f"{doing}, solve {record.iteration}"))
                results.append(_plain(said or {}))
            save = partial(layers.save, cut_loops=cut_loops)
            written, problems = write_each(dict.fromkeys(outputs, save), update)
        if as_json:
            done = [{"filter": step.call.name, "result": result} for step, result in zip(steps, results, strict=True)]
            print_json({"steps": done, "files": [str(path) for path in written]})
        elif not quiet:
            _print_results(steps, results)
        tell_files(written, problems, quiet=quiet or as_json)


def _print_results(steps: Sequence[Step], results: Sequence[dict[str, Any]]) -> None:
    from ..analysis.summary import ENDING_FACTS, ending

    for i, (step, result) in enumerate(zip(steps, results, strict=True), 1):
        said = [_said({key: value for key, value in result.items() if key not in ("warnings", *ENDING_FACTS)})]
        if result.keys() >= set(ENDING_FACTS):
            said.append(ending(result) or "")
        told = ", ".join(filter(None, said))
        echo(f"{i}. {step.call.name}" + f": {told}" * bool(told))


def _plain(result: Any) -> Any:
    """What a filter says, without the classes of NumPy and pymeshlab."""
    if isinstance(result, dict):
        return {key: _plain(value) for key, value in result.items()}
    if isinstance(result, list | tuple):
        return [_plain(value) for value in result]
    if hasattr(result, "diagonal") and hasattr(result, "dim_x"):  # pymeshlab.BoundingBox
        return {name: _plain(getattr(result, name)()) for name in ("min", "max", "diagonal")}
    if hasattr(result, "tolist"):
        return result.tolist()
    return result if isinstance(result, bool | int | float | str | None) else str(result)


def _said(value: Any) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{key.replace('_', ' ')} {_said(each)}" for key, each in value.items())
    if isinstance(value, list):
        return f"[{', '.join(map(_said, value))}]"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _list(as_json: bool) -> None:
    from rich.table import Table

    from ..interop.packages import require
    from ..meshlab.script import comment, read_script
    from ..meshlab.steps import meshlabs_own, scripts

    told = [(name, bool(meshlabs_own(read_script(path), path)), comment(path)) for name, path in scripts().items()]
    if as_json:
        print_json([dict(zip(("name", "needs_pymeshlab", "doc"), each, strict=True)) for each in told])
        return
    table = Table.grid(padding=(0, 2))
    table.add_column(no_wrap=True)
    table.add_column()
    for name, needs, doc in told:
        table.add_row(name + "\n  needs pymeshlab" * needs, doc)
    print_table(table)
    try:
        require("pymeshlab")
    except MissingPackageError as error:
        echo(f"\n{error}")
