"""``glsk crosscheck``: whether a scan is dense and clean enough."""

from pathlib import Path
from typing import Annotated, Any

from ..errors import InvalidCloudError
from .console import flags, print_rows, progress
from .options import DropInvalid, Numbers, PipelineName, ScanFile, option
from .outputs import PICTURE_FILE, REPORT_FILE, check_outputs, tell
from .reporting import WrongUsage, load_open3d


def crosscheck(
    scan: ScanFile,
    mesh: Annotated[
        Path | None, option("MESH", "A mesh of the same surface to compare with: ply, off, obj, stl, gltf or glb.")
    ] = None,
    method: Annotated[
        str,
        option(
            "NAME",
            "How to make a mesh: ball_pivoting, poisson, or auto: Poisson only where ball pivoting leaves holes.",
        ),
    ] = "auto",
    output: Numbers = None,
    picture: Annotated[Path | None, option("PNG", "Draw the disagreement on the cloud, and both skeletons.")] = None,
    pipeline: PipelineName = "default",
    max_points: Annotated[int, option("N", "Thin larger clouds to so many points; 0 for no limit.")] = 16384,
    drop_invalid: DropInvalid = False,
) -> None:
    """Check a scan against a mesh made from it.

    Both skeletons are computed, that of the mesh with libigl's Laplacian, and compared. The verdict is one of
    'agrees', 'agrees in part' and 'do not trust'; then the exit code is 0. 'cannot tell', with exit code 1, says that
    the skeletons differ but the mesh is at fault.
    """
    from .. import read_cloud
    from ..crosscheck import cross_check, save_crosscheck_picture
    from ..crosscheck.agreement import UNTOLD
    from ..interop.atomic import write_json
    from ..io.scans import read_mesh
    from ..viewing.figures import printable
    from .overrides import choose

    if mesh is not None and method != "auto":
        raise WrongUsage("--mesh gives a mesh: there is none to make with --method")
    check_outputs([(output, *REPORT_FILE), (picture, *PICTURE_FILE)], scan, mesh)
    chosen = choose(pipeline, drop_invalid=drop_invalid)
    with progress(not flags.quiet and not flags.verbose) as update:
        update(f"reading {scan.name}")
        load_open3d()
        cloud = read_cloud(scan)
        surface = method if mesh is None else read_mesh(mesh)
        update("comparing with a mesh")
        check = cross_check(cloud, surface, pipeline=chosen, max_points=max_points or None)
        names = {"scan": printable(scan), "given_mesh": None if mesh is None else printable(mesh)}
        facts = {**names, **check.to_dict()}
        if output is not None:
            write_json(output, facts)
        if picture is not None:
            update(f"drawing {picture.name}")
            save_crosscheck_picture(check, picture, title=scan.name)
    files = [path for path in (output, picture) if path is not None]
    whole = {**facts, "files": list(map(str, files))}
    tell(whole, lambda: print_rows(_in_words(facts), title=f"{scan}: {check.verdict}"), files)
    if check.verdict == UNTOLD:
        raise InvalidCloudError(
            f"the check says nothing about the skeleton: {check.reasons[0]}; give "
            + ("another mesh" if mesh else "a mesh of its surface with --mesh, or another --method")
        )


def _in_words(facts: dict[str, Any]) -> dict[str, Any]:
    from ..crosscheck.agreement import MEANINGS

    rows, skeletons, mesh = facts["rows"], facts["skeletons"], facts["mesh"]
    points = "{used} of {given}; {turned} turned by more than 30 degrees, {not_compared} not compared"
    shown = {
        "because": facts["reasons"],
        "which is": MEANINGS[facts["verdict"]],
        "points": points.format(**facts["points"]),
        "mesh": f"{facts['surface'].replace('_', ' ')}, {mesh['vertices']} vertices, {mesh['faces']} triangles",
        "rings compared": f"{rows['compared']} of {rows['closed']} closed ones ({rows['covered']:.0%})",
    }
    if rows["one_to_one"] and rows["compared"]:
        shown["same rings"] = f"{rows['same_rings']:.0%} ({rows['common_triangles']:.0%} of the triangles)"
    if rows["angle"]:
        angle = "median {median:.2f}, 75 % below {p75:.1f}, 90 % below {p90:.1f} degrees"
        length = "median {median:.2f}, 80 % from {p10:.2f} to {p90:.2f} times the mesh's"
        shown |= {"angle": angle.format(**rows["angle"]), "length": length.format(**rows["length"])}
    for name, words in (("distance", "mean distance"), ("hausdorff95", "95 % within")):
        shown[words] = f"{skeletons[f'{name}_in_radii']:.2f} local radii ({skeletons[name]:.2%} of the diagonal)"
    for name in ("components", "loops", "leaves"):
        shown[name] = "{} and {}".format(*skeletons[name])
    return shown
