"""Refiner: raw graph -> one-dimensional, medial skeleton (Wen et al. 2024, section II-D)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from .filter import Filter, documented, parameter
from .refinement.loops import close_loops
from .refinement.medial import medial_vertices, smooth
from .refinement.resampling import resample
from .refinement.triangles import collapse_triangles
from .refinement.trust import trust_warnings
from .refinement.twigs import cut_twigs
from .skeleton import plane_distance_radii


@documented
@dataclass(frozen=True, kw_only=True)
class Refiner(Filter):
    """Make the graph one-dimensional, close false loops, cut twigs, and centre it in the surface around it.

    1. Edges that lie on a triangle are collapsed, those with the least mean degree of their ends first, and among these
       the shortest, until there is no triangle.
    2. Loops that open less than their tube is thick are zipped up, and branches shorter than the part they grow from is
       thick are cut.
    3. Edges are subdivided, so that chords do not cut corners.
    4. Every vertex moves to the point nearest to the normal lines of the input points that it and its neighbours own:
       on the axis, even if only one side was scanned.

    The first step is published; with `opening`, `twig`, `spacing` and `recentre` all 0 it is the only one.

    Warns
    -----
    SkeletonWarning
        Where no curve skeleton is meaningful: sphere-like or sheet-like clouds.

    Notes
    -----
    The published code also merges nearly straight runs; an indexing slip makes that step idle in most clouds. It is
    left out here.

    References
    ----------
    Cao et al. 2010, section 5; Wen et al. 2024, section II-D.
    """

    consumes: ClassVar[str] = "Skeleton"
    produces: ClassVar[str] = "Skeleton"

    opening: float = parameter(
        1.0,
        "Least opening of a loop over the radius of its tube; loops that open less are zipped up. 0 keeps all.",
        type="float",
        low=0,
    )
    twig: float = parameter(
        0.8,
        "Shortest branch over the local thickness where it begins; shorter ones are cut. 0 keeps all.",
        type="float",
        low=0,
    )
    spacing: float = parameter(
        0.5,
        "Longest edge over the local thickness, by subdivision; 0 leaves the edges. Long ones cut corners.",
        type="float",
        low=0,
    )
    recentre: int = parameter(
        2,
        "Passes that centre the vertices on the normal lines of their points and smooth once; 0 leaves them.",
        type="int",
        unit="passes",
        low=0,
    )

    def _run(self, skeleton, on_iteration):
        skeleton = collapse_triangles(skeleton)
        if self.opening:
            skeleton = close_loops(skeleton, self.opening)
        if self.twig:
            skeleton = cut_twigs(skeleton, self.twig)
        if self.spacing:
            skeleton = resample(skeleton, self.spacing)
        for _ in range(self.recentre):
            skeleton = replace(skeleton, vertices=medial_vertices(skeleton))
            skeleton = replace(skeleton, vertices=smooth(skeleton))
        radii = plane_distance_radii(
            skeleton.vertices, skeleton.vertex_of_point, skeleton.points, skeleton.normals, skeleton.radii
        )
        skeleton = replace(skeleton, radii=radii)
        report = skeleton.report
        for message in trust_warnings(skeleton):
            report = report.with_warning(message)
        return replace(skeleton, report=report)
