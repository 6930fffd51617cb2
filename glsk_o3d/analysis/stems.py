"""The stem of a tree: its diameter at any height, and its taper."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..data.skeleton import Skeleton
from ..geometry.neighbourhoods import plane_axes
from ..geometry.vectors import TINY, along_axis, norm
from ..geometry.vectors import unit as unit_vectors
from ..parameters import check_number
from .circles import CircleFit, fit_circle
from .trees import Cylinders, cylinders, ground_height, points_near, up_axis

SLICE = 0.1  # published: metres; the slice of a stem that its diameter is fitted to is from 5 cm below to 5 cm above
STEM_SPAN = 0.5  # fitted: metres up and down, over which the stem has its direction there
FEWEST_ON_CIRCLE = 12  # fitted: on a circle, of which fewer may be anything
LEAST_ARC = 60.0  # derived: degrees of a circle; a chord of less leaves the surface by an eighth of the radius
TAPER_STEPS = 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0  # published: metres between the sections of a stem
MOST_TAPER_SECTIONS = 20  # precision: of a taper, with the shortest of these steps that needs no more
UNKNOWN = CircleFit(np.nan, np.nan, 0, np.nan)


@dataclass(frozen=True, eq=False)
class Stem:
    """The stem of a tree, measured in metres above the ground at its foot.

    Attributes
    ----------
    skeleton, pieces : Skeleton, Cylinders
        Of the whole tree, in the units of the cloud.
    near : (n,) int array
        Rows of the skeleton's points that are no outliers.
    ground, up, unit : float, str, float
        Coordinate of the ground along the axis that points up; metres of one unit of the cloud.
    """

    skeleton: Skeleton
    pieces: Cylinders
    near: np.ndarray
    ground: float
    up: str
    unit: float

    def heights(self, places: np.ndarray) -> np.ndarray:
        """Metres above the ground, (n,) float array, of places (n, 3) in the units of the cloud."""
        return self.unit * (along_axis(places, self.up) - self.ground)

    @property
    def top(self) -> float:
        """Height at which the stem ends."""
        stem = self.pieces.order == 0
        return float(self.heights(np.concatenate([self.pieces.start_point[stem], self.pieces.end_point[stem]])).max())

    @cached_property
    def is_on_stem(self) -> np.ndarray:
        """Which of the points `near` belong to the stem, (n,) bool array."""
        rows = np.unique(self.pieces.branch[self.pieces.order == 0])
        vertices = np.concatenate([self.skeleton.branches[row] for row in rows])
        return np.isin(self.skeleton.vertex_of_point[self.near], vertices)

    def diameter_at(self, height: float) -> float:
        """Diameter of the circle through the points of the stem in a slice of 10 cm across it; NaN if unknown.

        Examples
        --------
        >>> from glsk_o3d import pipelines
        >>> from glsk_o3d.samples import tube
        >>> log = stem(pipelines.tree("x")(tube(4000, length=4, radius=0.1).points))
        >>> abs(log.diameter_at(2.0) - 0.2) < 0.01
        True
        """
        check_number("height", height)
        return 2 * self.circle_at(height)[0].radius

    def taper(self) -> tuple[dict[str, float], ...]:
        """Height, diameter, its error, arc, diameter of the cylinder, by their names, at up to twenty round heights."""
        step = next(
            (step for step in TAPER_STEPS if self.top < step * (MOST_TAPER_SECTIONS + 1)),
            self.top / MOST_TAPER_SECTIONS,
        )
        sections = []
        for height in (step * np.arange(1, MOST_TAPER_SECTIONS + 1)).round(9).tolist():
            row = self._piece_at(height)
            if row is not None:
                circle = self.circle_at(height)[0]
                thickness = 2 * self.unit * float(self.pieces.radius[row])
                section = dict(height=height, diameter=2 * circle.radius, error=circle.error, arc=circle.arc)
                sections.append(section | {"cylinder_diameter": thickness})
        return tuple(sections)

    def _piece_at(self, height: float) -> int | None:
        """The first cylinder of the stem that passes a height, or None."""
        bottom, top = self.heights(self.pieces.start_point), self.heights(self.pieces.end_point)
        across = (self.pieces.order == 0) & (bottom <= height) & (top >= height)
        return int(across.argmax()) if across.any() else None

    def circle_at(self, height: float) -> tuple[CircleFit, str]:
        """The circle around the stem at a height, in metres; or an unknown one, and the reason."""
        pieces, skeleton, unit = self.pieces, self.skeleton, self.unit
        row = self._piece_at(height)
        if row is None:
            return UNKNOWN, f"the stem does not pass {height:g} m above its foot"
        bottom, top = self.heights(pieces.start_point[[row]])[0], self.heights(pieces.end_point[[row]])[0]
        stem, step = pieces.order == 0, pieces.end_point - pieces.start_point
        place = pieces.start_point[row] + (height - bottom) / max(top - bottom, TINY) * step[row]
        around = stem & (unit * norm((pieces.start_point + pieces.end_point) / 2 - place) <= STEM_SPAN)
        around[row] = True
        direction = unit_vectors(step[around].sum(axis=0, keepdims=True))
        offset = unit * (skeleton.points[self.near[self.is_on_stem]] - place)
        offset = offset[np.abs(offset @ direction[0]) <= SLICE / 2]
        fit = fit_circle(offset @ plane_axes(direction)[0])
        if len(skeleton.points) == 0:
            return UNKNOWN, "the skeleton has no points: .json and .npz files keep them"
        if fit is None or fit.points < max(FEWEST_ON_CIRCLE, len(offset) / 2):
            count = f"{0 if fit is None else fit.points} of {len(offset)} points of the stem are on a circle"
            return UNKNOWN, f"in a slice of {100 * SLICE:g} cm {count}, and half must be, at least {FEWEST_ON_CIRCLE}"
        if fit.arc < LEAST_ARC:
            return UNKNOWN, f"points show {fit.arc:.0f} degrees of it, and at least {LEAST_ARC:.0f} are needed"
        return fit, ""


def stem(skeleton: Any, root: Any = None, *, up: str | None = None, unit: float = 1.0) -> Stem:
    """The stem of a tree, to measure its diameter at any height.

    Parameters
    ----------
    skeleton, root, up, unit
        As of `tree_measures`, with the same errors.

    Returns
    -------
    Stem
    """
    up, skeleton = up_axis(skeleton, root, up), skeleton.whole
    check_number("unit", unit, low=0, open_low=True)
    pieces, near = cylinders(skeleton, root, up), points_near(skeleton)
    foot, end = pieces.start_point[0], pieces.end_point[0]
    ground = ground_height(skeleton.points[near], foot, end, float(pieces.radius[0]), up)
    return Stem(skeleton, pieces, near, ground, up, unit)
