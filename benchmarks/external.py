"""Other people's clouds and axes as a benchmark: reads what you have downloaded, for `glsk benchmark run` and `score`.

The README beside this file says what each command reads. Nothing is downloaded.
"""

from __future__ import annotations

import os
from fnmatch import fnmatch
from pathlib import Path
from typing import Annotated

import typer
from _external import Source, arteries, check_sizes, plants, trees, vessels
from _runs import application
from glsk_bench import add_shape
from glsk_bench.clouds import VARIANTS
from glsk_bench.folders import begun
from glsk_bench.versions import OWN

from glsk_o3d.errors import GlskError

app = application(__doc__)

Data = Annotated[Path, typer.Argument(metavar="DIR", help="What you have downloaded.", exists=True, file_okay=False)]
Bench = Annotated[Path, typer.Option("--output", "-o", metavar="BENCH", help="The benchmark; made, or added to.")]
Only = Annotated[str, typer.Option("--only", metavar="PATTERN", help="Shapes to take, such as 'tree_small_*'.")]


@app.command("trees")
def _trees(folder: Data, output: Bench, only: Only = "*") -> None:
    """TreePointCloud: drawn trees, scanned in three resolutions; y is up."""
    collect(trees(folder), f"no scan_skel/tree_*.obj in {folder}", output, only)


@app.command("plants")
def _plants(folder: Data, output: Bench, only: Only = "*") -> None:
    """4D plant registration: tomato and maize; the axes are good to a few percent."""
    collect(plants(folder), f"no NAME.graph.txt in {folder}", output, only)


@app.command("vessels")
def _vessels(
    folder: Data,
    output: Bench,
    only: Only = "*",
    variants: Annotated[
        str, typer.Option("--variants", metavar="NAMES", help="Of the clouds drawn for SWC, with commas.")
    ] = "clean,scan2",
    points: Annotated[int, typer.Option("--points", min=64, help="Of every cloud.")] = 4096,
) -> None:
    """SWC files, of vessels or neurons, of which clouds are drawn; and cases of Aneurisk."""
    names = list(dict.fromkeys(variants.split(",")))
    if unknown := [name for name in names if name not in VARIANTS]:
        raise typer.BadParameter(f"no variant {', '.join(unknown)}: there are {', '.join(VARIANTS)}")
    try:
        found = [*vessels(folder, names, points), *arteries(folder, points)]
    except GlskError as error:
        raise typer.BadParameter(str(error)) from None
    collect(found, f"no NAME.swc and no CASE/morphology/centerlines.vtp in {folder}", output, only)


def collect(sources: list[Source], nothing: str, bench: Path, only: str) -> None:
    """Add what can be read to a benchmark, and say what cannot, and why."""
    wanted = [(name, read) for name, read in sources if fnmatch(name, only)]
    if not wanted:
        raise typer.BadParameter(f"none of {len(sources)} shapes is called {only}" if sources else nothing)
    try:
        begun(bench, OWN)
    except (GlskError, OSError) as error:
        raise typer.BadParameter(str(error)) from None
    left_out, shapes, clouds = [], 0, 0
    for name, read in wanted:
        try:
            entry = read()
            left_out += entry.left_out
            if entry.clouds:
                check_sizes(name, entry)
                add_shape(bench, name, entry.clouds, *entry.axis, family=entry.family)
                shapes, clouds = shapes + 1, clouds + len(entry.clouds)
        except (GlskError, OSError, MemoryError) as error:
            left_out.append(str(error) if name in str(error) else f"{name}: {error}")
    typer.echo(f"{bench}: {shapes} shapes, {clouds} clouds")
    if left_out:
        typer.echo("\n  ".join([f"left out, {len(left_out)}:", *left_out]), err=True)
    if not shapes:
        raise typer.Exit(1)


if __name__ == "__main__":
    os.environ.setdefault("MPLBACKEND", "Agg")
    app()
