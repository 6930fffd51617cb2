"""What can be said of a skeleton as a whole: a verdict, a score, and the reasons."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from ..errors import InvalidParameterError
from ..geometry.groups import quantile
from .decisions import Decision, logistic

# Fitted on random tubes, frames, trees, figures, things, stout toys and rings, with damage as of scanners.
SCORE = dict(constant=-5.7, topology=4.7, limb=4.3, confidence=1.0, patch=-1.0)
NOISE_PATCH = 9.0  # fitted: logarithm of the points of the largest patch in noise, over the root of the share in all
LOW_CONFIDENCE_SHARE = 0.1  # fitted: of the vertices, whose confidence is at most the one that counts
GOOD_SCORE = 0.7  # measured: 15 % of the right graphs of other shapes have less


class Verdict(str, Enum):
    """Whether a skeleton can be relied on.

    Members are strings, from the best to the worst: ``"good"``, ``"doubtful"`` and ``"no curve skeleton"``, of what is
    a sheet or a ball, or has no edges. A better one is greater.

    Examples
    --------
    >>> from glsk_o3d import samples, skeletonize
    >>> skeletonize(samples.torus(1000).points).verdict
    <Verdict.GOOD: 'good'>
    >>> Verdict.GOOD > Verdict.DOUBTFUL, Verdict.DOUBTFUL >= "good"
    (True, False)
    """

    GOOD = "good"
    DOUBTFUL = "doubtful"
    NO_CURVE_SKELETON = "no curve skeleton"

    @property
    def _rank(self) -> int:
        return -list(Verdict).index(self)

    # by how good they are, and not by their letters
    def __lt__(self, other: str) -> bool:
        return self._rank < Verdict(other)._rank

    def __le__(self, other: str) -> bool:
        return self._rank <= Verdict(other)._rank

    def __gt__(self, other: str) -> bool:
        return self._rank > Verdict(other)._rank

    def __ge__(self, other: str) -> bool:
        return self._rank >= Verdict(other)._rank


def as_verdict(value: Verdict | str | None) -> Verdict | None:
    """A verdict, also by its word; None for none, and InvalidParameterError for other words."""
    try:
        return None if value is None else Verdict(value)
    except ValueError:
        words = ", ".join(repr(verdict.value) for verdict in Verdict)
        raise InvalidParameterError(f"accept = {value!r}: must be one of {words}") from None


CODES = {
    "sheet": Verdict.NO_CURVE_SKELETON,
    "sphere": Verdict.NO_CURVE_SKELETON,
    "no edges": Verdict.NO_CURVE_SKELETON,
    "weak region": Verdict.DOUBTFUL,
    "close call": Verdict.DOUBTFUL,
    "opened loops": Verdict.DOUBTFUL,
    "other samples": Verdict.DOUBTFUL,
    "low score": Verdict.DOUBTFUL,
    "unknown score": Verdict.DOUBTFUL,
    "tiles": Verdict.DOUBTFUL,
    "mixed pixels": Verdict.GOOD,
    "option": Verdict.GOOD,
    "other": Verdict.GOOD,
}
"""The codes of reasons, each with the best verdict that it leaves possible."""


@dataclass(frozen=True)
class Reason:
    """Something that a user should know about a skeleton; its text is a warning.

    Attributes
    ----------
    code : str
        Of `CODES`: ``"sheet"``, ``"sphere"``, ``"no edges"``, ``"weak region"``, ``"close call"``, ``"opened loops"``,
        ``"other samples"``, ``"low score"``, ``"unknown score"``, ``"tiles"``, ``"mixed pixels"``, ``"option"`` or
        ``"other"``.
    text : str
        The sentence that is issued as a SkeletonWarning.
    place : (x, y, z) or ()
        Where, in the cloud's units; empty of what has no place.
    numbers : dict of str to float
        What the sentence says in numbers, such as ``"share"`` of the points.
    """

    code: str
    text: str
    place: tuple[float, ...] = ()
    numbers: dict[str, float] = field(default_factory=dict)

    def __str__(self) -> str:
        return self.text


def graph_score(decisions: Iterable[Decision], confidence: np.ndarray, n_facing: int = 0, facing: float = 0.0) -> float:
    """The probability that a graph is right: components, loops and all ends. NaN without vertices.

    A logistic model of four facts: how certain the least certain decision about loops, empty space and gaps is, from a
    half to 1, and that about limbs; the tenth percentile of the confidence (M,) of the vertices; and the logarithm of
    `n_facing` of the report, as far as it is above that of the patches that noise makes of a share `facing`.
    """
    known = confidence[np.isfinite(confidence)]
    if len(known) == 0:
        return float("nan")
    certainty = dict(topology=1.0, limb=1.0)
    for decision in decisions:
        fact = "limb" if decision.about == "limb" else "topology"
        certainty[fact] = min(certainty[fact], decision.certainty)
    facts = dict(certainty, confidence=quantile(known, LOW_CONFIDENCE_SHARE))
    return logistic(SCORE, facts | dict(patch=_patch(n_facing, facing)))


def _patch(n_facing: int, facing: float) -> float:
    return max(float(np.log1p(n_facing) - NOISE_PATCH * np.sqrt(facing)), 0.0)


def reasons_of_score(
    score: float, decisions: Iterable[Decision], n_facing: int = 0, facing: float = 0.0
) -> tuple[Reason, ...]:
    """Why a score makes a verdict doubtful: it is low or unknown. None where it is good."""
    if score >= GOOD_SCORE:
        return ()
    if not score >= 0:
        text = "unknown score: the skeleton has no confidence, as without a Refiner, or of a file that does not keep it"
        return (Reason("unknown score", text),)
    text, place = f"low score: the graph is right with a probability of {score:.2f}", ()
    least = min(decisions, key=lambda decision: abs(decision.probability - 0.5), default=None)
    if least is not None:
        text, place = f"{text}; the least certain decision: {least}", least.place
    if _patch(n_facing, facing):
        text = f"{text}; {n_facing} points side by side face the curve, as where a hole was closed or a limb was lost"
    return (Reason("low score", text, place, dict(score=score)),)


def verdict_of(reasons: Iterable[Reason]) -> Verdict:
    """The worst verdict that a reason demands."""
    return min((CODES[reason.code] for reason in reasons), default=Verdict.GOOD)
