"""The true axis of a thing: more is known of it than nodes, edges and radii."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from glsk_o3d.analysis.comparison import Truth
from glsk_o3d.errors import FileFormatError, InvalidParameterError
from glsk_o3d.io.formats.fields import npz_arrays
from glsk_o3d.io.skeletons import read_truth

THING_ARRAYS = ("half_width", "flat", "judged", "mirror")
"""What the true axis of a thing has besides `nodes`, `edges` and `radii`."""


@dataclass(eq=False)
class ThingTruth(Truth):
    """The true axis of a thing, whose sections need not be circles and whose ends need not be round.

    Attributes
    ----------
    nodes : (V, 3) float64 array
    edges : (E, 2) int64 array
    radii : (V,) float64 array
        Of the circle with the area of the section.
    half_width : (V,) float64 array
        The longer half axis of the section.
    flat : (k,) int64 array
        Nodes that are tips at a flat end: the axis stops half a radius inside the face.
    judged : (E,) bool array
        False for edges of which the axis is a matter of taste, such as those in the bowl of a cup.
    mirror : (2, 3) float64 array
        A point of the plane of symmetry, and its unit normal; (0, 3) where there is none.

    Raises
    ------
    InvalidParameterError
        As `Truth`; or one of the arrays does not fit to the nodes and edges.

    Examples
    --------
    >>> nodes, edges = np.array([[0, 0, 0], [0, 0, 1.0]]), np.array([[0, 1]])
    >>> truth = ThingTruth(nodes, edges, [0.1, 0.1], [0.2, 0.2], [1], [True], [])
    >>> truth.flat, truth.mirror.shape
    (array([1]), (0, 3))
    """

    half_width: np.ndarray
    flat: np.ndarray
    judged: np.ndarray
    mirror: np.ndarray

    def __post_init__(self) -> None:
        super().__post_init__()
        try:
            self.half_width = np.asarray(self.half_width, float)
            self.mirror = np.asarray(self.mirror, float).reshape(-1, 3)
        except (TypeError, ValueError) as error:
            raise InvalidParameterError(f"the truth has an invalid half_width or mirror: {error}") from None
        width, mirror = self.half_width, self.mirror
        self.judged, flat = np.asarray(self.judged), np.asarray(self.flat)
        flat = flat if flat.size else np.empty(0, np.int64)
        if width.shape != self.radii.shape or not (np.isfinite(width) & (width > 0)).all():
            raise InvalidParameterError("the truth must have a positive, finite half_width at each of its nodes")
        if flat.ndim != 1 or flat.dtype.kind not in "iu" or not np.isin(flat, np.arange(len(width))).all():
            raise InvalidParameterError("the flat ends of the truth must be some of its nodes, by number")
        if self.judged.shape != (len(self.edges),) or self.judged.dtype != bool:
            raise InvalidParameterError("judged must be true or false for each edge of the truth")
        if len(mirror) not in (0, 2) or not np.isfinite(mirror).all():
            raise InvalidParameterError("the mirror of the truth must be a point and a normal, or nothing")
        if len(mirror) and not np.isclose(np.linalg.norm(mirror[1]), 1):
            raise InvalidParameterError(f"the normal of the truth's mirror must have length 1: {mirror[1].tolist()}")
        self.flat = flat.astype(np.int64)


def read_axis(path: Path) -> Truth:
    """The true axis in a file: a `ThingTruth` where the file is an npz archive that has the arrays of one.

    Raises FileNotFoundError, and FileFormatError where what there is, is no axis.
    """
    truth = read_truth(path)
    if path.suffix != ".npz":
        return truth
    try:
        more = npz_arrays(path.read_bytes(), THING_ARRAYS)
        if missing := [name for name in THING_ARRAYS if more and name not in more]:
            raise ValueError(f"it lacks {', '.join(missing)}")
        return ThingTruth(truth.nodes, truth.edges, truth.radii, **more) if more else truth
    except ValueError as error:
        raise FileFormatError(f"{path}: not a valid truth: {error}") from None
