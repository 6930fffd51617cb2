"""The crown of a tree, and its wood by diameter."""

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from ..geometry.groups import quantile
from ..geometry.neighbourhoods import nearest_neighbours, principal
from ..geometry.vectors import TINY
from .stems import Stem
from .trees import Cylinders

OFF_WOOD = 0.5  # fitted: radii from its surface, beyond which a point is not on the wood
FAR_DEVIATIONS = 4.0  # fitted: standard deviations of the points of the stem from its surface
ROW_POINTS = 40  # fitted: side by side, which on a twig make a row longer than it is thick
ASKED_POINTS = 5000  # speed: of a cloud
CLASS_WIDTH = 0.05  # published: metres; foresters' classes of diameters


def diameter_classes(pieces: Cylinders, unit: float = 1.0, width: float = CLASS_WIDTH) -> tuple[dict[str, float], ...]:
    """Length and volume of cylinders by diameter, in metres.

    Parameters
    ----------
    pieces : Cylinders
    unit, width : float
        One unit of the cloud, and the width of a class, in metres.

    Returns
    -------
    tuple of dict
        One for each class that is not empty, with the names ``low`` and ``high``, and those of the sums of
        `TreeMeasures`. A diameter between two classes is in the upper one.

    Examples
    --------
    >>> from glsk_o3d import pipelines
    >>> from glsk_o3d.analysis import cylinders
    >>> from glsk_o3d.samples import tube
    >>> log = cylinders(pipelines.tree("x")(tube(2000, length=2, radius=0.11).points))
    >>> [round(each["low"], 2) for each in diameter_classes(log)]
    [0.2]
    """
    number = np.floor(2 * unit * pieces.radius / width).astype(int)
    seen, length, volume = pieces.confidence != 0, unit * pieces.length, unit**3 * pieces.volume
    classes = []
    for row in np.unique(number).tolist():
        sums = {"low": row * width, "high": (row + 1) * width}
        for name, sizes in (("length", length), ("volume", volume)):
            sums[f"{name}_with_traced"] = float(sizes[number == row].sum())
            sums[f"{name}_without_traced"] = float(sizes[(number == row) & seen].sum())
        classes.append(sums)
    return tuple(classes)


def crown_hulls(tree: Stem, base: float) -> tuple[float, float]:
    """Area of the convex hull of a crown seen from above, and volume of that in space, in metres; NaN without one.

    The crown is what belongs to branches, and the stem above the crown base, by points or else by cylinders.
    """
    pieces = tree.pieces
    places, is_stem = np.concatenate([pieces.start_point, pieces.end_point]), np.tile(pieces.order == 0, 2)
    if len(tree.near):
        places, is_stem = tree.skeleton.points[tree.near], tree.is_on_stem
    crown = places[~is_stem | (tree.heights(places) >= base)] if np.isfinite(base) else places[:0]
    across = np.delete(crown, "xyz".index(tree.up[-1]), axis=1)
    return tree.unit**2 * _hull_size(across), tree.unit**3 * _hull_size(crown)


def loose_points(tree: Stem) -> tuple[float, float]:
    """Share of the points that are far from the wood, and how much points that are not on it form rows, from 0 to 1.

    Points of twigs without a surface form rows, with a linearity (l1 - l2) / l1 near 1, of standard deviations, and
    those of leaves do not. Far is what the noise of the points of the stem does not explain. NaN where there are none.
    """
    skeleton = tree.skeleton
    rows, on_stem = np.flatnonzero(skeleton.vertex_of_point >= 0), np.zeros(len(skeleton.points), bool)
    on_stem[tree.near[tree.is_on_stem]] = True
    asked = rows[np.unique(np.linspace(0, len(rows) - 1, ASKED_POINTS).astype(int))] if len(rows) else rows
    place, points = skeleton.nearest(skeleton.points[asked]), skeleton.points[rows]
    off = np.abs(place.clearance)
    is_off = off > OFF_WOOD * place.radius
    if not is_off.any() or not on_stem[asked].any() or len(rows) < ROW_POINTS:
        return np.nan, np.nan
    # a quarter of normal deviations is below 0.3186 standard deviations; leaves around the stem have larger ones
    is_far = is_off & (off > FAR_DEVIATIONS * quantile(off[on_stem[asked]], 0.25) / 0.3186)
    beside = nearest_neighbours(points, ROW_POINTS, of=skeleton.points[asked[is_off]])[1]
    _, middle, most = principal(points, beside)[0].T
    return float(is_far.mean()), float((1 - np.sqrt(middle / np.maximum(most, TINY))).mean())


def _hull_size(points: np.ndarray) -> float:
    """Area of the convex hull of points (n, 2), or volume of that of (n, 3); NaN without one."""
    try:
        return float(ConvexHull(points).volume)
    except (QhullError, ValueError):  # too few, or flat
        return float("nan")
