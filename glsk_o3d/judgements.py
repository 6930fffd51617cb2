"""What is said about parts of a skeleton: how questions about its topology were answered, and which samples show it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TypeAlias

Place: TypeAlias = tuple[float, float, float]

QUESTIONS = {  # what is asked, and what was done where the graph stayed as it was and where it was changed
    "air": ("the branch at ({}) crosses air", "branch kept", "branch cut"),
    "loop": ("the loop at ({}) is a handle", "loop kept", "loop closed"),
    "gap": ("the object goes on across the gap at ({})", "gap left", "gap bridged"),
    "limb": ("the branch at ({}) is a limb", "limb kept", "spur pruned"),
}


@dataclass(frozen=True)
class Judgement:
    """A question about the topology, and how it was answered.

    Attributes
    ----------
    about : {"air", "loop", "gap", "limb"}
        Whether a branch crosses air, a loop is a handle, a gap is bridged by the object, or a branch is a
        limb and no spur.
    place : (x, y, z)
        In the cloud's units.
    probability : float
        That it is so.
    changed : bool
        Whether the graph was changed: the branch cut there, the loop closed, the gap bridged, the branch pruned.

    Examples
    --------
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import torus
    >>> [(it.about, it.changed) for it in skeletonize(torus(1000).points).report.judgements if it.about == "loop"]
    [('loop', False)]
    >>> str(Judgement("loop", (0.0, 0.5, 2.0), 0.55, changed=False))
    'the loop at (0, 0.5, 2) is a handle: 0.55, loop kept'
    """

    about: str
    place: Place
    probability: float
    changed: bool

    @property
    def is_uncertain(self) -> bool:
        """Whether the probability lies between a quarter and three quarters."""
        return 0.25 <= self.probability <= 0.75

    @property
    def outcome(self) -> str:
        """What was done, in two words, such as ``"loop closed"`` or ``"gap left"``."""
        return QUESTIONS[self.about][1 + self.changed]

    @property
    def question(self) -> str:
        """What the probability is of, such as ``"the loop at (0, 0, 1) is a handle"``."""
        return QUESTIONS[self.about][0].format(coordinates(self.place))

    def __str__(self) -> str:
        return f"{self.question}: {self.probability:.2f}, {self.outcome}"


WELL_SUPPORTED = 0.8  # fitted: of the samples show what can be relied on, and do not show what is not there


@dataclass(frozen=True)
class Supported:
    """A part of a skeleton, or one that it lacks, and how many skeletons of other samples of the cloud show it.

    Attributes
    ----------
    about : {"branch", "loop", "end"}
    place : (x, y, z)
        The middle of a branch or a loop, or the end; in the cloud's units.
    share : float
        Of the samples that show it.
    present : bool
        Whether the skeleton has it.

    Examples
    --------
    >>> str(Supported("end", (0.0, 0.5, 2.0), 0.625))
    'the end at (0, 0.5, 2), which 62 % of the samples show'
    """

    about: str
    place: Place
    share: float
    present: bool = True

    @property
    def doubt(self) -> float:
        """Share of the samples that disagree with the skeleton."""
        return 1 - self.share if self.present else self.share

    @property
    def is_well_supported(self) -> bool:
        """Whether four fifths of the samples agree with the skeleton."""
        return self.doubt <= 1 - WELL_SUPPORTED

    def __str__(self) -> str:
        lacking = "" if self.present else ", and this skeleton does not"
        share = f"{100 * self.share:.0f} %"
        return f"the {self.about} at ({coordinates(self.place)}), which {share} of the samples show{lacking}"


def coordinates(place: Iterable[float]) -> str:
    """A place as people read it: four digits, and of coordinates as on a map all ahead of the point and two more."""
    return ", ".join(f"{c:.4g}" if abs(c) < 1000 or not abs(c) < 1e8 else f"{c:.2f}" for c in place)
