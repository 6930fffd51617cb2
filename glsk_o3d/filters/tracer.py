"""Tracer: thin parts without a surface -> shortest paths, and one rooted tree."""

from dataclasses import dataclass

from ..curve.curve import Curve
from ..curve.diagnostics import measured
from ..curve.sampling import along_a_morton_curve, on_points
from ..curve.thin.detect import THIN, may_lack_surface
from ..curve.thin.trace import trace
from ..data.skeleton import Skeleton
from ..geometry.vectors import AXES
from ..parameters import documented, parameter
from ..pipeline import Filter, RunContext


@documented
@dataclass(frozen=True, kw_only=True)
class Tracer(Filter[Skeleton, Skeleton]):
    """Trace parts without a visible surface, such as twigs thinner than the point spacing; make one tree with a root.

    Where the cloud shows no surface, shortest paths through the points replace the curve. With a `root` the result is
    one tree: gaps are joined, loops opened, vertex 0 is the root, and every edge leads from parent to child. Without a
    root, and with a surface everywhere, the skeleton is unchanged.

    Warns
    -----
    SkeletonWarning
        As of `Refiner`, about the skeleton with its traced parts.

    References
    ----------
    Sato et al. 2000, TEASAR; Verroust and Lazarus 1999.

    Examples
    --------
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import y_junction
    >>> grown = skeletonize(y_junction(1000).points, root="z")
    >>> grown.n_components, grown.n_loops, len(grown.leaves)
    (1, 0, 3)
    """

    surface: float = parameter(
        THIN.least_surface,
        "Share of points with a surface below which a region is traced as paths. 0 traces none.",
        low=0,
        high=1,
    )
    root: str | tuple[float, float, float] | None = parameter(
        None,
        "Root of one tree: the lowest place along an axis, the thickest end, or the place nearest to a point. "
        "None keeps parts and loops.",
        type="point?",
        choices=(*AXES, "thickest"),
    )

    def run(self, skeleton: Skeleton, context: RunContext) -> Skeleton:
        curve = Curve.of(skeleton)
        if self.root is None and not (self.surface and may_lack_surface(curve, self.surface)):
            return skeleton  # as most are: sorting many points would take longer than all else
        rows = along_a_morton_curve(curve, distinct=True)
        return on_points(lambda part: measured(trace(part, self.surface, self.root)), curve, rows).to_skeleton()
