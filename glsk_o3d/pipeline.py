"""Filters, pipelines of filters joined with `|`, and what a run of one shares with its filters."""

from __future__ import annotations

import dataclasses
import logging
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from copy import deepcopy
from itertools import pairwise
from typing import Any, ClassVar, Generic, TypeAlias, TypeVar, get_args, get_origin

from .data.contraction import Contraction
from .data.points import Points
from .data.report import STOPPED_BY_CALLER, IterationRecord, Report, warn
from .data.skeleton import Skeleton, of_input
from .errors import GlskError, InvalidCloudError, InvalidParameterError, StageError, did_you_mean
from .interop.clouds import Cloud, cloud_points
from .parameters import UNWRITTEN, Parameters, is_own

OnIteration: TypeAlias = Callable[[IterationRecord], bool | None]
OnState: TypeAlias = Callable[[Contraction], object]
AnyFilter: TypeAlias = "Filter[Any, Any]"
In = TypeVar("In", contravariant=True)
Out = TypeVar("Out", covariant=True)
Next = TypeVar("Next")

FLOWS = (Cloud, Points, Contraction, Skeleton)
"""What runs between filters."""
ORDER = (
    "the order is Sampler | OutlierRemover | Denoiser | Thinner | RingBuilder | Contractor | Connector | Refiner | "
    "Tracer"
)
RECIPE_VERSION = 1
SOLVED = (
    "solve %(iteration)d: %(n_points)d points, %(n_merged)d merged, e %(explained).4f, De %(explained_change).4f, "
    "ring ratio %(ring_ratio).4f, %(seconds).3f s"
)

_log = logging.getLogger(__name__)


@dataclasses.dataclass
class RunContext:
    """What a run shares with its filters: the record of those that ran, progress, and cancelling."""

    report: Report = dataclasses.field(default_factory=Report)
    """Says of filters that they ran, and nothing else."""
    on_iteration: OnIteration | None = None
    on_state: OnState | None = None

    def after_solve(self, state: Contraction) -> bool:
        """Tell the listeners of the state after an iteration; False to stop there.

        The ``report.iterations`` of the state end with the record of that iteration.
        """
        record = state.report.iterations[-1]
        if _log.isEnabledFor(logging.DEBUG):
            _log.debug(SOLVED, dataclasses.asdict(record))
        if self.on_state is not None:
            self.on_state(deepcopy(state))  # what is done to it does not change the run
        answer = None if self.on_iteration is None else self.on_iteration(record)
        return answer is None or answer not in (False,)  # NumPy's False and 0 are equal to it

    def note(self, stage: AnyFilter, seconds: float, stopped: str | None = None) -> None:
        """Add a filter that ran to the record."""
        name, table, report = type(stage).__name__, stage.table(), self.report
        if stopped:
            table[UNWRITTEN] = stopped
        self.report = dataclasses.replace(
            report,
            stages=(*report.stages, repr(stage)),
            recipe=recipe_of(*report.recipe.get("pipeline", ()), table),
            seconds=report.seconds | {name: report.seconds.get(name, 0.0) + seconds},
        )

    def report_of(self, report: Report) -> Report:
        """A report of what was found, with the filters that ran."""
        ran = self.report
        return dataclasses.replace(report, stages=ran.stages, recipe=ran.recipe, seconds=ran.seconds)


class Filter(Parameters, Generic[In, Out]):
    """A stage of a pipeline: a frozen, keyword-only dataclass that maps what it `consumes` to something new.

    ``class Mine(Filter[Skeleton, Skeleton])`` says what it takes and gives. Filters keep no state between calls and
    never change their input. They are joined with ``|``.

    Examples
    --------
    >>> from glsk_o3d import Connector, RingBuilder
    >>> [flow.__name__ for flow in (RingBuilder.consumes, RingBuilder.produces, Connector.produces)]
    ['Points', 'Contraction', 'Skeleton']
    """

    kind: ClassVar[str] = "filter"
    consumes: ClassVar[type] = Cloud
    """What the filter takes: `Cloud`, `Points`, which may be a cloud too, `Contraction` or `Skeleton`."""
    produces: ClassVar[type] = Contraction
    """What it gives. A cloud, which only a filter of clouds gives, carries no report: pipelines tell of its stage."""

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        for base in cls.__dict__.get("__orig_bases__", ()):
            if get_origin(base) is Filter:
                cls.consumes, cls.produces = get_args(base)

    def __call__(
        self, data: object, *, on_iteration: OnIteration | None = None, on_state: OnState | None = None
    ) -> Out:
        """Run the filter, as a pipeline of it alone.

        Parameters
        ----------
        data : cloud, Points, Contraction or Skeleton
            See `consumes`. A cloud is anything `glsk_o3d.skeletonize` takes.
        on_iteration, on_state : callable, optional
            As of `Pipeline`.

        Returns
        -------
        cloud, Points, Contraction or Skeleton
            See `produces`.

        Raises
        ------
        InvalidParameterError
            A parameter is wrong.
        StageError
            `data` is not what the filter takes, or what it gives is not what it promises.
        """
        return Pipeline[In, Out](self)(data, on_iteration=on_iteration, on_state=on_state)

    @classmethod
    def takes_clouds(cls) -> bool:
        """Whether the filter takes a cloud; one of `Points` takes all its points, as by ``Sampler(size="all")``."""
        return cls.consumes in (Cloud, Points)

    def __or__(self, other: Filter[Out, Next] | Pipeline[Out, Next]) -> Pipeline[In, Next]:
        return Pipeline[In, Out](self) | other

    def run(self, data: In, context: RunContext) -> Out:
        """The work itself; one that iterates asks ``context.after_solve`` after each iteration whether to go on."""
        raise NotImplementedError


