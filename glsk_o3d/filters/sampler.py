"""Sampler: cloud -> points in a working frame, of a large cloud a sample."""

from dataclasses import dataclass
from typing import Literal

from ..data.points import Points, default_size
from ..interop.clouds import Cloud
from ..parameters import documented, parameter
from ..pipeline import Filter, RunContext


@documented
@dataclass(frozen=True, kw_only=True)
class Sampler(Filter[Cloud, Points]):
    """Bring a cloud into its working frame: centred, longest side 1.6, in Morton order and without duplicates.

    Points that differ by rounding become one. The sample of a large cloud has the points nearest to the means of the
    cells of a grid; other points follow that of their cell. A mesh whose vertices do not show its surface is sampled by
    area; each vertex follows the nearest point. Results of a pipeline are in the user's order and units.

    Raises
    ------
    InvalidCloudError
        If points are not finite (unless dropped), fewer than 8 are distinct, or the input is no cloud.

    Examples
    --------
    >>> from glsk_o3d.samples import torus
    >>> points = Sampler(size=1000)(torus(5000).points)
    >>> len(points) < 1500, points.points.shape
    (True, (5000, 3))
    """

    size: int | Literal["auto", "all"] = parameter(
        "auto",
        "Approximate sample size of a cloud with more than twice as many points. 'auto' is twice what the Thinner "
        "leaves: 50000, or 128 times the square root of their number if that is more; 'all' takes all.",
        type="int",
        unit="points",
        low=8,
        choices=("auto", "all"),
    )
    frame: Literal["spread", "box"] = parameter(
        "spread",
        "What percentages and weights refer to: the box with the spread of the points, or the axis-aligned one.",
        choices=("spread", "box"),
    )
    sample: int | Literal["auto", "vertices"] = parameter(
        "auto",
        "Points by area that stand for a mesh. 'auto' is 25000 if most of its area is in triangles longer than the "
        "neighbourhoods of their corners; else, and with 'vertices', the points are its vertices.",
        type="int",
        unit="points",
        low=8,
        choices=("auto", "vertices"),
    )
    drop_invalid: bool = parameter(False, "Drop points with NaN or infinite coordinates instead of refusing.")

    def run(self, cloud: Cloud, context: RunContext) -> Points:
        points = Points.of(cloud, self.sample_size, self.frame, self.drop_invalid, self.sample)
        if isinstance(self.sample, str) or points.report.n_by_area:
            return points
        warning = f"Sampler.sample = {self.sample}: the cloud has no triangles with an area: its points are taken"
        return points.with_report(points.report.with_reason("option", warning))

    def sample_size(self, n: int) -> int:
        """Size of the sample of n points if n is more than twice as large."""
        return {"auto": 2 * default_size(n), "all": n}[self.size] if isinstance(self.size, str) else self.size
