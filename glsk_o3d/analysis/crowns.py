"""The crown of a tree, and its wood by diameter."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from .stems import Stem
from .trees import Cylinders

CLASS_WIDTH = 0.05  # published: metres; foresters' classes of diameters


@dataclass(frozen=True)
class DiameterClass:
    """What a tree has of parts between two diameters, in metres and cubic metres.

    Attributes
    ----------
    low, high : float
        Diameters; the class has the lower one.
    length_with_traced, length_without_traced, volume_with_traced, volume_without_traced : float
        As of `TreeMeasures`.
    """

    low: float
    high: float
    length_with_traced: float
    length_without_traced: float
    volume_with_traced: float
    volume_without_traced: float


def diameter_classes(pieces: Cylinders, unit: float = 1.0, width: float = CLASS_WIDTH) -> tuple[DiameterClass, ...]:
    """Length and volume of cylinders by classes of diameter, without empty ones.

    Parameters
    ----------
    pieces : Cylinders
    unit, width : float
        One unit of the cloud, and the width of a class, in metres.

    Returns
    -------
    tuple of DiameterClass

    Examples
    --------
    >>> from glsk_o3d import pipelines
    >>> from glsk_o3d.samples import tube
    >>> from glsk_o3d.analysis import cylinders
    >>> log = cylinders(pipelines.tree("x")(tube(2000, length=2, radius=0.11).points))
    >>> [round(float(each.low), 2) for each in diameter_classes(log)]
    [0.2]
    """
    number = np.floor(2 * unit * pieces.radius / width).astype(int)
    seen, length, volume = pieces.confidence != 0, unit * pieces.length, unit**3 * pieces.volume
    classes = []
    for row in np.unique(number).tolist():
        inside = number == row
        sums = [float(sizes[inside & chosen].sum()) for sizes in (length, volume) for chosen in (inside, seen)]
        classes.append(DiameterClass(row * width, (row + 1) * width, *sums))
    return tuple(classes)


def crown_hulls(tree: Stem, base: float) -> tuple[float, float]:
    """Area of the convex hull of a crown seen from above, and volume of that in space, in metres; NaN without one.

    The crown is what belongs to branches, and the stem above the crown base, by points or else by cylinders.
    """
    pieces, skeleton = tree.pieces, tree.skeleton
    places, is_stem = np.concatenate([pieces.start_point, pieces.end_point]), np.tile(pieces.order == 0, 2)
    if len(tree.near):
        stem_rows = np.unique(pieces.branch[pieces.order == 0])
        vertices = np.concatenate([skeleton.branches[row] for row in stem_rows])
        places = skeleton.points[tree.near]
        is_stem = np.isin(skeleton.vertex_of_point[tree.near], vertices)
    crown = places[~is_stem | (tree.heights(places) >= base)] if np.isfinite(base) else places[:0]
    across = np.delete(crown, "xyz".index(tree.up[-1]), axis=1)
    return tree.unit**2 * _hull_size(across), tree.unit**3 * _hull_size(crown)


def _hull_size(points: np.ndarray) -> float:
    """Area of the convex hull of points (n, 2), or volume of that of (n, 3); NaN without one."""
    try:
        return float(ConvexHull(points).volume)
    except (QhullError, ValueError):  # too few, or flat
        return float("nan")
