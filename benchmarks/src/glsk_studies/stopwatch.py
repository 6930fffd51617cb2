"""Splits runs into stages, from outside: CPU and wall time of each, and memory; in turns, beside a yardstick."""

from __future__ import annotations

import functools
import pkgutil
import resource
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any, NamedTuple

from scipy.spatial import cKDTree

if TYPE_CHECKING:  # what is measured is not to import more than it needs
    import numpy as np

    from glsk_o3d import Skeleton

PACKAGE = "glsk_o3d"
REST = "rest"  # what belongs to no stage
MB = 2**20
NEIGHBOURS = 30  # of the yardstick
LEAST, MOST = 2.0, 50  # seconds that runs in turns go on for, however few were asked for, and turns at most
_MAC, _STATUS, _RESET = sys.platform == "darwin", Path("/proc/self/status"), Path("/proc/self/clear_refs")


class Stage(NamedTuple):
    """Functions of the package that make a stage, and how it stands to others."""

    functions: str = ""
    """As ``module:name`` or ``module:class.name``, the module without the package, with blanks between them; several
    of one module as ``module:name,name``."""
    open: bool = False
    """Whether the stages inside count for themselves; else whatever happens inside is of this one."""
    after: tuple[str, str] | None = None
    """Instead of functions: (stage, inner) for what is left of an open stage once an inner one is done."""


STAGES = {
    "order": Stage("geometry.morton:morton_order"),
    "kNN": Stage("geometry.neighbourhoods:nearest_neighbours,nearest_left"),
    "outliers, noise": Stage(
        "filters.outlier_remover:inliers data.points:noise_share filters.denoiser:average_noisy,subspace_mean_shift"
    ),
    "planes": Stage("geometry.neighbourhoods:principal"),
    "thinning": Stage("geometry.grid_sampling:sample_grid filters.thinner:thin,spacing_enough,thin_nearer"),
    "rings": Stage("geometry.rings:star_rings"),
    "rest of the rings": Stage(
        "filters.sampler:Sampler.run filters.outlier_remover:OutlierRemover.run filters.denoiser:Denoiser.run "
        "filters.thinner:Thinner.run filters.ring_builder:RingBuilder.run",
        open=True,
    ),
    "Laplacian": Stage("geometry.cotangent:cotangent_laplacian"),
    "lines": Stage("filters.contractor:explained_variance"),
    "normal matrix": Stage("geometry.solver:solve_contraction", open=True),
    "factorisation": Stage("geometry.solver:factorised"),
    "refinement of the solve": Stage(after=("normal matrix", "factorisation"), open=True),
    "LPR": Stage("filters.lpr_reducer:LPRReducer.run"),
    "rest of the contraction": Stage("filters.contractor:Contractor.run", open=True),
    "sampling": Stage("filters.connector:contraction_distance geometry.farthest_point:farthest_point_sampling"),
    "connection": Stage("filters.connector:Connector.run", open=True),
    "refinement of the graph": Stage("filters.refiner:Refiner.run"),
}
"""The stages in the order of the tables, and the functions that do their work: to be kept as the package is."""
SHARES = {
    "neighbours": (("order", "kNN"), "#1f4e9c"),
    "thinning": (("thinning",), "#5b8bd0"),
    "rings, rest": (("outliers, noise", "planes", "rings", "rest of the rings"), "#b3cdee"),
    "solves": (("normal matrix", "factorisation", "refinement of the solve"), "#d95f02"),
    "contraction, rest": (("Laplacian", "lines", "rest of the contraction"), "#fbb676"),
    "point reduction": (("LPR",), "#fde4c8"),
    "connection": (("sampling", "connection"), "#bbbbbb"),
    "refinement": (("refinement of the graph",), "#777777"),
    "rest": ((REST,), "#333333"),
}
"""The stages in groups that a picture can show, in the order of the work, and their colours: one for each filter."""


@dataclass
class Share:
    """What a stage took."""

    calls: int = 0
    cpu: float = 0.0  # seconds, all threads, without the stages inside
    peak: int = 0  # bytes resident at most, all of the process; 0 if it was not measured


def find(stages: Mapping[str, Stage]) -> list[tuple[str, object, str]]:
    """The functions of the stages: stage, owner, a module or class, and name there.

    A LookupError names what the package has no more: the table of stages is to be mended.
    """
    found = []
    for stage, (functions, _, _) in stages.items():
        places = (place.partition(":") for place in functions.split())
        for module, name in ((module, name) for module, _, names in places for name in names.split(",")):
            *outer, last = name.split(".")
            try:
                owner = pkgutil.resolve_name(":".join([f"{PACKAGE}.{module}", ".".join(outer)]))
                if not callable(vars(owner)[last]):
                    raise KeyError(last)
            except (ImportError, AttributeError, KeyError):
                raise LookupError(
                    f"stage {stage!r}: {PACKAGE} has no function {module}:{name} of its own any more; "
                    "say in the table of stages what does its work now"
                ) from None
            found.append((stage, owner, last))
    return found


