"""``glsk crosscheck``: whether a scan is dense and clean enough."""

from pathlib import Path
from typing import Annotated, Any

from ..errors import InvalidCloudError
from .console import print_rows, progress
from .options import DropInvalid, PipelineName, ScanFile, option
from .outputs import Output, check_outputs, tell, write_each


def crosscheck(
    scan: ScanFile,
    labelled: Annotated[
        Path | None, option("CLOUD", "The points with their angles, as ply: 'glsk view CLOUD' shows them in colours.")
    ] = None,
    pipeline: PipelineName = "default",
    drop_invalid: DropInvalid = False,
) -> None:
    """Check a scan against a mesh made from it.

    Both skeletons are computed, that of the mesh with libigl's Laplacian, and compared. The verdict is one of
    'agrees', 'agrees in part' and 'do not trust'; then the exit code is 0. 'cannot tell', with exit code 1, says that
    the skeletons differ but the mesh is at fault.
    """
    from .. import read_cloud
    from ..crosscheck import cross_check
    from ..crosscheck.agreement import MEANINGS, UNTOLD
    from ..viewing.figures import printable
    from .overrides import choose

    angles = Output(labelled, (".ply",), "file is a cloud with angles", _save_angles)
    check_outputs([angles], scan)
    chosen = choose(pipeline, drop_invalid=drop_invalid)
    with progress() as update:
        update(f"reading {scan.name}")
        cloud = read_cloud(scan)
        update("comparing with a mesh")
        check = cross_check(cloud, pipeline=chosen)
        files = write_each([angles], check)
    facts = {"scan": printable(scan), **check.to_dict()}
    told = {"because": facts["reasons"], "which is": MEANINGS[check.verdict]}
    told |= {name: facts[name] for name in ("points", "mesh", "rows", "skeletons")}
    tell(facts, lambda: print_rows(told, title=f"{scan}: {check.verdict}"), files)
    if check.verdict == UNTOLD:
        raise InvalidCloudError(f"the check says nothing about the skeleton: {check.reasons[0]}")


def _save_angles(check: Any, path: Path) -> None:
    from ..io.colors import ramp
    from ..io.formats import ply

    ply.save(path, {"positions": check.points, "angle": check.angle, "colors": ramp(check.angle / 90)})
