"""``glsk crosscheck``: whether a scan is dense and clean enough."""

from functools import partial
from pathlib import Path
from typing import Annotated

from ..errors import InvalidCloudError
from .console import print_rows, progress
from .options import DropInvalid, Numbers, PipelineName, ScanFile, option
from .outputs import Output, check_outputs, json_output, tell, write_each


def crosscheck(
    scan: ScanFile,
    mesh: Annotated[
        Path | None, option("MESH", "A mesh of the same surface to compare with: ply, off, obj, stl, gltf or glb.")
    ] = None,
    output: Numbers = None,
    picture: Annotated[Path | None, option("PNG", "Draw the disagreement on the cloud, and both skeletons.")] = None,
    pipeline: PipelineName = "default",
    drop_invalid: DropInvalid = False,
) -> None:
    """Check a scan against a mesh made from it.

    Both skeletons are computed, that of the mesh with libigl's Laplacian, and compared. The verdict is one of
    'agrees', 'agrees in part' and 'do not trust'; then the exit code is 0. 'cannot tell', with exit code 1, says that
    the skeletons differ but the mesh is at fault.
    """
    from .. import read_cloud
    from ..crosscheck import cross_check, save_crosscheck_picture
    from ..crosscheck.agreement import MEANINGS, UNTOLD
    from ..io.scans import read_mesh
    from ..viewing.figures import printable
    from .overrides import choose

    drawn = Output(picture, (".png",), "picture is a PNG", partial(save_crosscheck_picture, title=scan.name))
    check_outputs([json_output(output), drawn], scan, mesh)
    chosen = choose(pipeline, drop_invalid=drop_invalid)
    with progress() as update:
        update(f"reading {scan.name}")
        cloud = read_cloud(scan)
        surface = "auto" if mesh is None else read_mesh(mesh)
        update("comparing with a mesh")
        check = cross_check(cloud, surface, pipeline=chosen)
        facts = {"scan": printable(scan), "given_mesh": mesh and printable(mesh), **check.to_dict()}
        files = write_each([json_output(output)], facts) | write_each([drawn], check, update)
    told = {"because": facts["reasons"], "which is": MEANINGS[check.verdict], "surface": check.surface}
    told |= {name: facts[name] for name in ("points", "mesh", "rows", "skeletons")}
    tell(facts, lambda: print_rows(told, title=f"{scan}: {check.verdict}"), files)
    if check.verdict == UNTOLD:
        another = "another mesh" if mesh else "a mesh of its surface with --mesh"
        raise InvalidCloudError(f"the check says nothing about the skeleton: {check.reasons[0]}; give {another}")
