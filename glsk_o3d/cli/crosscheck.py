"""``glsk crosscheck``: whether another way to the skeleton of a scan gives the same."""

from pathlib import Path
from typing import Annotated, Any

from ..errors import did_you_mean
from .console import print_rows, progress, value_in_words
from .options import DropInvalid, PipelineName, Preview, ReportPage, ScanFile, option
from .outputs import Output, check_outputs, tell, write_each
from .reporting import WrongUsage

MOST_PARTS = 3  # of the mesh that are told of
MEANINGS = {
    "agrees": "of 275 such clouds 272 had the right graph",
    "agrees in part": "look at what is said above: of 34 such clouds 30 had the right graph",
    "do not trust": "look at what is said above: of 74 such clouds 28 had the right graph",
    "cannot tell": "the mesh is at fault: no word against the skeleton",
}
"""What to expect of each verdict; the numbers are those of docs/crosscheck.md."""


def crosscheck(
    scan: ScanFile,
    labelled: Annotated[
        Path | None, option("CLOUD", "The points with their angles, as ply: 'glsk view CLOUD' shows them in colours.")
    ] = None,
    preview: Preview = None,
    report: ReportPage = None,
    mesh: Annotated[
        str, option("MESH", "auto, poisson, ball_pivoting, or a file with a mesh of the object in the scan's units.")
    ] = "auto",
    pipeline: PipelineName = "default",
    drop_invalid: DropInvalid = False,
) -> None:
    """Check the skeleton of a scan against a mesh made from it.

    libigl's Laplacian on the mesh is compared with that of the points, the skeleton that it contracts to with that of
    the scan, and both with the mesh's handles. The verdict is one of 'agrees', 'agrees in part', 'do not trust' and
    'cannot tell', where the mesh is at fault.
    """
    from ..apps.crosscheck import cross_check
    from ..apps.crosscheck.check import MADE_BY
    from ..interop.clouds import SurfaceMesh
    from ..io.scans import read_mesh, read_scan
    from ..viewing.figures import printable
    from .overrides import choose

    outputs = [
        Output(labelled, (".ply",), "file is a cloud with angles", _save_angles),
        Output(preview, (".png",), "picture is a PNG", _save_picture),
        Output(report, (".html", ".htm"), "report is a page", _save_page),
    ]
    own = None if mesh in MADE_BY else Path(mesh)
    if own and not own.suffix:
        raise WrongUsage(f"--mesh: {did_you_mean(mesh, MADE_BY, 'mesh')}")
    check_outputs(outputs, scan, own)
    chosen = choose(pipeline, drop_invalid=drop_invalid)
    with progress() as update:
        update(f"reading {scan.name}")
        held = read_scan(scan)
        cloud = SurfaceMesh(held.positions, held.triangles)
        surface = read_mesh(own) if own else mesh
        update("comparing with a mesh")
        check = cross_check(cloud, pipeline=chosen, mesh=surface)
        files = write_each(outputs, check, update)
    facts = {"scan": printable(scan), **check.to_dict()}
    tell(facts, lambda: print_rows(_told(check), title=f"{scan}: {check.verdict}"), files)


def _told(check: Any) -> dict[str, Any]:
    """The facts that people read: without eigenvalues, places that the reasons have, and all but the largest parts."""
    facts = check.to_dict()
    mesh, skeletons = facts["mesh"], _without(facts["skeletons"], "missing", "extra", "closest_call")
    parts = [value_in_words(part, 4) for part in mesh["parts"][:MOST_PARTS]]
    more = len(mesh["parts"]) - len(parts)
    return {
        "because": facts["reasons"],
        "worth": MEANINGS[check.verdict],
        "probability": round(check.probability, 3),
        "points": facts["points"],
        "mesh": _without(mesh, "parts", "faults"),
        "parts": [*parts, f"and {more} more"] if more else parts,
        "laplacians": _without(facts["rows"], "eigenvalues"),
        "skeletons": {
            name: f"{value[0]} and {value[1]}" if isinstance(value, tuple) else value
            for name, value in skeletons.items()
        },
    }


def _without(told: dict[str, Any], *names: str) -> dict[str, Any]:
    return {name: value for name, value in told.items() if name not in names}


def _save_angles(check: Any, path: Path) -> None:
    from ..io.colors import ramp
    from ..io.formats import ply

    ply.save(path, {"positions": check.points, "angle": check.angle, "colors": ramp(check.angle / 90)})


def _save_picture(check: Any, path: Path) -> None:
    from .. import save_preview

    save_preview(check.skeleton, path, title=check.verdict, beside=check.mesh_skeleton, marked=check.doubtful)


def _save_page(check: Any, path: Path) -> None:
    from .. import save_report

    told = {
        name: value_in_words(value).replace("\n", "; ")
        for name, value in ({"verdict": check.verdict} | _told(check)).items()
    }
    save_report(check.skeleton, path, title=path.stem, facts={"Cross-check": told})
