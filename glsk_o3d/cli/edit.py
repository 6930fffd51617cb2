"""``glsk edit``, ``glsk convert`` and ``glsk rig``: skeletons from file to file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from typer import Option

from .console import echo
from .options import TREE_ENDINGS, CutLoops, Output, SkeletonFile, argument, option, output_option, root_option
from .outputs import check_outputs, skeleton_files, skeleton_writers, tell, write_each
from .reporting import WrongUsage, load_open3d


def edit(
    skeleton: SkeletonFile,
    output: Output = None,
    largest: Annotated[bool, Option("--largest", help="Keep the longest connected component alone.")] = False,
    cut_loops: Annotated[bool, Option("--cut-loops", help="Drop an edge of every loop, and say where.")] = False,
    root: Annotated[Any, root_option("Number vertices from a root outwards, and count orders from there")] = None,
    prune_order: Annotated[int | None, option("N", "Drop branches of a higher order than this.", min=0)] = None,
    prune_length: Annotated[float, option("LENGTH", "Drop shorter branches that end.", min=0)] = 0,
    prune_radius: Annotated[float, option("RADIUS", "Drop thinner branches that end.", min=0)] = 0,
    smooth: Annotated[int, option("PASSES", "Smooth the branches.", min=0, max=10**6)] = 0,
    tolerance: Annotated[
        float | None,
        option("TOLERANCE", "Drop vertices as long as the curve moves by no more than this.", "--simplify", min=0),
    ] = None,
    vertices: Annotated[int | None, option("N", "Keep so many vertices, if the graph allows.", min=1)] = None,
) -> None:
    """Shorten, thin out, smooth or reroot a skeleton.

    What is asked for is done in the order of the options. Lengths are in the units of the file. Orders count from the
    root, the stem is 0.
    """
    from .. import editing
    from ..analysis.summary import structure
    from ..decisions import coordinates
    from ..io.skeletons import read_skeleton

    check_outputs(skeleton_files(output), skeleton, needed="an output with -o")
    before, done = read_skeleton(skeleton), []
    edited = before
    if largest:
        done.append(f"kept one of {edited.n_components} components")
        edited = editing.largest_component(edited)
    if cut_loops:
        edited, ends = editing.cut_loops(edited)
        done += [f"cut a loop at ({coordinates(pair.mean(axis=0))})" for pair in ends]
    if root is not None:
        edited = editing.reroot(edited, root)
        done.append(f"grows from ({coordinates(edited.vertices[0])})")
    if prune_order is not None or prune_length or prune_radius:
        n_ends = len(edited.leaves)
        edited = editing.prune(edited, length=prune_length, radius=prune_radius, order=prune_order)
        done.append(f"pruned {n_ends - len(edited.leaves)} of {n_ends} ends")
    if smooth:
        edited = editing.smooth(edited, passes=smooth)
        done.append(f"smoothed in {smooth} pass{'es' * (smooth > 1)}")
    if tolerance is not None or vertices is not None:
        n_vertices, edited = len(edited.vertices), editing.simplify(edited, tolerance=tolerance, n=vertices)
        done.append(f"kept {len(edited.vertices)} of {n_vertices} vertices")
    written, problems = write_each(skeleton_writers(edited, output))
    counts = {"before": structure(before), "after": structure(edited)}

    def words() -> None:
        pairs = {name: (count, counts["after"][name]) for name, count in counts["before"].items()}
        changed = [f"{name} {old:.6g} -> {new:.6g}" for name, (old, new) in pairs.items() if old != new]
        echo("\n".join([*done, ", ".join(changed) or "all counts are as before"]))

    tell({"done": done, **counts, "files": list(map(str, written))}, words, written, problems)


def convert(
    skeleton: SkeletonFile,
    output: Annotated[list[Path], argument("FILE...", "Other formats, by their endings.")],
    cut_loops: CutLoops = False,
    root: Annotated[Any, root_option("Where the tree grows from, in formats that hold only trees")] = None,
) -> None:
    """Write a skeleton in another format."""
    from ..io.skeletons import read_skeleton

    check_outputs(skeleton_files(output), skeleton)
    trees = tuple(f".{ending}" for ending in TREE_ENDINGS)
    if root is not None and not any(path.name.lower().endswith(trees) for path in output):
        raise WrongUsage(
            f"--root is for formats that hold only trees, {', '.join(TREE_ENDINGS)}: for others use 'glsk edit'"
        )
    written, problems = write_each(skeleton_writers(read_skeleton(skeleton), output, cut_loops=cut_loops, root=root))
    tell(None, lambda: None, written, problems)


def rig(
    skeleton: SkeletonFile,
    mesh: Annotated[Path | None, argument("MESH", "A mesh or a cloud; by default the skeleton's tubes.")] = None,
    output: Annotated[list[Path] | None, output_option("FILE", "The rig, as glb.")] = None,
    root: Annotated[Any, root_option("Which joint moves all others")] = None,
    cut_loops: Annotated[bool, Option("--cut-loops", help="Cut loops open; the surface stays whole.")] = False,
    up: Annotated[str, option("AXIS", "Which axis of the data points up: z or y.")] = "z",
) -> None:
    """Write a mesh with the skeleton's armature, for Blender.

    Joints are at the junctions, where limbs leave them, and along the limbs, at least a radius apart. Bones are named
    by their branch and move what is next to them. Textures do not go along.
    """
    from .. import FileFormatError, read_cloud, read_skeleton, save_rig
    from ..io.formats.gltf import RIG_ENDING
    from ..io.scans import read_mesh

    if output is None or len(output) > 1:
        raise WrongUsage(f"{'nothing to write' if output is None else 'rig writes one file'}: give one output with -o")
    check_outputs([(output[0], (RIG_ENDING,), "rig is glTF")], skeleton, mesh)
    curve = read_skeleton(skeleton)
    surface, moved = None, "the skeleton's own surface"
    if mesh is not None:
        load_open3d()
        try:
            surface = read_mesh(mesh)
            moved = f"{len(surface.vertices)} vertices and {len(surface.triangles)} triangles"
        except FileFormatError:
            surface = read_cloud(mesh)  # knows best what else may be wrong with the file
            moved = f"{len(surface.points)} points"
    bones = save_rig(curve, output[0], surface, cut_loops=cut_loops, root=root, up=up)
    tell(None, lambda: echo(f"{len(bones.edges)} bones move {moved}"), output)
