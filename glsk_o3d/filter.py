"""What all filters share: parameters that describe and check themselves, and `|`."""

from __future__ import annotations

import dataclasses
import inspect
import logging
import math
import re
import time
from collections.abc import Callable
from numbers import Integral, Real
from typing import TYPE_CHECKING, Any, ClassVar

from .errors import GlskError, InvalidCloudError, InvalidParameterError, StageError
from .interop.open3d import cloud_points
from .interop.verbosity import following_open3d

if TYPE_CHECKING:
    from .pipeline import Pipeline
    from .report import IterationRecord
    from .state import Contraction

    OnIteration = Callable[[IterationRecord], bool | None]
    OnState = Callable[[Contraction], object]

_log = logging.getLogger(__name__)


TYPES = ("int", "float", "bool", "length", "choice", "reducer", "stop")
"""What a parameter may be; with a trailing ``?`` also None."""


def parameter(
    default: Any,
    doc: str,
    *,
    type: str,
    unit: str = "-",
    low: float | None = None,
    high: float | None = None,
    open_low: bool = False,
    choices: tuple[str, ...] = (),
) -> Any:
    """A dataclass field that carries its own documentation and limits.

    Parameters
    ----------
    default : object
    doc : str
        One sentence; it appears in the class's docstring and in ``glsk filters``.
    type : {"int", "float", "bool", "length", "choice", "reducer", "stop"}
        A length is a float in the cloud's units or a string such as ``"2%"`` of the diagonal of the box that
        `RingBuilder.frame` names. A trailing ``?`` allows None.
    unit : str
    low, high : float, optional
        Inclusive limits (`low` is exclusive with `open_low`); for a length in percent they limit nothing.
    open_low : bool
    choices : tuple of str
        What the type ``"choice"`` may be; any other type may also be one of these words.
    """
    facts = dict(doc=doc, type=type, unit=unit, low=low, high=high, open_low=open_low, choices=choices)
    return dataclasses.field(default=default, metadata=facts)


def documented(cls):
    """Class decorator: append the numpydoc "Parameters" section made from the fields' own facts.

    Parameters
    ----------
    cls : dataclass
        All of whose fields are made by `parameter`.

    Returns
    -------
    class
        The same.
    """
    lines = []
    for field in dataclasses.fields(cls):
        facts = field.metadata
        words = [repr(choice) for choice in facts["choices"]]
        kind = " or ".join(words + [facts["type"].replace("?", " or None")] * (facts["type"] != "choice"))
        unit = "" if facts["unit"] == "-" else f" [{facts['unit']}]"
        lines += [f"{field.name} : {kind}{unit}, default {field.default!r}", f"    {facts['doc']}"]
    if lines:
        cls.__doc__ = f"{inspect.cleandoc(cls.__doc__)}\n\nParameters\n----------\n" + "\n".join(lines) + "\n"
    return cls


FLOWS = ("cloud", "Contraction", "Skeleton")
"""What runs between filters."""
RESERVED = ("filter", "rule", "unwritten")
"""Names that no parameter has, since recipes use them."""


class Parameters:
    """Mixin of frozen dataclasses whose fields are made by `parameter`: checked when used, not when made."""

    def check(self) -> None:
        """Raise InvalidParameterError if a parameter has the wrong type or is out of range."""
        for field in dataclasses.fields(self):  # type: ignore[arg-type]
            value = getattr(self, field.name)
            problem = problem_with(value, field.metadata)
            if problem:
                raise InvalidParameterError(f"{type(self).__name__}.{field.name} = {value!r}: {problem}")
            if isinstance(value, Parameters):
                value.check()


def problem_with(value: Any, facts: Any) -> str | None:
    """What is wrong with the value of a parameter.

    Parameters
    ----------
    value : object
    facts : mapping
        As `parameter` makes it.

    Returns
    -------
    str or None
        None where nothing is.
    """
    kind, low, high = facts["type"], facts["low"], facts["high"]
    if isinstance(value, str) and value in facts["choices"]:
        return None
    if kind.endswith("?"):
        if value is None:
            return None
        kind = kind[:-1]
    if kind == "bool":
        return None if isinstance(value, bool) else "must be True or False"
    if kind == "choice":
        return f"must be one of {', '.join(map(repr, facts['choices']))}"
    if kind in ("reducer", "stop"):
        usable = callable(value) and not isinstance(value, type)
        return None if usable else f"must be a {kind}: an instance, not a class or a name"
    if kind == "length" and isinstance(value, str):
        percent = _percent(value)
        if percent is None:
            return "must be a number in the cloud's units or a percentage of its diagonal such as '2%'"
        return None if 0 < percent <= 100 else "a percentage of the diagonal lies above 0% and up to 100%"
    if isinstance(value, bool) or not isinstance(value, Integral if kind == "int" else Real):
        words = "".join(f", or {choice!r}" for choice in facts["choices"])
        return f"must be {'an int' if kind == 'int' else 'a number'}{words}"
    if not isinstance(value, Integral) and not math.isfinite(value):
        return "must be finite"
    if low is not None and (value < low or (facts["open_low"] and value == low)):
        return f"must be {'above' if facts['open_low'] else 'at least'} {low}"
    if high is not None and value > high:
        return f"must be at most {high}"
    return None


