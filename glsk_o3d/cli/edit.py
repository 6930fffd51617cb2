"""``glsk edit``, ``glsk convert`` and ``glsk rig``: skeletons from file to file."""

from pathlib import Path
from typing import Annotated, Any

from typer import Option

from .console import echo
from .options import (
    CutLoops,
    Preview,
    ReportPage,
    SkeletonFile,
    SkeletonOutput,
    argument,
    option,
    output_option,
    root_option,
)
from .outputs import Output, check_outputs, print_result, skeleton_outputs, write_outputs


def edit(
    skeleton: SkeletonFile,
    output: SkeletonOutput = None,
    limb: Annotated[
        float | None, option("P", "Show limbs from this probability on, 0 for all that were found.", min=0, max=1)
    ] = None,
    largest: Annotated[bool, Option("--largest", help="Keep the longest connected component alone.")] = False,
    cut_loops: Annotated[bool, Option("--cut-loops", help="Drop an edge of every loop.")] = False,
    root: Annotated[Any, root_option("Number vertices from a root outwards, and count orders from there")] = None,
    prune_order: Annotated[int | None, option("N", "Drop branches of a higher order than this.", min=0)] = None,
    prune_length: Annotated[float, option("LENGTH", "Drop shorter branches that end.", min=0)] = 0,
    tolerance: Annotated[
        float | None,
        option("TOLERANCE", "Drop vertices as long as the curve moves by no more than this.", "--simplify", min=0),
    ] = None,
    preview: Preview = None,
    report: ReportPage = None,
) -> None:
    """Turn detail up or down, prune, simplify or reroot a skeleton.

    What is asked for is done in the order of the options. Lengths are in the units of the file. Orders count from the
    root, the stem is 0.
    """
    from .. import FileFormatError, editing
    from ..analysis.summary import structure
    from ..io.skeletons import read_skeleton

    outputs = skeleton_outputs(output, preview, report, title=skeleton.name)
    check_outputs(outputs, skeleton, needed="an output with -o, a --preview or a --report")
    before = edited = read_skeleton(skeleton)
    if limb is not None:
        judged = any(decision.about == "limb" for decision in before.report.decisions)
        if not judged and not any(stage.startswith("Refiner") for stage in before.report.stages):
            needed = "--limb needs the .json or .npz of a run whose Refiner has a limb above 0"
            raise FileFormatError(f"{skeleton}: holds no decisions about limbs: {needed}")
        edited = editing.detailed(edited, limb=limb)
    if largest:
        edited = editing.largest_component(edited)
    if cut_loops:
        edited, _ = editing.cut_loops(edited)
    if root is not None:
        edited = editing.reroot(edited, root)
    if prune_order is not None or prune_length:
        edited = editing.prune(edited, length=prune_length, order=prune_order)
    if tolerance is not None:
        edited = editing.simplify(edited, tolerance=tolerance)
    files, old, new = write_outputs(outputs, edited), structure(before), structure(edited)
    changed = [f"{name} {old[name]:.6g} -> {new[name]:.6g}" for name in old if old[name] != new[name]]
    print_result({"before": old, "after": new}, lambda: echo(", ".join(changed) or "all counts are as before"), files)


def convert(
    skeleton: SkeletonFile,
    files: Annotated[list[Path] | None, argument("FILE...", "Other formats, by their endings.")] = None,
    output: SkeletonOutput = None,
    cut_loops: CutLoops = False,
) -> None:
    """Write a skeleton in another format."""
    from ..io.skeletons import read_skeleton

    outputs = skeleton_outputs([*(files or []), *(output or [])], cut_loops=cut_loops)
    check_outputs(outputs, skeleton, needed="a FILE, or -o FILE")
    print_result({}, lambda: None, write_outputs(outputs, read_skeleton(skeleton)))


def rig(
    skeleton: SkeletonFile,
    output: Annotated[Path, output_option("FILE", "The rig: glb.")],
    mesh: Annotated[Path | None, argument("MESH", "A mesh or a cloud; by default the skeleton's tubes.")] = None,
    joints: Annotated[int | None, option("N", "How many joints, each with its bone.", min=1)] = None,
    symmetric: Annotated[bool, Option("--symmetric", help="Joints left and right are mirror images.")] = False,
    root: Annotated[Any, root_option("Which joint moves all others")] = None,
    cut_loops: Annotated[bool, Option("--cut-loops", help="Cut loops open; the surface stays whole.")] = False,
    up: Annotated[str, option("AXIS", "Which axis of the data points up: z or y.")] = "z",
) -> None:
    """Write a mesh with the skeleton's armature, for Blender.

    Joints are at the junctions, where limbs leave them, and along the limbs, at least a radius apart. Limbs of bipeds
    and quadrupeds have names, other bones those of their branch. They move what is next to them along the surface.
    """
    from .. import FileFormatError, read_cloud, read_skeleton, save_rig
    from ..io.formats.gltf import RIG_ENDING
    from ..io.scans import read_textured_mesh

    check_outputs([Output(output, (RIG_ENDING,), "rig is glTF", save_rig)], skeleton, mesh)
    curve = read_skeleton(skeleton)
    surface: Any = None
    if mesh is not None:
        try:
            surface = read_textured_mesh(mesh)
        except FileFormatError:
            surface = read_cloud(mesh)  # knows best what else may be wrong with the file
    bones = save_rig(curve, output, surface, joints=joints, symmetric=symmetric, cut_loops=cut_loops, root=root, up=up)
    n = len(bones.edges)
    print_result({"bones": n}, lambda: echo(f"{n} bones"), {output: ""})
