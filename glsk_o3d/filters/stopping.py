"""When to stop contracting: small classes with one method."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

from ..data.report import IterationRecord
from ..parameters import Parameters, documented, parameter

StopRule: TypeAlias = Callable[[tuple[IterationRecord, ...]], str | None]
"""Decides after every solve whether the contraction is finished: the reason to stop, or None to go on."""


@documented
@dataclass(frozen=True)
class ExplainedScore(Parameters):
    """Stop when the cloud's PCA score settles: De < threshold (Wen et al. 2024, equations 13 to 16).

    De is the change of e between two solves over the share of points kept between them. Like the published code, the
    rule never stops before the fourth solve. Otherwise it often stops after two, on an uncontracted cloud.

    Examples
    --------
    >>> from glsk_o3d import Contractor, RingBuilder
    >>> from glsk_o3d.samples import torus
    >>> state = (RingBuilder() | Contractor(stop=ExplainedScore(threshold=1, min_iterations=2)))(torus(500).points)
    >>> len(state.report.iterations)
    2
    """

    threshold: float = parameter(0.03, "De below which the contraction is finished.", low=0, open_low=True)
    min_iterations: int = parameter(4, "Solves before the rule may stop.", unit="solves", low=1)

    def __call__(self, iterations: tuple[IterationRecord, ...]) -> str | None:
        change = iterations[-1].explained_change
        if len(iterations) >= self.min_iterations and change < self.threshold:  # Wen (16)
            return f"explained score settled: De = {change:.4f} < {self.threshold:g}"
        return None


@documented
@dataclass(frozen=True)
class RingSizeRatio(Parameters):
    """Stop when the rings no longer shrink: a(t) - a(t+1) < threshold (Cao et al. 2010).

    Examples
    --------
    >>> from glsk_o3d import Contractor, RingBuilder
    >>> from glsk_o3d.samples import torus
    >>> state = (RingBuilder() | Contractor(stop=RingSizeRatio(threshold=1)))(torus(500).points)
    >>> state.report.stop_reason.partition(":")[0]
    'rings stopped shrinking'
    """

    threshold: float = parameter(0.01, "Drop of the ring ratio below which it is finished.", low=0)

    def __call__(self, iterations: tuple[IterationRecord, ...]) -> str | None:
        before = iterations[-2].ring_ratio if len(iterations) > 1 else 1.0
        drop = before - iterations[-1].ring_ratio
        if drop < self.threshold:
            return f"rings stopped shrinking: a(t) - a(t+1) = {drop:.4f} < {self.threshold:g}"
        return None
