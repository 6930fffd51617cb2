"""Splits a run into stages, from outside: what each takes of CPU and wall time, and the most memory during it."""

from __future__ import annotations

import functools
import pkgutil
import resource
import sys
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

PACKAGE = "glsk_o3d"
REST = "rest"  # what belongs to no stage
MB = 2**20


class Stage(NamedTuple):
    """Functions of the package that make a stage, and how it stands to others."""

    functions: str = ""
    """As ``module:name`` or ``module:class.name``, the module without the package, with blanks between them; several
    of one module as ``module:name,name``."""
    open: bool = False
    """Whether the stages inside count for themselves; else whatever happens inside is of this one."""
    after: tuple[str, str] | None = None
    """Instead of functions: (stage, inner) for what is left of an open stage once an inner one is done."""


@dataclass
class Share:
    """What a stage took."""

    calls: int = 0
    cpu: float = 0.0
    """Seconds, all threads, without the stages inside."""
    wall: float = 0.0
    """Seconds."""
    peak: int = 0
    """Bytes resident at most, all of the process; 0 if it was not measured."""


def find(stages: Mapping[str, Stage]) -> dict[str, list[tuple[object, str]]]:
    """Where the functions of the stages are: for each stage their owners, a module or class, and their names there.

    Raises
    ------
    LookupError
        The package has no such function any more: the table of stages is to be mended.
    """
    found: dict[str, list[tuple[object, str]]] = {}
    for stage, (functions, _, after) in stages.items():
        found[stage] = []
        if bool(functions) == bool(after) or not {*(after or ())} <= {*stages}:
            raise LookupError(f"stage {stage!r} needs functions, or two other stages that it comes after")
        for path in _paths(functions):
            module, _, name = path.partition(":")
            *outer, name = name.split(".")
            try:
                owner = pkgutil.resolve_name(":".join([f"{PACKAGE}.{module}", ".".join(outer)]))
                if not callable(vars(owner)[name]):
                    raise KeyError(name)
            except (ImportError, AttributeError, KeyError):
                raise LookupError(
                    f"stage {stage!r}: {PACKAGE} has no function {path} of its own any more; "
                    "say in the table of stages what does its work now"
                ) from None
            found[stage].append((owner, name))
    return found


def _paths(functions):
    """Of ``a:b,c d:e`` a:b, a:c and d:e."""
    places = (place.partition(":") for place in functions.split())
    return [f"{module}:{name}" for module, _, names in places for name in names.split(",")]


class Stopwatch:
    """Context in which the functions of the stages are timed; only calls in the thread that made it count.

    Parameters
    ----------
    stages : mapping of str to Stage
    memory : bool
        Also find the peak of each stage, where the system can (Linux). That costs time: not for runs that are timed.

    Attributes
    ----------
    shares : dict of str to Share
        For every stage, and for the rest.
    """

    def __init__(self, stages: Mapping[str, Stage], memory: bool = False):
        self.shares = {name: Share() for name in (*stages, REST)}
        self._found = find(stages)
        self._stages = {**stages, REST: Stage(open=True)}
        self._next = {stage.after: name for name, stage in stages.items() if stage.after}
        self._memory = memory and reset_peak()
        self._running: list[str] = []
        self._thread = threading.get_ident()

    def __enter__(self):
        originals = {id(vars(owner)[name]): (stage, owner, name) for stage, owner, name in self._every()}
        self._wrapped = {key: self._timed(stage, vars(owner)[name]) for key, (stage, owner, name) in originals.items()}
        for owner, name in _places(owner for _, owner, _ in originals.values()):
            if wrapper := self._wrapped.get(id(vars(owner)[name])):
                setattr(owner, name, wrapper)
        self._running, self._since = [REST], _clocks()
        return self

    def __exit__(self, *error):
        self._charge()
        self._running = []
        originals = {id(wrapper): wrapper.__wrapped__ for wrapper in self._wrapped.values()}
        # anew, since modules imported meanwhile have wrappers too
        for owner, name in _places(owner for _, owner, _ in self._every()):
            if original := originals.get(id(vars(owner)[name])):
                setattr(owner, name, original)

    @property
    def cpu(self) -> float:
        """CPU seconds of all stages and the rest."""
        return sum(share.cpu for share in self.shares.values())

    @property
    def wall(self) -> float:
        """Seconds of all stages and the rest."""
        return sum(share.wall for share in self.shares.values())

    def _every(self):
        return [(stage, owner, name) for stage, places in self._found.items() for owner, name in places]

    def _timed(self, stage, function):
        @functools.wraps(function)
        def wrapper(*args, **kwargs):
            running = self._running
            if threading.get_ident() != self._thread or not running or not self._stages[running[-1]].open:
                return function(*args, **kwargs)
            self._charge()
            running.append(stage)
            self.shares[stage].calls += 1
            try:
                return function(*args, **kwargs)
            finally:
                self._charge()
                running.pop()
                following = self._next.get((running[-1], stage))
                if following:
                    running[-1] = following
                    self.shares[following].calls += 1

        return wrapper

    def _charge(self):
        """Charge the running stage with what was spent since the last change."""
        share, now = self.shares[self._running[-1]], _clocks()
        share.cpu += now[0] - self._since[0]
        share.wall += now[1] - self._since[1]
        if self._memory:
            share.peak = max(share.peak, peak())
            reset_peak()
            now = _clocks()
        self._since = now


def _clocks():
    return time.process_time(), time.perf_counter()


def _places(owners):
    """Where functions may be known by a name: the modules of the package, and the owners."""
    modules = [module for name, module in sys.modules.items() if name.partition(".")[0] == PACKAGE]
    for owner in {id(owner): owner for owner in (*modules, *owners)}.values():
        yield from ((owner, name) for name in list(vars(owner)))


# -------------------------------------------------------------------------------------------------------------- memory

_STATUS, _RESET = Path("/proc/self/status"), Path("/proc/self/clear_refs")


def peak() -> int:
    """Most bytes that this process has had resident, since `reset_peak` where that works."""
    # On Linux not ru_maxrss: a process inherits that from the one that started it.
    return _status("VmHWM") or resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if _MAC else 1024)


def resident() -> int:
    """Bytes resident now; where the system does not say, the most so far."""
    return _status("VmRSS") or peak()


def reset_peak() -> bool:
    """Let `peak` begin anew; whether the system can."""
    try:
        _RESET.write_text("5")
    except OSError:
        return False
    return True


_MAC = sys.platform == "darwin"


def _status(key: str) -> int:
    if not _STATUS.exists():
        return 0
    return next((int(line.split()[1]) * 1024 for line in _STATUS.read_text().splitlines() if line.startswith(key)), 0)
