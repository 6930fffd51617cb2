"""``glsk crosscheck``: whether a scan is dense and clean enough."""

from pathlib import Path
from typing import Annotated, Any

from ..errors import InvalidCloudError
from .console import flags, print_rows, progress
from .options import DropInvalid, Numbers, PipelineName, ScanFile, option
from .outputs import REPORT_FILE, check_outputs, tell
from .reporting import load_open3d


def crosscheck(
    scan: ScanFile,
    method: Annotated[
        str,
        option(
            "NAME",
            "How to make a mesh: ball_pivoting, poisson, or auto: Poisson only where ball pivoting leaves holes.",
        ),
    ] = "auto",
    output: Numbers = None,
    labelled: Annotated[
        Path | None,
        option("FILE", "The points with their angles, for 'glsk view --color angle': ply, pcd or npz."),
    ] = None,
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
    from ..crosscheck import cross_check
    from ..crosscheck.agreement import UNTOLD
    from ..interop.atomic import write_json
    from ..interop.packages import import_open3d
    from ..io.scans import WRITTEN_CLOUD_ENDINGS, save_tensor_cloud
    from ..viewing.figures import printable
    from .overrides import choose

    check_outputs([(output, *REPORT_FILE), (labelled, WRITTEN_CLOUD_ENDINGS, "file is a cloud with labels")], scan)
    chosen = choose(pipeline, drop_invalid=drop_invalid)
    with progress(not flags.quiet and not flags.verbose) as update:
        update(f"reading {scan.name}")
        load_open3d()
        cloud = read_cloud(scan)
        update("comparing with a mesh")
        check = cross_check(cloud, method, pipeline=chosen, max_points=max_points or None)
        facts = {"scan": printable(scan), **check.to_dict()}
        if output is not None:
            write_json(output, facts)
        if labelled is not None:
            marked = import_open3d().t.geometry.PointCloud(check.points)
            marked.point.angle = check.angle[:, None]
            save_tensor_cloud(marked, labelled)
    files = [path for path in (output, labelled) if path is not None]
    whole = {**facts, "files": list(map(str, files))}
    tell(whole, lambda: print_rows(_in_words(facts), title=f"{scan}: {check.verdict}"), files)
    if check.verdict == UNTOLD:
        raise InvalidCloudError(f"the check says nothing about the skeleton: {check.reasons[0]}; try another --method")


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
        shown["same rings"] = f"{rows['same_rings']:.0%}"
    if rows["angle"]:
        angle = "median {median:.2f}, 75 % below {p75:.1f}, 90 % below {p90:.1f} degrees"
        shown["angle"] = angle.format(**rows["angle"])
    for name, words in (("distance", "mean distance"), ("hausdorff95", "95 % within")):
        shown[words] = f"{skeletons[f'{name}_in_radii']:.2f} local radii"
    for name in ("components", "loops"):
        shown[name] = "{} and {}".format(*skeletons[name])
    return shown
