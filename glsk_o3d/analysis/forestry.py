"""Forest measures of a tree: height, stem, volume by order; and doubts about them."""

import warnings
from contextlib import suppress
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ..data.skeleton import Skeleton
from ..errors import GlskError, SkeletonWarning
from ..geometry.vectors import TINY
from .circles import CircleFit
from .crowns import crown_hulls, diameter_classes, loose_points
from .stems import stem

BREAST_HEIGHT = 1.3  # published: metres above the ground at which foresters measure stems
TALLEST_TREE = 116.07  # published: metres, Hyperion, the tallest tree known, as measured in 2019
FORM_FACTOR = 2.0  # derived: wood over a cylinder as thick as at 1.3 m and as high as the tree; branches as thick as
# the trunk together (Leonardo) that reach to the top fill one, and their bends and the foot do not double that
MOST_ERROR = 0.05  # derived: of the diameter at 1.3 m, a tenth of the wood
MOST_TRACED = 0.5  # derived: of the length; above that the volume says nothing of most of the tree
MOST_FAR = 0.05  # fitted: of the points, far from the surface of bare wood
LEAST_IN_ROWS = 0.55  # fitted: how much points off the wood are in rows, of bare twigs; those of leaves are less
WITHOUT_SURFACE = "has no surface, and no volume: twigs thinner than the points are apart"


@dataclass(frozen=True)
class TreeMeasures:
    """A tree in numbers. Lengths are in metres, volumes in cubic metres.

    Attributes
    ----------
    height : float
        Of the highest point above the foot of the stem, without points farther than three radii from the curve.
    stem_diameter, stem_error, stem_arc : float
        Of the circle through the points of the stem in a slice of 10 cm across it, 1.3 m above the foot; its standard
        deviation, over the diameter; degrees of the circle with points. NaN without such a circle.
    crown_base : float
        Height at which the lowest branch leaves the stem; NaN without one.
    crown_area, crown_volume : float
        Of the convex hull of the crown, seen from above and in space: of all points of branches, and of those of the
        stem above the crown base. NaN without a crown.
    length, volume : tuple of float
        Length of the axes and volume of each order, the stem first; see `Cylinders`. The volume is that of parts with a
        surface: confidence above 0, or unknown.
    length_with_traced, length_without_traced, volume_with_traced, volume_without_traced : float
        Sums over all orders, of everything and of parts with a surface. Traced parts have no surface: the radius of
        their volume is the scatter of their points. Without traced parts NaN if confidences are unknown.
    traced : float
        Share of the length with confidence 0: twigs without a surface, leaves, noisy parts. NaN if confidences are
        unknown.
    root, up, unit : (x, y, z), str, float
        The foot of the stem in the cloud's units, the axis that points up, and the metres of one unit.
    taper, classes : tuple of dict of str to float
        Diameters of the stem at round heights, see `Stem.taper`; length and volume in classes of diameter of 5 cm, see
        `diameter_classes`.
    doubts : tuple of str
        The warnings about implausible results.
    """

    height: float
    stem_diameter: float
    stem_error: float
    stem_arc: float
    crown_base: float
    crown_area: float
    crown_volume: float
    length: tuple[float, ...]
    volume: tuple[float, ...]
    length_with_traced: float
    length_without_traced: float
    volume_with_traced: float
    volume_without_traced: float
    traced: float
    root: tuple[float, float, float]
    up: str
    unit: float
    taper: tuple[dict[str, float], ...]
    classes: tuple[dict[str, float], ...]
    doubts: tuple[str, ...]

    def sums(self) -> dict[str, Any]:
        """The measures that are single values, as the row of a table of trees."""
        values = {name: value for name, value in asdict(self).items() if not isinstance(value, tuple)}
        return values | {"doubts": "; ".join(self.doubts)}


