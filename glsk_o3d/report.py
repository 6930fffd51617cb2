"""What a run did, and why it stopped."""

from __future__ import annotations

import dataclasses
import sys
import warnings as _warnings
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache
from html import escape
from importlib.metadata import PackageNotFoundError, version
from types import UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

from .decisions import QUESTIONS, Decision, Place, Supported
from .errors import SkeletonWarning
from .interop.packages import QUIET, open3d_is

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
        Points of the solve, points merged after it, and points held because the solve would have thrown them out of the
        bounding box.
    explained, explained_change : float
        PCA score e of the contracted points, 1 for a straight line (Wen et al. 2024, equation 14), and De, its change
        per share of points kept (equation 16).
    ring_ratio : float
        a(t), the sum of the ring sizes over that of the uncontracted cloud.
    contraction_weight : float
        w_L of the solve.
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
    if kind in (Union, UnionType):
        for each in inner:
            with suppress(ValueError):
                return _read(value, each, name)
    elif dataclasses.is_dataclass(kind) and isinstance(value, Mapping):
        hints = get_type_hints(kind)
        known: Any = {key: _read(each, hints[key], key) for key, each in value.items() if key in hints}
        return kind(**known)  # type: ignore[operator]
    elif kind is tuple and isinstance(value, list | tuple):
        items = inner[:1] * len(value) if Ellipsis in inner else [each for each in inner if each != ()]
        if len(value) == len(items):
            return tuple(_read(each, item, name) for each, item in zip(value, items, strict=True))
    elif kind is dict and isinstance(value, dict):
        return {key: _read(each, inner[1], name) for key, each in value.items()}
    elif kind in (int, float):  # whole numbers that are not too large are floats, too
        if (type(value) is int and abs(value) <= sys.maxsize) or (kind is float and isinstance(value, float)):
            return value
    elif kind is Any or isinstance(value, kind):
        return value
    raise ValueError(f"{name} in its report is {repr(value)[:80]}")


def _told(counts: Mapping[str, int]) -> str:
    """Numbers with what they are of, but for zeros."""
    return ", ".join(f"{n} {name}" for name, n in counts.items() if n)


def html_table(rows: Iterable[Sequence[str]], heads: Sequence[str] = (), align: str = "left") -> str:
    """Texts as a table for a notebook, escaped; its style is in it, since not every notebook has Jupyter's sheet."""

    def row(tag: str, texts: Sequence[str]) -> str:
        cells = (f'<{tag} style="text-align:{align};padding:2px 10px">{escape(text)}</{tag}>' for text in texts)
        return f"<tr>{''.join(cells)}</tr>"

    head = f"<thead>{row('th', heads)}</thead>" if heads else ""
    body = "".join(row("td", texts) for texts in rows)
    style = "font:13px/1.5 system-ui,sans-serif;border-collapse:collapse;margin-top:4px"
    return f'<table style="{style}">{head}<tbody>{body}</tbody></table>'


def warn(messages: Iterable[str]) -> None:
    """Issue SkeletonWarnings, unless Open3D's verbosity is Error."""
    for message in messages:
        if not open3d_is(QUIET):
            _warnings.warn(message, SkeletonWarning, stacklevel=outside())