class Pipeline(Generic[In, Out]):
    """A sequence of filters. Called on a cloud, it passes the result of each filter to the next.

    Parameters
    ----------
    *stages : Filter
        At least one. ``RingBuilder() | Contractor() | ...`` is shorter.

    Examples
    --------
    >>> from glsk_o3d import RingBuilder, Contractor, Connector, Refiner
    >>> RingBuilder(k=12) | Contractor() | Connector(radius="3%")  # doctest: +ELLIPSIS
    RingBuilder(k=12, ...) | Contractor(...) | Connector(radius='3%', ...)
    """

    def __init__(self, *stages: AnyFilter) -> None:
        if not stages:
            raise InvalidParameterError("a pipeline needs at least one filter")
        for stage in stages:
            if not isinstance(stage, Filter):
                raise InvalidParameterError(f"{stage!r} is not a filter and cannot be part of a pipeline")
        for before, after in pairwise(stages):
            if before.produces != after.consumes and not (before.produces is Cloud and after.takes_clouds()):
                raise InvalidParameterError(
                    f"{type(after).__name__} takes a {_named(after.consumes)} but {type(before).__name__} gives a "
                    f"{_named(before.produces)}: {ORDER}"
                )
        self.stages = stages

    def __call__(
        self,
        cloud: object,
        *,
        on_iteration: OnIteration | None = None,
        on_state: OnState | None = None,
        on_stage: Callable[[AnyFilter], object] | None = None,
    ) -> Out:
        """Run all filters on a cloud.

        Parameters
        ----------
        cloud : cloud, or whatever the first filter consumes
        on_iteration : callable, optional
            Called with the IterationRecord of each solve; return False, or 0, to stop the contraction there.
        on_state : callable, optional
            Called before it with a copy of the Contraction after each solve.
        on_stage : callable, optional
            Called with each filter before it runs.

        Returns
        -------
        Skeleton, Contraction or cloud
            Whatever the last filter gives.
        """
        data: Any = cloud.whole if isinstance(cloud, Skeleton) else cloud
        report: Report = data.report if isinstance(data, FLOWS[1:]) else Report()
        context, known = RunContext(report, on_iteration, on_state), report.warnings
        for stage in self.stages:
            if on_stage is not None:
                on_stage(stage)
            start = time.perf_counter()
            data = _result(stage, data, context)
            seconds = time.perf_counter() - start
            _log.debug("%s took %.3f s: %r", type(stage).__name__, seconds, data)
            stopped = None
            if stage.produces is not Cloud:
                report = data.report
                if report.stop_reason == STOPPED_BY_CALLER:
                    stopped = f"the contraction was stopped by the caller after solve {len(report.iterations)}"
            context.note(stage, seconds, stopped)
        warn(message for message in report.warnings if message not in known)
        if isinstance(data, FLOWS[1:]):
            data = data.with_report(context.report_of(report))
        result: Any = of_input(data) if isinstance(data, Skeleton) else data
        return result

    def check_complete(self) -> None:
        """Raise InvalidParameterError unless the pipeline leads from a cloud to a skeleton."""
        if not self.stages[0].takes_clouds() or self.stages[-1].produces is not Skeleton:
            raise InvalidParameterError(f"{self!r} does not lead from a cloud to a skeleton")

    def with_options(self, options: Mapping[str, Any] | None = None, /, **named: Any) -> Pipeline[In, Out]:
        """This pipeline with other values of some parameters.

        Parameters
        ----------
        options : mapping of str to object, optional
            A value by ``"RingBuilder.k"``, or by ``"k"`` if only one part of the pipeline has that parameter. It is
            replaced wherever its filter occurs, also inside another filter. Reducers and stopping rules are replaced
            first, so the order does not matter.
        **named
            More of them.

        Returns
        -------
        Pipeline

        Raises
        ------
        InvalidParameterError
            A name is unknown, not in the pipeline or that of several parameters, an option is given twice, or a value
            is wrong.

        Examples
        --------
        >>> from glsk_o3d import pipelines
        >>> thin = pipelines.default().with_options({"Connector.radius": "2%"}, k=12, reducer=None)
        >>> thin.stages[4].k, thin.stages[5].reducer, thin.stages[6].radius
        (12, None, '2%')
        """
        pipeline: Pipeline[In, Out] = self
        names: dict[tuple[type[Parameters], str], str] = {}
        given = [*(options or {}).items(), *named.items()]
        # a reducer or a rule is put in, or taken out, before its parameters change
        for name, value in sorted(given, key=lambda option: (not callable(option[1]), option[1] is not None)):
            cls, field = pipeline.class_of_option(name)
            if (cls, field.name) in names:
                raise InvalidParameterError(f"{names[cls, field.name]} and {name} are the same option: give it once")
            names[cls, field.name] = name
            pipeline = _changed(pipeline, cls, field.name, value)
        return pipeline

    def class_of_option(self, name: str) -> tuple[type[Parameters], dataclasses.Field[Any]]:
        """The class in the pipeline and its field for the name of an option, such as ``"k"``.

        InvalidParameterError if there is none, or more than one.
        """
        if not isinstance(name, str):
            raise InvalidParameterError(f"{name!r}: the name of an option is a str")
        present = {type(part).__name__: type(part) for part in parts(self)}
        holder, dot, option = name.rpartition(".")
        if dot and holder not in present:
            raise InvalidParameterError(f"{name}: {holder} is not in the pipeline, which has {', '.join(present)}")
        classes: list[Any] = [present[holder]] if dot else [*present.values()]
        known = [(cls, field) for cls in classes for field in dataclasses.fields(cls)]
        meant = [(cls, field) for cls, field in known if field.name == option]
        if not meant:
            names = dict.fromkeys(field.name for _, field in known)
            raise InvalidParameterError(did_you_mean(option, names, f"parameter of {holder or 'the pipeline'}"))
        if len(meant) > 1:
            choice = " or ".join(f"'{cls.__name__}.{option}'" for cls, _ in meant)
            raise InvalidParameterError(f"{name}: more than one part of the pipeline has it: write {choice}")
        return meant[0]

    def __or__(self, other: Filter[Out, Next] | Pipeline[Out, Next]) -> Pipeline[In, Next]:
        return Pipeline(*self.stages, *(other.stages if isinstance(other, Pipeline) else (other,)))

    def __repr__(self) -> str:
        return " | ".join(map(repr, self.stages))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Pipeline) and self.stages == other.stages

    def __hash__(self) -> int:
        return hash(self.stages)