class Stopwatch:
    """Context in which the functions of the stages are timed, in `shares`; only calls in the thread that made it count.

    With `memory` also the peak of each stage, where the system can (Linux). It costs time: not for runs that are timed.
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
        originals = {id(vars(owner)[name]): (stage, vars(owner)[name]) for stage, owner, name in self._found}
        self._wrapped = {key: self._timed(*each) for key, each in originals.items()}
        self._replace(self._wrapped)
        self._running, self._since, self.wall = [REST], _cpu(), -time.perf_counter()
        return self

    def __exit__(self, *error):
        self._charge()
        self.wall += time.perf_counter()
        self._running = []
        self._replace({id(wrapper): wrapper.__wrapped__ for wrapper in self._wrapped.values()})

    @property
    def cpu(self) -> float:
        """CPU seconds of all stages and the rest."""
        return sum(share.cpu for share in self.shares.values())

    def _replace(self, others):
        """Put others in the place of functions wherever they may be known by a name, also in modules imported since."""
        modules = [module for name, module in sys.modules.items() if name.partition(".")[0] == PACKAGE]
        for owner in {id(owner): owner for owner in (*modules, *(owner for _, owner, _ in self._found))}.values():
            for name in list(vars(owner)):
                if other := others.get(id(vars(owner)[name])):
                    setattr(owner, name, other)

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
        share, now = self.shares[self._running[-1]], _cpu()
        share.cpu += now - self._since
        if self._memory:
            share.peak = max(share.peak, peak())
            reset_peak()
            now = _cpu()
        self._since = now


def _cpu() -> float:
    return time.process_time()


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


def _status(key: str) -> int:
    lines = _STATUS.read_text().splitlines() if _STATUS.exists() else ()
    return next((int(line.split()[1]) * 1024 for line in lines if line.startswith(key)), 0)


def once(pipeline: Callable[[np.ndarray], Skeleton], points: np.ndarray) -> tuple[Skeleton, dict[str, float]]:
    """A skeleton, its CPU and wall seconds, and the most memory beyond what was resident before, in MB."""
    reset_peak()
    before = resident()
    with Stopwatch({}) as watch:
        skeleton = pipeline(points)
    return skeleton, dict(cpu=watch.cpu, wall=watch.wall, peak=(peak() - before) / MB)


def in_turns(tasks: dict, repeat: int, stages: Mapping[str, Stage] | None = None) -> dict[Any, tuple[Any, dict]]:
    """Run tasks one after the other, again and again, so that what disturbs the machine disturbs them all.

    That is `repeat` times at least, and for `LEAST` CPU seconds. Gives for each task its last result, and medians
    over the runs: ``cpu`` and ``wall`` seconds, and the CPU seconds of every stage in ``stages``.
    """
    watches, results = {name: [] for name in tasks}, {}
    end, turns = time.process_time() + LEAST, 0
    while turns < repeat or (turns < MOST and time.process_time() < end):
        for name, task in tasks.items():
            with Stopwatch(stages or {}) as watch:
                results[name] = task()
            watches[name].append(watch)
        turns += 1
    return {name: (results[name], medians(taken)) for name, taken in watches.items()}


def medians(taken: list[Stopwatch]) -> dict[str, Any]:
    """Of several runs: the seconds of the whole and of every stage, and how many runs there were."""
    whole = {clock: median(getattr(watch, clock) for watch in taken) for clock in ("cpu", "wall")}
    parts = {stage: dict(cpu=median(watch.shares[stage].cpu for watch in taken)) for stage in taken[0].shares}
    return dict(whole, runs=len(taken), stages=parts)


def yardstick(points) -> None:
    """1 kNN."""
    cKDTree(points).query(points, NEIGHBOURS)


def fresh_python(code: str, *words: str | Path) -> tuple[str, float]:
    """What code prints in a process of its own, and the seconds from the start of Python to its end.

    A RuntimeError has the last line of what it said, if it failed.
    """
    start = time.perf_counter()
    line = [sys.executable, "-W", "ignore", "-c", code, *map(str, words)]
    done = subprocess.run(line, capture_output=True, text=True)
    wall = time.perf_counter() - start
    if done.returncode:
        raise RuntimeError(done.stderr.strip().splitlines()[-1])
    return done.stdout, wall