def outside() -> int:
    """Stack level, as seen from the caller, of the first frame that is not of this package: the user's line."""
    frame, level = sys._getframe(1), 1
    while frame.f_back is not None and frame.f_globals.get("__name__", "").startswith(__package__):
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
    n_input, n_dropped, n_sampled, n_outliers, n_distinct, n_contracted : int
        Numbers of input points, points dropped as not finite, points of the sample of a large cloud (all of a small
        one), outliers, distinct points of the sample, and contracted points.
    noise : float
        Mean share of noise of the neighbourhoods, from 0 to 1.
    n_loops_closed, n_cuts, n_bridges : int
        Probable non-handles that were closed, branches that were cut because they probably cross air, and bridged gaps.
    n_traced : int
        Input points without a surface, whose parts were traced along shortest paths.
    joined : tuple of ((x, y, z), (x, y, z))
        Ends of the gaps joined there, or to make one tree, in the cloud's units.
    root : (x, y, z) or ()
        The root of a tree; empty without one.
    decisions : tuple of Decision
        The questions about the topology, with probabilities and actions.
    n_draws, n_agreeing : int
        Number of samples of the cloud compared by `glsk_o3d.support`, and of those with as many components, loops and
        ends.
    support : tuple of Supported
        Share of the samples with each branch, loop and end of this skeleton, and with loops and ends that it lacks.
    stages : tuple of str
        The filters that ran, as the expressions that rebuild them.
    recipe : dict
        The pipeline as `glsk_o3d.from_recipe` reads it; empty if unknown. An entry ``"unwritten"`` names a part that a
        recipe cannot hold.
    seconds : dict of str to float
        Wall time per filter.
    iterations : tuple of IterationRecord
    converged : bool
        Whether the stopping rule ended the contraction.
    stop_reason : str
    warnings : tuple of str
    versions : dict of str to str

    Examples
    --------
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import torus
    >>> report = skeletonize(torus(1000).points).report
    >>> report.n_input, report.converged, report.warnings
    (1000, True, ())
    >>> list(report.seconds)
    ['Sampler', 'OutlierRemover', 'Denoiser', 'Thinner', 'RingBuilder', 'Contractor', 'Connector', 'Refiner', 'Tracer']
    """

    n_input: int = 0
    n_dropped: int = 0
    n_sampled: int = 0
    n_outliers: int = 0
    n_distinct: int = 0
    n_contracted: int = 0
    noise: float = 0.0
    n_loops_closed: int = 0
    n_cuts: int = 0
    n_bridges: int = 0
    n_traced: int = 0
    joined: tuple[tuple[Place, Place], ...] = ()
    root: Place | tuple[()] = ()
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
    warnings: tuple[str, ...] = ()
    versions: dict[str, str] = field(default_factory=_versions)

    def __str__(self) -> str:
        """What there is to say, in about ten lines; ``repr`` has it all."""
        return "\n".join(["Report", *(f"{name:10} {words}".rstrip(": ") for name, words in self._told())])

    def _repr_html_(self) -> str:
        return html_table((name, words.rstrip(": ")) for name, words in self._told())

    def _told(self) -> list[tuple[str, str]]:
        """The lines, each as a name and what there is to say of it; the warnings come last."""
        counts = dict(
            contracted=self.n_contracted, dropped=self.n_dropped, outliers=self.n_outliers, traced=self.n_traced
        )
        changes = {"loops closed": self.n_loops_closed, "branches cut": self.n_cuts, "gaps bridged": self.n_bridges}
        lines = {
            "stopped": f"{self.stop_reason}, after {len(self.iterations)} solves",
            "points": f"{self.n_input}{f', of which {self.n_sampled} are sampled' * self.is_sampled}: {_told(counts)}",
            "noise": f"{self.noise:.2f}",
            "graph": _told(changes) or "nothing closed, cut or bridged",
            "decisions": f"{len(self.decisions)}, {len(self.uncertain)} of them uncertain",
            "uncertain": str(self.uncertain[0]) if self.uncertain else "",
            "support": f"{self.n_agreeing} of {self.n_draws} samples have the same graph" if self.n_draws else "",
            "weakest": str(self.unsupported[0]) if self.unsupported else "",
            "seconds": f"{sum(self.seconds.values()):.2f}: "
            + ", ".join(f"{k} {v:.2f}" for k, v in self.seconds.items()),
            "versions": ", ".join(map(" ".join, self.versions.items())),
        }
        told = [(name, words) for name, words in lines.items() if words]
        return told + [("warning", each) for each in self.warnings]

    def with_warning(self, message: str) -> Report:
        """This report with one more warning, which a pipeline, or a filter called alone, issues at the end."""
        return dataclasses.replace(self, warnings=(*self.warnings, message))

    @property
    def is_sampled(self) -> bool:
        """Whether a sample represents the cloud."""
        return 0 < self.n_sampled < self.n_input - self.n_dropped

    @property
    def uncertain(self) -> tuple[Decision, ...]:
        """Decisions with a probability between a quarter and three quarters, the least certain first."""
        uncertain = (each for each in self.decisions if each.is_uncertain)
        return tuple(sorted(uncertain, key=lambda each: abs(each.probability - 0.5)))

    @property
    def unsupported(self) -> tuple[Supported, ...]:
        """Parts that more than a fifth of the samples contradict, the most doubtful first."""
        unsupported = (each for each in self.support if not each.is_well_supported)
        return tuple(sorted(unsupported, key=lambda each: -each.doubt))

    def to_dict(self) -> dict[str, Any]:
        """Plain dict of numbers, strings, lists and dicts, as saved in JSON."""
        return dataclasses.asdict(self)

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Report:
        """Inverse of `to_dict`; unknown entries of later versions are ignored."""
        if "judgements" in data:  # what decisions were called in files of before
            data = {"decisions": data["judgements"], **data}
        report = _read(data, cls)
        if not all(decision.about in QUESTIONS for decision in report.decisions):
            raise ValueError("a decision in its report is about an unknown question")
        if not isinstance(report.recipe.get("pipeline", []), list):
            raise ValueError("the recipe in its report has no list of stages")
        return report
