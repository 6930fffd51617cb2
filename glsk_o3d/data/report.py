"""What a run did, and why it stopped."""

from __future__ import annotations

import dataclasses
import sys
import warnings as _warnings
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache
from html import escape
from importlib.metadata import PackageNotFoundError, version
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

from ..errors import SkeletonWarning
from .decisions import WORDS, Decision, Place, Supported
from .derived import Changeable
from .verdict import CODES, Reason

Flow = TypeVar("Flow", bound="Reported")

NOT_CONTRACTED = "not contracted"
STOPPED_BY_CALLER = "stopped by the caller"
REFUSED = "refused, last sound state kept"


@dataclass(frozen=True)
class IterationRecord:
    """One iteration of a contraction.

    Attributes
    ----------
    iteration : int
        Counted from 1.
    n_points, n_merged, n_held : int
        Points of the solve, points merged after it, and points held because they would have left the bounding box.
    explained, explained_change : float
        PCA score e of the contracted points, 1 for a straight line, and De, its change per share of points kept
        (Wen et al. 2024, equations 14 and 16).
    ring_ratio, contraction_weight : float
        a(t), the sum of the ring sizes over that of the uncontracted cloud, and w_L of the solve.
    solve_error : float
        Estimated error of the linear solve, as a share of the cloud's size.
    seconds : float
        Wall time, the reduction included.

    Examples
    --------
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import torus
    >>> first = skeletonize(torus(1000).points).report.iterations[0]
    >>> first.iteration, first.ring_ratio < 1
    (1, True)
    """

    iteration: int
    n_points: int
    n_merged: int
    n_held: int
    explained: float
    explained_change: float
    ring_ratio: float
    contraction_weight: float
    solve_error: float
    seconds: float


def _read(value: Any, hint: Any, name: str = "it") -> Any:
    """A value of a file as its type has it, records from dicts and tuples from lists; ValueError for others."""
    kind, inner = get_origin(hint) or hint, get_args(hint)
    if dataclasses.is_dataclass(kind) and isinstance(value, Mapping):
        hints = get_type_hints(kind)
        known: Any = {key: _read(entry, hints[key], key) for key, entry in value.items() if key in hints}
        return kind(**known)  # type: ignore[operator]
    elif kind is tuple and isinstance(value, list | tuple):
        items = inner[:1] * len(value) if Ellipsis in inner else inner
        if len(value) == len(items):
            return tuple(_read(entry, item, name) for entry, item in zip(value, items, strict=True))
    elif kind is dict and isinstance(value, dict):
        return {key: _read(entry, inner[1], name) for key, entry in value.items()}
    elif kind in (int, float):  # whole numbers that are not too large are floats, too
        if (type(value) is int and abs(value) <= sys.maxsize) or (kind is float and isinstance(value, float)):
            return value
    elif kind is Any or isinstance(value, kind):
        return value
    raise ValueError(f"{name} in its report is {repr(value)[:80]}")


class Markup(str):
    """HTML."""


def markup(template: str, *values: Any, **named: Any) -> Markup:
    """HTML of a template, as `str.format` fills it: every value is escaped, but HTML, and each of those in a list."""

    def safe(value: Any) -> str:
        if isinstance(value, list):
            return "".join(map(safe, value))
        return value if isinstance(value, Markup) else escape(str(value))

    return Markup(template.format(*map(safe, values), **{name: safe(value) for name, value in named.items()}))


def warn(messages: Iterable[str]) -> None:
    """Issue SkeletonWarnings."""
    for message in messages:
        _warnings.warn(message, SkeletonWarning, stacklevel=outside())


def outside() -> int:
    """Stack level, as seen from the caller, of the first frame that is not of this package: the user's line."""
    frame, level, package = sys._getframe(1), 1, __name__.partition(".")[0]
    while frame.f_back is not None and frame.f_globals.get("__name__", "").startswith(package):
        frame, level = frame.f_back, level + 1
    return level


