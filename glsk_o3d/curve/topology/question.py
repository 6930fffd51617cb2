"""Questions about the topology of a curve, and the one engine that answers them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ...data.decisions import WORDS, Decision
from ..curve import Curve
from ..surface import Evidence, Surface


@dataclass(frozen=True, eq=False)
class Candidate:
    """A part of a curve that a question is about, and the answer."""

    part: Any  # what `Question.change` needs to know of it
    place: np.ndarray  # (3,)
    facts: Mapping[str, float]  # what speaks for and against it
    probability: float
    changes: bool  # whether the graph is to be changed there
    branch: tuple[np.ndarray, np.ndarray] = (np.empty((0, 3)), np.empty(0))  # places and radii of what is cut off

    def decision(self, about: str) -> Decision:
        """The candidate as the report has it."""
        branch, radii = (values.tolist() for values in self.branch)
        return Decision(
            about, tuple(self.place.tolist()), self.probability, self.changes, tuple(map(tuple, branch)), tuple(radii)
        )


class Question:
    """A question about parts of a curve: a small logistic model of the facts that speak for and against each.

    An instance is asked about one curve, and about what becomes of it.
    """

    about: ClassVar[str]  # as in `Decision`
    weights: ClassVar[Mapping[str, float]]  # of the facts, and of a constant
    repeats: ClassVar[bool]  # whether it is asked again of a changed curve

    def changes(self, probability: float, least: float) -> bool:
        """Whether the graph is changed where the probability is this and `least` decides."""
        return (probability >= least) == WORDS[self.about].changes_from

    def candidates(self, evidence: Evidence, least: float) -> Sequence[Candidate]:
        """The parts that are asked about, with the answers; `least` is the probability that decides."""
        raise NotImplementedError

    def change(self, evidence: Evidence, chosen: Sequence[Candidate]) -> Curve:
        """The curve after the graph was changed at some candidates, at least one."""
        raise NotImplementedError


def ask(question: Question, curve: Curve, surface: Surface, least: float) -> tuple[Curve, list[Decision]]:
    """A curve after a question was answered for all its parts, and the decisions: those that changed it first."""
    decisions: list[Decision] = []
    while True:
        evidence = Evidence(curve, surface)
        candidates = question.candidates(evidence, least)
        chosen = [candidate for candidate in candidates if candidate.changes]
        if chosen:
            curve = question.change(evidence, chosen)
        if not chosen or not question.repeats:
            return curve, decisions + [candidate.decision(question.about) for candidate in candidates]
        decisions += [candidate.decision(question.about) for candidate in chosen]
