"""``glsk crosscheck``: whether another way to the skeleton of a scan gives the same."""

from pathlib import Path
from typing import Annotated, Any

from ..errors import did_you_mean
from .console import print_rows, progress, value_in_words
from .options import DropInvalid, PipelineName, Preview, ReportPage, ScanFile, option
from .outputs import PAGE, PICTURE, Output, check_outputs, print_result, write_outputs
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
    from ..apps.crosscheck.check import MESH_KINDS
    from ..interop.clouds import SurfaceMesh
    from ..io.scans import read_mesh, read_scan
    from ..viewing.figures import printable
    from .overrides import choose

    outputs = [
        Output(labelled, (".ply",), "file is a cloud with angles", _save_angles),
        Output(preview, *PICTURE, _save_picture),
        Output(report, *PAGE, _save_page),
    ]
    own = None if mesh in MESH_KINDS else Path(mesh)
    if own and not own.suffix:
        raise WrongUsage(f"--mesh: {did_you_mean(mesh, MESH_KINDS, 'mesh')}")
    check_outputs(outputs, scan, own)
    chosen = choose(pipeline, drop_invalid=drop_invalid)
    with progress() as update:
        update(f"reading {scan.name}")
        whole = read_scan(scan)
        cloud = SurfaceMesh(whole.positions, whole.triangles)
        surface = read_mesh(own) if own else mesh
        update("comparing with a mesh")
        check = cross_check(cloud, pipeline=chosen, mesh=surface)
        files = write_outputs(outputs, check, update)
    facts = {"scan": printable(scan), **check.to_dict()}
    print_result(facts, lambda: print_rows(_rows(check), title=f"{scan}: {check.verdict}"), files)


def _rows(check: Any) -> dict[str, Any]:
    """The facts that people read: without eigenvalues, places that the reasons have, and all but the largest parts."""
    facts = check.to_dict()
    parts = [value_in_words(part, 4) for part in facts["mesh"]["parts"]]
    if len(parts) > MOST_PARTS:
        parts[MOST_PARTS:] = [f"and {len(parts) - MOST_PARTS} more"]
    hidden = {"parts", "faults", "eigenvalues", "missing", "extra", "closest_call"}
    mesh, laplacians, skeletons = (
        {name: value for name, value in facts[group].items() if name not in hidden}
        for group in ("mesh", "rows", "skeletons")
    )
    return {
        "because": facts["reasons"],
        "worth": MEANINGS[check.verdict],
        "probability": round(check.probability, 3),
        "points": facts["points"],
        "mesh": mesh,
        "parts": parts,
        "laplacians": laplacians,
        "skeletons": {name: " and ".join(map(str, v)) if isinstance(v, tuple) else v for name, v in skeletons.items()},
    }


def _save_angles(check: Any, path: Path) -> None:
    from ..io.colors import ramp
    from ..io.formats import ply

    ply.save(path, {"positions": check.points, "angle": check.angle, "colors": ramp(check.angle / 90)})


def _save_picture(check: Any, path: Path) -> None:
    from .. import save_preview

    save_preview(check.skeleton, path, title=check.verdict, beside=check.mesh_skeleton, marked=check.doubtful)


def _save_page(check: Any, path: Path) -> None:
    from .. import save_report

    rows = {"verdict": check.verdict, **_rows(check)}
    texts = {name: value_in_words(value).replace("\n", "; ") for name, value in rows.items()}
    save_report(check.skeleton, path, title=path.stem, facts={"Cross-check": texts})