@cache
def _versions() -> dict[str, str]:
    versions = dict.fromkeys(("glsk-o3d", "numpy", "scipy", "open3d"), "not installed")
    for name in versions:
        with suppress(PackageNotFoundError):
            versions[name] = version(name)
    return versions


@dataclass(frozen=True)
class Report:
    """The record of a run, kept and saved with the result.

    Attributes
    ----------
    n_input, n_dropped, n_by_area, n_sampled, n_outliers, n_mixed, n_distinct, n_contracted : int
        Numbers of input points, points dropped as not finite, points by area that stand for a mesh (0 if its vertices
        do), points of the sample of a large cloud (all of a small one), outliers, those of them that are mixed pixels,
        distinct points of the sample, and contracted points.
    noise : float
        Mean share of noise of the neighbourhoods, from 0 to 1.
    on_medial_axis : bool
        Whether the graph is that of the medial axis, whose loops and pieces are those of the solid.
    n_loops_closed, n_cuts, n_bridges : int
        Probable non-handles that were closed, branches that were cut because they probably cross air, and bridged gaps.
    n_facing, facing : int, float
        Of a sample of the points, those of the largest patch whose surface faces its own curve, as walls of a closed
        hole and flanks of a lost limb do, and the share of all that do.
    n_traced : int
        Input points without a surface, whose parts were traced along shortest paths.
    joined : tuple of ((x, y, z), (x, y, z))
        Ends, in the cloud's units, of what no point supports: bridges, handles led through a bowl, paths that meet, and
        gaps joined between pieces without a surface, or to make one tree.
    root : (x, y, z) or ()
        The root of a tree; empty without one.
    decisions : tuple of Decision
        The questions about the topology, with probabilities and actions.
    n_draws, n_agreeing : int
        Samples of the cloud that `glsk_o3d.support` compared, and those with as many components, loops and ends.
    support : tuple of Supported
        Share of the samples with each branch, loop and end of this skeleton, and with loops and ends that it lacks.
    stages : tuple of str
        The filters that ran, as the expressions that rebuild them.
    recipe : dict
        The pipeline as `glsk_o3d.from_recipe` reads it; empty if unknown. ``"unwritten"`` names what it cannot hold.
    seconds : dict of str to float
        Wall time per filter.
    iterations : tuple of IterationRecord
    converged, stop_reason : bool, str
        Whether the stopping rule ended the contraction, and why it ended.
    reasons : tuple of Reason
        What a user should know about the skeleton.
    versions : dict of str to str

    Examples
    --------
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import torus
    >>> report = skeletonize(torus(1000).points).report
    >>> report.n_input, report.converged, report.warnings
    (1000, True, ())
    """

    n_input: int = 0
    n_dropped: int = 0
    n_by_area: int = 0
    n_sampled: int = 0
    n_outliers: int = 0
    n_mixed: int = 0
    n_distinct: int = 0
    n_contracted: int = 0
    noise: float = 0.0
    on_medial_axis: bool = False
    n_loops_closed: int = 0
    n_cuts: int = 0
    n_bridges: int = 0
    n_facing: int = 0
    facing: float = 0.0
    n_traced: int = 0
    joined: tuple[tuple[Place, Place], ...] = ()
    root: tuple[float, ...] = ()
    decisions: tuple[Decision, ...] = ()
    n_draws: int = 0
    n_agreeing: int = 0
    support: tuple[Supported, ...] = ()
    stages: tuple[str, ...] = ()
    recipe: dict[str, Any] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)
    iterations: tuple[IterationRecord, ...] = ()
    converged: bool = False
    stop_reason: str = NOT_CONTRACTED
    reasons: tuple[Reason, ...] = ()
    versions: dict[str, str] = field(default_factory=_versions)

    def __str__(self) -> str:
        """What there is to say, in about ten lines; ``repr`` has it all."""
        return "\n".join(["Report", *(f"{name:11} {words}".rstrip() for name, words in self._lines())])

    def _repr_html_(self) -> Markup:
        cell = '<td style="text-align:left;padding:2px 10px">{}</td>'  # not every notebook has Jupyter's sheet
        rows = [markup("<tr>{}</tr>", [markup(cell, text) for text in row]) for row in self._lines()]
        return markup('<table style="font:13px/1.5 system-ui,sans-serif;border-collapse:collapse">{}</table>', rows)

    def _lines(self) -> list[tuple[str, str]]:
        """The lines, each as a name and what there is to say of it; the warnings come last."""
        counts = {name[2:].replace("_", " "): value for name, value in vars(self).items() if name.startswith("n_")}
        return [
            ("stopped", f"{self.stop_reason}, after {len(self.iterations)} solves"),
            ("counts", ", ".join(f"{value} {name}" for name, value in counts.items() if value)),
            ("noise", f"{self.noise:.2f}"),
            ("decisions", f"{len(self.decisions)}, {len(self.uncertain)} of them uncertain"),
            *(("uncertain", str(part)) for part in self.uncertain[:1]),
            *(("unsupported", str(part)) for part in self.unsupported[:1]),
            ("seconds", ", ".join(f"{name} {value:.2f}" for name, value in self.seconds.items())),
            ("versions", ", ".join(map(" ".join, self.versions.items()))),
            *(("warning", part) for part in self.warnings),
        ]

    def with_reason(self, code: str, text: str, place: tuple[float, ...] = (), **numbers: float) -> Report:
        """This report with one more reason; its text is issued as a warning at the end."""
        return dataclasses.replace(self, reasons=(*self.reasons, Reason(code, text, place, numbers)))

    def with_warning(self, text: str) -> Report:
        """This report with one more reason that has no code of its own."""
        return self.with_reason("other", text)

    @property
    def warnings(self) -> tuple[str, ...]:
        """The texts of the reasons."""
        return tuple(map(str, self.reasons))

    @property
    def is_sampled(self) -> bool:
        """Whether a sample represents the cloud."""
        return 0 < self.n_sampled < (self.n_by_area or self.n_input - self.n_dropped)

    @property
    def uncertain(self) -> tuple[Decision, ...]:
        """Decisions with a probability between a quarter and three quarters, the least certain first."""
        return tuple(
            sorted(
                (decision for decision in self.decisions if decision.is_uncertain),
                key=lambda decision: abs(decision.probability - 0.5),
            )
        )

    @property
    def unsupported(self) -> tuple[Supported, ...]:
        """Parts that more than a fifth of the samples contradict, the most doubtful first."""
        return tuple(
            sorted((part for part in self.support if not part.is_well_supported), key=lambda part: -part.doubt)
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain dict of numbers, strings, lists and dicts, as saved in JSON."""
        return dataclasses.asdict(self)

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Report:
        """Inverse of `to_dict`; unknown entries of later versions are ignored."""
        earlier = [dict(code="other", text=text) for text in data.get("warnings", ())]  # of version 0.1.0
        report: Report = _read({"reasons": earlier, **data}, cls)
        if not all(reason.code in CODES for reason in report.reasons):
            raise ValueError("a reason in its report has an unknown code")
        if not all(decision.about in WORDS for decision in report.decisions):
            raise ValueError("a decision in its report is about an unknown question")
        if not all(decision.is_possible for decision in report.decisions):
            raise ValueError("a decision in its report has a probability, a place or a branch that cannot be")
        if len(report.root) not in (0, 3):
            raise ValueError("the root in its report is no place")
        if not isinstance(report.recipe.get("pipeline", []), list):
            raise ValueError("the recipe in its report has no list of stages")
        return report


class Reported(Changeable):
    """Base of what flows between filters, and carries the record of the run."""

    report: Report

    def with_report(self: Flow, report: Report) -> Flow:
        """The same with another record of the run."""
        return self.changed(report=report)

    def with_facts(self: Flow, **facts: Any) -> Flow:
        """The same with other facts in the record of the run."""
        return self.with_report(dataclasses.replace(self.report, **facts))