def tree_measures(skeleton: Any, root: Any = None, *, up: str | None = None, unit: float = 1.0) -> TreeMeasures:
    """Measure a tree as foresters do.

    Parameters
    ----------
    skeleton : Skeleton
        One tree, as from `glsk_o3d.pipelines.tree`.
    root : str, int or (x, y, z), optional
        See `cylinders`.
    up : {"x", "y", "z", "-x", "-y", "-z"}, optional
        Axis that points up. By default that of `root` here or in the pipeline `tree`, or else ``"z"``.
    unit : float
        One unit of the cloud, in metres: 0.001 for millimetres.

    Returns
    -------
    TreeMeasures

    Raises
    ------
    InvalidParameterError
        See `cylinders`; or `up` is no axis, or `unit` is not positive.

    Warns
    -----
    SkeletonWarning
        The root is in the upper half of the tree, the tree is taller than any known one or has too much wood for its
        size, the diameter at 1.3 m is unknown or of little certainty, most of the length has no surface, or there are
        leaves.

    Examples
    --------
    >>> from glsk_o3d import pipelines
    >>> from glsk_o3d.samples import tube
    >>> stem = pipelines.tree("x")(tube(2000, length=2, radius=0.1).points)
    >>> abs(tree_measures(stem).stem_diameter - 0.2) < 0.01  # up is x, as in the pipeline
    True
    """
    tree = stem(skeleton, root, up=up, unit=unit)
    pieces, height, is_stem = tree.pieces, tree.heights, tree.pieces.order == 0
    bottom, top = height(pieces.start_point), height(pieces.end_point)
    low, high = min(bottom.min(), top.min()), max(bottom.max(), top.max())
    highest = float(height(tree.skeleton.points[tree.near]).max() if len(tree.near) else high)
    branch_heights = bottom[(pieces.order == 1) & is_stem[pieces.parent]]
    crown_base = float(branch_heights.min()) if len(branch_heights) else np.nan
    area, crown_volume = crown_hulls(tree, crown_base)
    traced = pieces.confidence == 0  # unknown is not
    lengths, volumes = unit * pieces.length, unit**3 * pieces.volume
    known = 1.0 if np.isfinite(pieces.confidence).all() else np.nan
    section, problem = tree.circle_at(BREAST_HEIGHT)
    wood = float(volumes[~traced].sum())
    traced_share = known * float(lengths[traced].sum() / max(lengths.sum(), TINY))
    doubts = _doubts(-low / max(high - low, TINY), highest, section, problem, wood, tree.up, unit)
    far, in_rows = loose_points(tree)
    if traced_share > MOST_TRACED:
        cause = "needs more points" if in_rows > LEAST_IN_ROWS else "or leaves: needs leaf-off, or more points"
        doubts += (f"{100 * traced_share:.0f} % of the length {WITHOUT_SURFACE}, {cause}",)
    elif far > MOST_FAR and in_rows <= LEAST_IN_ROWS:
        doubts += (f"{100 * far:.0f} % of the points are far from the wood, and in no rows: leaves: needs leaf-off",)
    for doubt in doubts:
        warnings.warn(doubt, SkeletonWarning, stacklevel=2)
    return TreeMeasures(
        height=highest,
        stem_diameter=2 * section.radius,
        stem_error=section.error,
        stem_arc=section.arc,
        crown_base=crown_base,
        crown_area=area,
        crown_volume=crown_volume,
        length=tuple(np.bincount(pieces.order, lengths).tolist()),
        volume=tuple(np.bincount(pieces.order, np.where(traced, 0, volumes)).tolist()),
        length_with_traced=float(lengths.sum()),
        length_without_traced=known * float(lengths[~traced].sum()),
        volume_with_traced=float(volumes.sum()),
        volume_without_traced=known * wood,
        traced=traced_share,
        root=tuple(pieces.start_point[0].tolist()),
        up=tree.up,
        unit=unit,
        taper=tree.taper(),
        classes=diameter_classes(pieces, unit),
        doubts=doubts,
    )


def measures_of_grown(skeleton: Skeleton, unit: float = 1.0, up: str | None = None) -> TreeMeasures | None:
    """The measures of a tree that a pipeline grew from a root, without warnings; None of anything else."""
    if not skeleton.report.root:
        return None
    with warnings.catch_warnings(), suppress(GlskError, np.linalg.LinAlgError):
        warnings.simplefilter("ignore")
        return tree_measures(skeleton, unit=unit, up=up)
    return None


def _doubts(
    ground: float, highest: float, section: CircleFit, problem: str, volume: float, up: str, unit: float
) -> tuple[str, ...]:
    """Implausible results of a tree, in words; `ground` is the place of its foot, as a share of its height."""
    doubts = []
    if ground > 0.5:
        doubts.append(f"the tree grows from {100 * ground:.0f} % of its height along {up}: does {up} point up?")
    if highest > TALLEST_TREE:
        doubts.append(
            f"the tree is {highest:.4g} m high, and none is known above {TALLEST_TREE:.0f} m: is a unit of the cloud "
            f"{unit:g} m? give its metres, such as 0.001"
        )
    if problem and highest > BREAST_HEIGHT:
        doubts.append(f"the diameter of the stem at {BREAST_HEIGHT} m is not known: {problem}")
    if section.error > MOST_ERROR:
        doubts.append(
            f"the diameter of the stem at {BREAST_HEIGHT} m has a standard deviation of {100 * section.error:.0f} %: "
            f"points show {section.arc:.0f} degrees of it: scan it from other sides, too"
        )
    share = volume / (np.pi * section.radius**2 * highest)
    if share > FORM_FACTOR:
        thick = f"{200 * section.radius:.3g} cm thick, as at {BREAST_HEIGHT} m"
        doubts.append(
            f"the tree has {volume:.3g} m3 of wood, {share:.2g} times a cylinder as high and {thick}; more than "
            f"{FORM_FACTOR:g} is hardly one tree: are leaves, undergrowth or others in it, does it fork below, or does "
            f"{up} not point up?"
        )
    return tuple(doubts)
