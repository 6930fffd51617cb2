"""``glsk rig``: a mesh or a cloud that a skeleton moves."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from .console import echo
from .options import ROOT_WORDS, SKELETON_FILE, Quiet, Verbose, root_place
from .reporting import WrongUsage, holding_interrupts, reporting


def rig(
    skeleton: Annotated[
        Path,
        typer.Argument(metavar="SKELETON", help=SKELETON_FILE),
    ],
    mesh: Annotated[
        Path | None,
        typer.Argument(
            metavar="MESH",
            help="What it moves: a mesh, or a cloud, in any format that 'glsk skeletonize' reads. By default the "
            "skeleton's tubes.",
        ),
    ] = None,
    output: Annotated[
        list[Path] | None, typer.Option("--output", "-o", metavar="GLB", help="Where to write the rig: binary glTF.")
    ] = None,
    root: Annotated[
        str | None,
        typer.Option("--root", metavar="ROOT", help=f"Which joint moves all others: {ROOT_WORDS}."),
    ] = None,
    cut_loops: Annotated[
        bool, typer.Option("--cut-loops", help="Cut loops of the skeleton open; the surface stays whole.")
    ] = False,
    up: Annotated[str, typer.Option("--up", metavar="AXIS", help="Which axis of the data points up: z or y.")] = "z",
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Write a mesh with the skeleton's armature, for Blender.

    Every edge of the skeleton is a bone, named by its branch, and moves what is next to it. Textures do not go
    along.
    """
    with reporting(mesh, quiet=quiet, verbose=verbose):
        import numpy as np

        from ..errors import FileFormatError
        from ..io.formats.gltf import UPRIGHT, save_rig
        from ..io.skeletons import read_skeleton
        from .outputs import check_findings

        if output is None or len(output) > 1:
            raise WrongUsage("nothing to write: give one output with -o")
        if up not in UPRIGHT:
            raise WrongUsage(f"--up {up}: must be {' or '.join(UPRIGHT)}")
        check_findings([(output[0], ".glb", "rig is binary glTF")], skeleton, mesh)
        curve = read_skeleton(skeleton)
        if mesh is None and not len(curve.points) and not np.isfinite(curve.radii).all():
            raise FileFormatError(f"{skeleton}: holds neither radii nor points to make a surface of: give a MESH")
        with holding_interrupts():
            surface = None if mesh is None else _surface(mesh)
        save_rig(curve, output[0], surface, cut_loops=cut_loops, root=root_place(root), up=up)
        if not quiet:
            bones = len(curve.vertices) - curve.n_components
            echo(f"{bones} bones move {_told(surface)}")
            echo(f"wrote {output[0]}")


def _surface(path: Path) -> Any:
    """A mesh, or where there are no triangles, a cloud."""
    from ..errors import FileFormatError
    from ..io.meshes import read_mesh
    from ..io.scans import read_cloud

    try:
        return read_mesh(path)
    except FileFormatError:
        return read_cloud(path)  # knows best what else may be wrong with the file


def _told(surface: Any) -> str:
    if surface is None:
        return "the skeleton's own surface"
    if hasattr(surface, "triangles"):
        return f"{len(surface.vertices)} vertices and {len(surface.triangles)} triangles"
    return f"{len(surface.points)} points"
