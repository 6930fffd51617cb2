"""What is said about parts of a skeleton: how questions about its topology were answered, and which samples show it."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np

from ..geometry.vectors import FARTHEST_PLACE

Place: TypeAlias = tuple[float, float, float]


class Words(NamedTuple):
    """How the answer to a question about the topology is told."""

    asks: str  # what the probability is of, with the place
    kept: str  # what was done where the graph stayed as it was
    changed: str  # and where it was changed
    option: str  # of the Refiner: the probability that decides
    changes_from: bool  # whether the graph is changed from that on; otherwise below it


def logistic(weights: Mapping[str, float], facts: Mapping[str, float]) -> float:
    """The probability of a logistic model with weights of facts and of a constant."""
    total = weights["constant"] + sum(weight * facts[name] for name, weight in weights.items() if name != "constant")
    return float(1 / (1 + np.exp(-np.clip(total, -50, 50))))


WORDS = {
    "loop": Words("the loop at ({}) is a handle", "loop kept", "loop closed", "handle", False),
    "limb": Words("the branch at ({}) is a limb", "limb kept", "spur pruned", "limb", False),
    "air": Words("the branch at ({}) crosses air", "branch kept", "branch cut", "air", True),
    "gap": Words("the object goes on across the gap at ({})", "gap left", "gap bridged", "bridge", True),
}
"""What is asked about loops, about branches that leave a junction, about branches, and about ends, in this order."""


@dataclass(frozen=True)
class Decision:
    """A question about the topology and its answer.

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
    branch : tuple of (x, y, z)
        Of a pruned branch the places of its vertices, from the junction that it left to its tip; see
        `glsk_o3d.editing.detailed`.
    radii : tuple of float
        At these places.

    Examples
    --------
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import torus
    >>> [(it.about, it.changed) for it in skeletonize(torus(1000).points).report.decisions if it.about == "loop"]
    [('loop', False)]
    >>> str(Decision("loop", (0.0, 0.5, 2.0), 0.55, changed=False))
    'the loop at (0, 0.5, 2) is a handle: 0.55, loop kept'
    """

    about: str
    place: Place
    probability: float
    changed: bool
    branch: tuple[Place, ...] = ()
    radii: tuple[float, ...] = ()

    @property
    def certainty(self) -> float:
        """Probability of the likelier answer, from a half to 1."""
        return max(self.probability, 1 - self.probability)

    @property
    def is_uncertain(self) -> bool:
        """Whether the probability lies between a quarter and three quarters."""
        return 0.25 <= self.probability <= 0.75

    @property
    def is_possible(self) -> bool:
        """Whether the probability lies between 0 and 1, places are near enough, and each of a branch has a radius."""
        places, radii = np.array([self.place, *self.branch]), np.array(self.radii)
        return bool(
            0 <= self.probability <= 1
            and (np.abs(places) <= FARTHEST_PLACE).all()
            and len(self.branch) == len(radii) != 1
            and not ((radii < 0) | np.isinf(radii)).any()
        )

    @property
    def outcome(self) -> str:
        """The action in two words, such as ``"loop closed"`` or ``"gap left"``."""
        words = WORDS[self.about]
        return words.changed if self.changed else words.kept

    @property
    def question(self) -> str:
        """What the probability is of, such as ``"the loop at (0, 0, 1) is a handle"``."""
        return WORDS[self.about].asks.format(coordinates(self.place))

    @property
    def otherwise(self) -> str:
        """The option that would have changed a close call of the Refiner, such as ``"Refiner.limb=0.56"``."""
        words = WORDS[self.about]
        if self.changed == words.changes_from:
            hundredths = math.ceil(100 * self.probability + 0.5)
        else:
            hundredths = math.floor(100 * self.probability - 0.5)
        return f"Refiner.{words.option}={hundredths / 100:.2f}"

    def __str__(self) -> str:
        return f"{self.question}: {self.probability:.2f}, {self.outcome}"


WELL_SUPPORTED = 0.8  # warning: of the samples show what can be relied on, and do not show what is not there


@dataclass(frozen=True)
class Supported:
    """A part that a skeleton has or lacks, and the share of samples of the cloud whose skeletons have it.

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
