"""How near a skeleton comes to the true axis of a shape: the scores of the benchmark."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from glsk_o3d.analysis.comparison import PLACE_SPACING, Truth, compare
from glsk_o3d.analysis.curves import check_graph, simple_edges
from glsk_o3d.errors import InvalidParameterError
from glsk_o3d.skeleton import Skeleton

# Where an answer is refused, so that no program can fill the memory of who scores it.
MOST_ANSWER_PLACES = 2_000_000  # fitted: along an answer; axes of the benchmark have a thousand to ten thousand
MOST_ANSWER_JUNCTIONS = 5000  # fitted: of which all pairs are compared; axes have up to some twenty


@dataclass(frozen=True)
class Scores:
    """What an answer to one cloud is worth.

    The measures are those of `glsk_o3d.analysis.compare`, in radii of the true axis.

    Attributes
    ----------
    perfect : bool
        Components and loops are right, and every leaf is matched.
    topology : bool
        Components and loops are right.
    tips_f1, junctions_f1 : float
        F1 of the leaves, and of the junctions. 0 to 1, 1 is best.
    error : float or None
        Mean distance of the answer from the axis. 0 is best.
    inside, completeness : float or None
        Share of the answer that is less than a radius away from the axis, and of the axis from the answer. 1 is best.
    length : float or None
        Length of the answer over that of the axis. 1 is best. None if the axis has no length.
    ends : float or None
        Mean distance from the leaves of the axis to the nearest leaf of the answer. 0 is best. None if there
        are none.
    components, loops, leaves, junctions : int or None
        How many more the answer has than the axis.
    failure : str or None
        Why there is no answer that could be scored. Then `perfect` and `topology` are false, both F1 are 0, and all
        others are None.

    Examples
    --------
    >>> Scores.of_failure("no answer").topology
    False
    """

    perfect: bool
    topology: bool
    tips_f1: float
    junctions_f1: float
    error: float | None = None
    inside: float | None = None
    completeness: float | None = None
    length: float | None = None
    ends: float | None = None
    components: int | None = None
    loops: int | None = None
    leaves: int | None = None
    junctions: int | None = None
    failure: str | None = None

    @classmethod
    def of_failure(cls, reason: str) -> Scores:
        """The scores of an answer that is missing, or that is no skeleton.

        Parameters
        ----------
        reason : str

        Returns
        -------
        Scores
        """
        return cls(perfect=False, topology=False, tips_f1=0.0, junctions_f1=0.0, failure=reason)

    def as_dict(self) -> dict[str, Any]:
        """The scores, as JSON holds them.

        Returns
        -------
        dict of str to float, int, bool, str or None
        """
        return asdict(self)


def score(truth: Any, vertices: Any, edges: Any) -> Scores:
    """Score a skeleton against the true axis of a shape. Needs NumPy and SciPy alone.

    Parameters
    ----------
    truth : Truth, Sample, or anything else with `nodes`, `edges` and `radii`
    vertices : (M, 3) array_like of float
        In the units of the truth.
    edges : (E, 2) array_like of int
        Pairs of vertices, in any order.

    Returns
    -------
    Scores

    Raises
    ------
    InvalidParameterError
        The skeleton is empty, or not finite, or no graph; or it is so much longer than the axis, or so much of a mesh,
        that it can be no answer.

    Examples
    --------
    >>> from glsk_o3d.samples import torus
    >>> ring = torus(500)
    >>> score(ring, ring.nodes, ring.edges).perfect
    True
    >>> score(ring, ring.nodes, ring.edges[1:]).loops
    -1
    """
    axis = truth if isinstance(truth, Truth) else Truth(truth.nodes, truth.edges, truth.radii)
    try:
        places = np.asarray(vertices, float).reshape(-1, 3)
        links = check_graph(places, edges, "skeleton")
    except (TypeError, ValueError) as error:
        if isinstance(error, InvalidParameterError):
            raise
        raise InvalidParameterError(f"the skeleton has vertices or edges of no use: {error}") from None
    _check_size(axis, places, links)
    found = compare(Skeleton(places, links, (), (), (), ()), axis).as_dict()  # type: ignore[arg-type]
    return Scores(**{name: found[name] for name in Scores.__dataclass_fields__ if name != "failure"})


def _check_size(axis: Truth, vertices: np.ndarray, edges: np.ndarray) -> None:
    """Raise InvalidParameterError for what would take too much memory to score."""
    with np.errstate(over="ignore"):
        length = np.linalg.norm(vertices[edges[:, 0]] - vertices[edges[:, 1]], axis=1).sum()
    places = length / (PLACE_SPACING * np.median(axis.radii)) + len(edges) + len(vertices)
    if not places <= MOST_ANSWER_PLACES:
        raise InvalidParameterError(
            f"the skeleton is {length:.3g} long and has {len(edges)} edges, too much for an answer: is it in the units "
            "of the cloud?"
        )
    junctions = int((np.bincount(simple_edges(edges).ravel(), minlength=1) > 2).sum())
    if junctions > MOST_ANSWER_JUNCTIONS:
        raise InvalidParameterError(
            f"the skeleton has {junctions} junctions, more than {MOST_ANSWER_JUNCTIONS}: is it a mesh?"
        )
