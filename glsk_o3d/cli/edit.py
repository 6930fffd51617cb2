"""``glsk edit`` and ``glsk convert``: skeletons from file to file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .console import echo
from .options import ROOT_WORDS, SKELETON_FILE, TREE_ENDINGS, CutLoops, Output, Quiet, Verbose, root_place
from .reporting import WrongUsage, reporting

if TYPE_CHECKING:
    from ..skeleton import Skeleton

Source = Annotated[Path, typer.Argument(metavar="SKELETON", help=SKELETON_FILE)]


def edit(
    skeleton: Source,
    output: Output = None,
    largest: Annotated[bool, typer.Option("--largest", help="Keep the longest connected component alone.")] = False,
    cut_loops: Annotated[bool, typer.Option("--cut-loops", help="Drop an edge of every loop, and say where.")] = False,
    root: Annotated[
        str | None,
        typer.Option(
            "--root",
            metavar="ROOT",
            help=f"Number vertices from a root outwards, and count orders from there: {ROOT_WORDS}.",
        ),
    ] = None,
    prune_order: Annotated[
        int | None, typer.Option("--prune-order", metavar="N", min=0, help="Drop branches of a higher order than this.")
    ] = None,
    prune_length: Annotated[
        float, typer.Option("--prune-length", metavar="LENGTH", min=0, help="Drop shorter branches that end.")
    ] = 0,
    prune_radius: Annotated[
        float, typer.Option("--prune-radius", metavar="RADIUS", min=0, help="Drop thinner branches that end.")
    ] = 0,
    smooth: Annotated[
        int, typer.Option("--smooth", metavar="PASSES", min=0, max=10**6, help="Smooth the branches.")
    ] = 0,
    tolerance: Annotated[
        float | None,
        typer.Option("--simplify", metavar="TOLERANCE", min=0, help="Drop vertices that leave the curve as near."),
    ] = None,
    vertices: Annotated[
        int | None, typer.Option("--vertices", metavar="N", min=1, help="Keep so many vertices, if the graph allows.")
    ] = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Shorten, thin out, smooth or reroot a skeleton.

    What is asked for is done in the order of the options. Lengths are in the units of the file. Orders count from the
    root, the stem is 0.
    """
    with reporting(quiet=quiet, verbose=verbose):
        from ..io.skeletons import read_skeleton
        from .outputs import check_outputs

        if tolerance is not None and vertices is not None:
            raise WrongUsage("--simplify and --vertices: choose one of them")
        if not output:
            raise WrongUsage("nothing to write: give an output with -o")
        check_outputs(output, skeleton=skeleton)
        found, told = _graph(read_skeleton(skeleton), largest, cut_loops, root_place(root))
        pruning = dict(length=prune_length, radius=prune_radius, order=prune_order)
        found, more = _curves(found, pruning, smooth, tolerance, vertices)
        _write(found, output or [], [*told, *more], quiet)


def convert(
    skeleton: Source,
    output: Annotated[list[Path], typer.Argument(metavar="FILE...", help="Other formats, by their endings.")],
    cut_loops: CutLoops = False,
    root: Annotated[
        str | None,
        typer.Option(
            "--root",
            metavar="ROOT",
            help=f"Where the tree grows from, in formats that hold only trees: {ROOT_WORDS}. By default, where it was "
            "made to grow from, or else the part with the most volume.",
        ),
    ] = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Write a skeleton in another format."""
    with reporting(quiet=quiet, verbose=verbose):
        from ..io.skeletons import FORMATS, read_skeleton, skeleton_ending
        from .outputs import check_outputs

        check_outputs(output, skeleton=skeleton)
        if root is not None and not any(FORMATS[skeleton_ending(path)].trees for path in output):
            raise WrongUsage(
                f"--root is for formats that hold only trees, {', '.join(TREE_ENDINGS)}: for others use 'glsk edit'"
            )
        _write(read_skeleton(skeleton), output, [], quiet, cut_loops=cut_loops, root=root_place(root))


def _graph(skeleton: Skeleton, largest: bool, cut: bool, root: int | str | None) -> tuple[Skeleton, list[str]]:
    from .. import editing
    from ..judgements import coordinates

    told = []
    if largest:
        told.append(f"kept one of {skeleton.n_components} components")
        skeleton = editing.largest_component(skeleton)
    if cut:
        skeleton, ends = editing.cut_loops(skeleton)
        told += [f"cut a loop at ({coordinates(pair.mean(axis=0))})" for pair in ends]
    if root is not None:
        skeleton = editing.reroot(skeleton, root)
        told.append(f"grows from ({coordinates(skeleton.vertices[0])})")
    return skeleton, told


def _curves(
    skeleton: Skeleton, pruning: dict, smooth: int, tolerance: float | None, vertices: int | None
) -> tuple[Skeleton, list[str]]:
    from .. import editing

    told = []
    if pruning["order"] is not None or pruning["length"] or pruning["radius"]:
        ends, skeleton = len(skeleton.leaves), editing.prune(skeleton, **pruning)
        told.append(f"pruned {ends - len(skeleton.leaves)} of {ends} ends")
    if smooth:
        skeleton = editing.smooth(skeleton, passes=smooth)
    if tolerance is not None or vertices is not None:
        before, skeleton = len(skeleton.vertices), editing.simplify(skeleton, tolerance=tolerance, n=vertices)
        told.append(f"kept {len(skeleton.vertices)} of {before} vertices")
    return skeleton, told


def _write(
    skeleton: Skeleton,
    outputs: list[Path],
    told: list[str],
    quiet: bool,
    *,
    cut_loops: bool = False,
    root: int | str | None = None,
) -> None:
    from .outputs import write
    from .running import tell_files

    written, problems = write(
        skeleton, outputs, None, title="", cut_loops=cut_loops, root=root, update=lambda text: None
    )
    for line in told if not quiet else ():
        echo(line)
    tell_files(written, problems, quiet=quiet)
