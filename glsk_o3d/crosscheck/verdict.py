"""What the numbers of a cross-check say about a cloud."""

from __future__ import annotations

from collections.abc import Sequence

from ..report import REFUSED, Report
from .agreement import MeshFit, RowAgreement, SkeletonAgreement
from .surfaces import COVERED_SHARE

AGREES, IN_PART, DISTRUST, UNTOLD = VERDICTS = "agrees", "agrees in part", "do not trust", "cannot tell"

MEANINGS = {
    AGREES: "as of clean, dense clouds; gaps that cloud and mesh share, as of scans from one or two sides, do not show",
    IN_PART: "usual with noise, even little: of 48 test clouds 44 had a good skeleton all the same; look at --picture",
    DISTRUST: "rare, and a call to look at --picture: of 12 test clouds 8 had a good skeleton all the same",
    UNTOLD: "usual with much noise or few points: no word against the skeleton; look at --picture, or 'glsk evaluate'",
}
"""What to expect of each verdict; the numbers are measured, see docs/crosscheck.md."""

# All measured: what separates clean, dense samples of known shapes from sparse and noisy ones; see docs/crosscheck.md.
TURNED_ANGLE = 30.0  # degrees
NEAR_RADII, FAR_RADII = 0.2, 0.5  # mean distance, in local radii
HAUSDORFF_RADII = 1.0  # local radii, in 95 % of the length
FAULTY_SHARE = 0.05  # of the cloud far from the mesh, or of the mesh torn off or on borders that the cloud has not
GAPLESS_SHARE = 0.99  # of the rings, that close where the cloud has no gaps


def judge(
    rows: RowAgreement,
    skeletons: SkeletonAgreement,
    warned: Sequence[str] = (),
    mesh_report: Report | None = None,
    fit: MeshFit | None = None,
) -> tuple[str, tuple[str, ...]]:
    """The verdict on a cloud, and what speaks against a better one.

    Parameters
    ----------
    rows : RowAgreement
    skeletons : SkeletonAgreement
    warned : sequence of str
        What the cloud's own run warns of.
    mesh_report : Report, optional
        Of the mesh's run.
    fit : MeshFit, optional

    Returns
    -------
    verdict : {"agrees", "agrees in part", "do not trust", "cannot tell"}
        "do not trust" where the skeletons differ in components or loops, or lie more than half a radius apart on
        average; "cannot tell" instead where the mesh does not describe the cloud (a twentieth of it lies off, a
        twentieth of the mesh has borders that the cloud has not, a twentieth is torn off, smaller pieces of it are all
        that differs, or it closes around less than 70 % of the points whose rings close), where its contraction failed,
        and where no Laplacian coordinates could be compared. "agrees" where they lie within a fifth of a radius on
        average and a radius in 95 % of their length, the mesh closes around 70 % of the points whose rings close and
        has as many holes as the skeleton has loops, three quarters of the Laplacian coordinates lie within 30 degrees,
        neither run warned of anything, and the contraction of the mesh did not fail.
    reasons : tuple of str
    """
    failed, grave, slight = [], [], []
    if mesh_report is not None and REFUSED in mesh_report.stop_reason:
        failed.append(f"the mesh's own contraction failed: {mesh_report.stop_reason}")  # it explains the others
    for name in ("components", "loops"):
        ours, theirs = getattr(skeletons, name)
        if ours != theirs:
            grave.append(f"{name}: {ours} in the skeleton of the cloud, {theirs} in that of the mesh")
    apart = skeletons.distance_in_radii
    if apart > NEAR_RADII:
        (grave if apart > FAR_RADII else slight).append(f"the skeletons lie {apart:.2f} local radii apart on average")
    if skeletons.hausdorff95_in_radii > HAUSDORFF_RADII:
        slight.append(
            f"5 % of a skeleton are more than {skeletons.hausdorff95_in_radii:.1f} local radii from the other"
        )
    if fit is not None and fit.genus is not None and fit.genus != skeletons.loops[0]:
        slight.append(
            f"holes: {fit.genus} pass through the mesh, and the skeleton of the cloud has {skeletons.loops[0]} loops"
        )
    turned = rows.angle and rows.angle["p75"] > TURNED_ANGLE
    if slight or apart > FAR_RADII:
        agree = rows.one_to_one and rows.covered >= COVERED_SHARE and not turned
        if agree and rows.closed >= GAPLESS_SHARE * rows.rows and skeletons.topology and not failed:
            slight.append("the rings agree: it is the shape, not the sampling; in a blob a curve may run anywhere")
    if not rows.compared:
        failed.append("no Laplacian coordinates could be compared")
    elif rows.covered < COVERED_SHARE:
        (failed if grave else slight).append(
            f"the mesh closes around {rows.covered:.0%} of the points whose rings close"
        )
    if turned:
        slight.append(f"a quarter of the Laplacian coordinates are turned by more than {rows.angle['p75']:.0f} degrees")
    slight += [f"the run itself warns: {message}" for message in warned]
    if mesh_report is not None:
        slight += [f"the mesh's run warns: {message}" for message in mesh_report.warnings if message not in warned]
    if grave and fit is not None:
        failed += _faults(fit)
        ours, theirs = skeletons.components
        if len(grave) == 1 and 0 < theirs - ours <= fit.pieces - fit.parts:  # crumbs explain this, and nothing else
            failed.append(f"the mesh does not describe the cloud: {fit.pieces} pieces of it, {fit.parts} of the cloud")
    if failed and (grave or not rows.compared):
        return UNTOLD, (*failed, *grave, *slight)
    return (DISTRUST if grave else IN_PART if failed or slight else AGREES), (*failed, *grave, *slight)


def _faults(fit):
    """Why a mesh does not describe the cloud."""
    if fit.far > FAULTY_SHARE:
        yield f"the mesh does not describe the cloud: {fit.far:.0%} of the points lie more than a point spacing off it"
    if fit.open > FAULTY_SHARE:
        yield f"the mesh does not describe the cloud: {fit.open:.0%} of it are at holes that the cloud has not"
    if fit.torn > FAULTY_SHARE:
        yield f"the mesh does not describe the cloud: {fit.torn:.0%} of it are torn off where the cloud holds together"