def parts(item: Pipeline[Any, Any] | Parameters) -> Iterator[Parameters]:
    """Everything with parameters in a pipeline: its filters, and after each the reducer and the rule inside."""
    if isinstance(item, Pipeline):
        inner: Iterable[Any] = item.stages
    else:
        yield item
        inner = (getattr(item, field.name) for field in dataclasses.fields(item))  # type: ignore[arg-type]
    for part in inner:
        if isinstance(part, Parameters):
            yield from parts(part)


def _changed(item: Any, cls: type[Parameters], name: str, value: Any) -> Any:
    """A pipeline, or a part of one, with a parameter replaced wherever its filter occurs, also inside another."""
    if isinstance(item, Pipeline):
        return Pipeline(*(_changed(stage, cls, name, value) for stage in item.stages))
    inner = {field.name: getattr(item, field.name) for field in dataclasses.fields(item)}
    changes = {key: _changed(part, cls, name, value) for key, part in inner.items() if isinstance(part, Parameters)}
    return dataclasses.replace(item, **(changes | {name: value} if type(item) is cls else changes))


def recipe_of(*tables: dict[str, Any]) -> dict[str, Any]:
    """The recipe of stages, each as `Parameters.table` makes it."""
    return {"glsk_o3d": {"version": RECIPE_VERSION}, "pipeline": list(tables)}


def _result(stage: AnyFilter, data: Any, context: RunContext) -> Any:
    """What a filter gives, if it takes the data and gives what it promises.

    Where a filter that is not of this package fails, the error says whose it is.
    """
    name = type(stage).__name__
    if not (_is_of(data, stage.consumes) or (_is_of(data, Cloud) and stage.takes_clouds())):
        raise StageError(f"{name} takes a {_named(stage.consumes)}, not a {type(data).__name__}: {ORDER}")
    if stage.consumes is Points and not isinstance(data, Points):
        data = Points.of(data)
    try:
        result = stage.run(data, context)
    except (GlskError, MemoryError, Warning):
        raise
    except Exception as error:
        if is_own(type(stage)):
            raise
        raise StageError(f"{name} of {stage.__module__} failed: {type(error).__name__}: {error}") from error
    if result is None or not _is_of(result, stage.produces):
        raise StageError(f"{name} should give a {_named(stage.produces)} and gave a {type(result).__name__}")
    if stage.produces is Cloud:
        try:
            cloud_points(result)
        except InvalidCloudError as error:
            raise InvalidCloudError(f"{name} gave no usable cloud: {error}") from error
    return result


def _is_of(data: Any, flow: type) -> bool:
    """Whether something is what a filter takes or gives; a cloud is anything else than what comes of one."""
    return not isinstance(data, FLOWS[1:]) if flow is Cloud else isinstance(data, flow)


def _named(flow: type) -> str:
    return "cloud" if flow is Cloud else flow.__name__
