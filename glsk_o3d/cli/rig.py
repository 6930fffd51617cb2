"""``glsk rig``: a mesh or a cloud that a skeleton moves."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from typer import Option

from .console import echo
from .options import Quiet, SkeletonFile, Verbose, argument, option, output_option, root_option
from .outputs import check_outputs
from .reporting import WrongUsage, load_open3d


def rig(
    skeleton: SkeletonFile,
    mesh: Annotated[Path | None, argument("MESH", "A mesh or a cloud; by default the skeleton's tubes.")] = None,
    output: Annotated[list[Path] | None, output_option("GLB", "Where to write the rig: binary glTF.")] = None,
    root: Annotated[Any, root_option("Which joint moves all others")] = None,
    cut_loops: Annotated[bool, Option("--cut-loops", help="Cut loops open; the surface stays whole.")] = False,
    up: Annotated[str, option("AXIS", "Which axis of the data points up: z or y.")] = "z",
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Write a mesh with the skeleton's armature, for Blender.

    Every edge of the skeleton is a bone, named by its branch, and moves what is next to it. Textures do not go
    along.
    """
    from .. import FileFormatError, read_cloud, read_skeleton, save_rig
    from ..io.scans import read_mesh

    if output is None or len(output) > 1:
        raise WrongUsage("nothing to write: give one output with -o")
    check_outputs([(output[0], ".glb", "rig is binary glTF")], skeleton, mesh)
    curve, moved = read_skeleton(skeleton), "the skeleton's own surface"
    surface: Any = None
    if mesh is not None:
        load_open3d()
        try:
            surface = read_mesh(mesh)
            moved = f"{len(surface.vertices)} vertices and {len(surface.triangles)} triangles"
        except FileFormatError:
            surface = read_cloud(mesh)  # knows best what else may be wrong with the file
            moved = f"{len(surface.points)} points"
    save_rig(curve, output[0], surface, cut_loops=cut_loops, root=root, up=up)
    if not quiet:
        echo(f"{len(curve.vertices) - curve.n_components} bones move {moved}")
        echo(f"wrote {output[0]}")