def _percent(text: str) -> float | None:
    match = re.fullmatch(r"\s*([0-9]*\.?[0-9]+(?:[eE][-+]?[0-9]+)?)\s*%\s*", text)
    return float(match[1]) if match else None


def resolve_length(length: float | str, diagonal: float) -> float:
    """A length in the cloud's units: a number as it is, ``"2%"`` as a share of the diagonal.

    Parameters
    ----------
    length : float or str
    diagonal : float
        In the cloud's units: of the bounding box or of the box with the spread of the points, as `RingBuilder.frame`
        says.

    Returns
    -------
    float

    Examples
    --------
    >>> resolve_length("2%", 50.0), resolve_length(0.3, 50.0)
    (1.0, 0.3)
    """
    if isinstance(length, str):
        percent = _percent(length)
        if percent is None:
            raise InvalidParameterError(f"length {length!r}: must be a number or a percentage such as '2%'")
        return percent / 100 * diagonal
    return float(length)


class Filter(Parameters):
    """A stage of a pipeline: a frozen, keyword-only dataclass that maps what it `consumes` to something new.

    Filters keep no state between calls and never change their input. They are joined with ``|``.

    Examples
    --------
    >>> from glsk_o3d import Connector, RingBuilder
    >>> RingBuilder.consumes, RingBuilder.produces, Connector.produces
    ('cloud', 'Contraction', 'Skeleton')
    """

    consumes: ClassVar[str] = "cloud"
    """What the filter takes: ``"cloud"``, ``"Contraction"`` or ``"Skeleton"``."""
    produces: ClassVar[str] = "Contraction"
    """What it gives. A cloud, which only a filter of clouds gives, carries no report: pipelines tell of its stage."""

    def __call__(self, data, *, on_iteration: OnIteration | None = None, on_state: OnState | None = None):
        """Run the filter.

        Parameters
        ----------
        data : cloud, Contraction or Skeleton
            See `consumes`. A cloud is anything `glsk_o3d.skeletonize` takes.
        on_iteration : callable, optional
            Called with each IterationRecord of a contraction; return False to stop there and keep what is done.
        on_state : callable, optional
            Called before it with the Contraction itself, as it is after each solve and the merges that follow.
        """
        from .skeleton import Skeleton
        from .state import Contraction

        self.check()
        flows = {"Contraction": Contraction, "Skeleton": Skeleton}
        wanted = flows.get(self.consumes)
        if not isinstance(data, wanted) if wanted else isinstance(data, tuple(flows.values())):
            raise StageError(
                f"{type(self).__name__} takes a {self.consumes}, not a {type(data).__name__}: "
                "the order is RingBuilder | Contractor | Connector | Refiner"
            )
        start = time.perf_counter()
        with following_open3d():
            result = self._ran(data, _watch(on_iteration, on_state))
            seconds = time.perf_counter() - start
            _log.debug("%s took %.3f s: %r", type(self).__name__, seconds, result)
        promised = flows.get(self.produces)
        if not isinstance(result, promised) if promised else isinstance(result, (*flows.values(), type(None))):
            raise StageError(f"{type(self).__name__} should give a {self.produces} and gave a {type(result).__name__}")
        if promised is None:
            try:
                cloud_points(result)
            except InvalidCloudError as error:
                raise InvalidCloudError(f"{type(self).__name__} gave no usable cloud: {error}") from error
            return result
        return dataclasses.replace(result, report=result.report.with_stage(self, seconds))

    def __or__(self, other: Filter | Pipeline) -> Pipeline:
        from .pipeline import Pipeline

        return Pipeline(self) | other

    def _run(self, data, watch):
        """The work itself; `watch` is None or wants the Contraction after each solve, and says False to stop."""
        raise NotImplementedError

    def _ran(self, data, watch):
        """What `_run` gives; where it fails and is not of this package, the error says whose it is."""
        try:
            return self._run(data, watch)
        except (GlskError, MemoryError, Warning):
            raise
        except Exception as error:
            cls = type(self)
            if cls.__module__.startswith(f"{__package__}."):
                raise
            raise StageError(f"{cls.__name__} of {cls.__module__} failed: {type(error).__name__}: {error}") from error


def _watch(on_iteration, on_state):
    """One callback for both, and for the log; None where nobody listens."""
    if on_iteration is None and on_state is None and not _log.isEnabledFor(logging.DEBUG):
        return None

    def watch(state):
        record = state.report.iterations[-1]
        _log.debug(
            "solve %d: %d points, %d merged, e %.4f, De %.4f, ring ratio %.4f, %.3f s",
            *(record.iteration, record.n_points, record.n_merged, record.explained, record.explained_change),
            *(record.ring_ratio, record.seconds),
        )
        if on_state is not None:
            on_state(state)
        return None if on_iteration is None else on_iteration(record)

    return watch
