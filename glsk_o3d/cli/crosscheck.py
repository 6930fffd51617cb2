"""``glsk crosscheck``: whether a scan is dense and clean enough."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from .console import echo, print_json, print_rows, progress
from .options import DropInvalid, Json, PipelineName, Quiet, Verbose
from .reporting import WrongUsage, holding_interrupts, reporting


def crosscheck(
    scan: Annotated[
        Path, typer.Argument(metavar="SCAN", help="The cloud, in any format that 'glsk skeletonize' reads.")
    ],
    mesh: Annotated[
        Path | None,
        typer.Option(
            "--mesh",
            metavar="MESH",
            help="A mesh of the same surface to compare with: ply, off, obj, stl, gltf or glb.",
        ),
    ] = None,
    method: Annotated[
        str,
        typer.Option(
            "--method",
            metavar="NAME",
            help="How to make a mesh: ball_pivoting; poisson; or auto: the first where it closes, else the second.",
        ),
    ] = "auto",
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="JSON", help="Write all numbers to a file.")
    ] = None,
    picture: Annotated[
        Path | None,
        typer.Option("--picture", metavar="PNG", help="Draw the cloud coloured by disagreement, and both skeletons."),
    ] = None,
    pipeline: PipelineName = "default",
    max_points: Annotated[
        int, typer.Option("--max-points", metavar="N", help="Thin larger clouds to so many points; 0 for no limit.")
    ] = 16384,
    drop_invalid: DropInvalid = False,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Check a scan against a mesh made from it.

    Both skeletons are computed, that of the mesh with libigl's Laplacian, and compared. The verdict is one of
    'agrees', 'agrees in part' and 'do not trust'; then the exit code is 0. 'cannot tell', with exit code 1, says that
    the skeletons differ but the mesh is at fault.
    """
    with reporting(scan, quiet=quiet, verbose=verbose):
        from ..crosscheck import cross_check, save_crosscheck_picture
        from ..crosscheck.agreement import UNTOLD
        from ..crosscheck.mesh import SURFACES
        from ..errors import InvalidCloudError, did_you_mean
        from ..interop.atomic import write_json
        from ..io.meshes import read_mesh
        from ..io.scans import read_cloud
        from ..viewing.figures import printable
        from .outputs import PICTURE_FILE, REPORT_FILE, check_findings
        from .overrides import choose

        if mesh is not None and method != "auto":
            raise WrongUsage("--mesh gives a mesh: there is none to make with --method")
        if method not in ("auto", *SURFACES):
            raise WrongUsage(did_you_mean(method, ("auto", *SURFACES), "method"))
        files = [path for path in (output, picture) if path is not None]
        check_findings([(output, *REPORT_FILE), (picture, *PICTURE_FILE)], scan, mesh)
        chosen = choose(pipeline, None, (), drop_invalid)
        with progress(not quiet and not verbose) as update:
            update(f"reading {scan.name}")
            with holding_interrupts():
                cloud = read_cloud(scan)
                surface = method if mesh is None else read_mesh(mesh)
            update("comparing with a mesh")
            check = cross_check(cloud, surface, pipeline=chosen, max_points=max_points or None)
            names = {"scan": printable(scan), "given_mesh": None if mesh is None else printable(mesh)}
            told = {**names, **check.to_dict()}
            if output is not None:
                write_json(output, told)
            if picture is not None:
                update(f"drawing {picture.name}")
                save_crosscheck_picture(check, picture, title=scan.name)
        if as_json:
            print_json({**told, "files": [str(path) for path in files]})
        elif not quiet:
            print_rows(_rows(told), title=f"{scan}: {check.verdict}")
            for path in files:
                echo(f"wrote {path}")
        if check.verdict == UNTOLD:
            raise InvalidCloudError(
                f"the check says nothing about the skeleton: {check.reasons[0]}; give "
                + ("another mesh" if mesh else "a mesh of its surface with --mesh, or another --method")
            )


def _rows(told: dict[str, Any]) -> dict[str, Any]:
    """What the check found, in words."""
    from ..crosscheck.agreement import MEANINGS

    rows, skeletons, mesh = told["rows"], told["skeletons"], told["mesh"]
    shown = {
        "because": "\n".join(told["reasons"]) or None,
        "which is": MEANINGS[told["verdict"]],
        "points": "{used} of {given}; {turned} turned by more than 30 degrees, {not_compared} not compared".format(
            **told["points"]
        ),
        "mesh": f"{told['surface'].replace('_', ' ')}, {mesh['vertices']} vertices, {mesh['faces']} triangles",
        "rings compared": f"{rows['compared']} of {rows['closed']} closed ones ({rows['covered']:.0%})",
    }
    if rows["one_to_one"] and rows["compared"]:
        shown["same rings"] = f"{rows['same_rings']:.0%} ({rows['common_triangles']:.0%} of the triangles)"
    if rows["angle"]:
        shown["angle"] = "median {median:.2f}, 75 % below {p75:.1f}, 90 % below {p90:.1f} degrees".format(
            **rows["angle"]
        )
        shown["length"] = "median {median:.2f}, 80 % from {p10:.2f} to {p90:.2f} times the mesh's".format(
            **rows["length"]
        )
    for name, words in (("distance", "mean distance"), ("hausdorff95", "95 % within")):
        shown[words] = f"{skeletons[f'{name}_in_radii']:.2f} local radii ({skeletons[name]:.2%} of the diagonal)"
    for name in ("components", "loops", "leaves"):
        shown[name] = "{} and {}".format(*skeletons[name])
    shown["contractions"] = "of the cloud: {}\nof the mesh: {}".format(*told["stop_reasons"])
    return shown
