"""What a worker does: one cloud, from file to files."""

from __future__ import annotations

import logging
import math
import os
import socket
import threading
import time
import traceback
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import datetime, timezone
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..analysis.summary import summary
from ..errors import GlskError, InvalidCloudError
from ..io.scans import read_cloud
from ..io.skeletons import read_skeleton
from ..io.streaming import sample_for
from ..recipes import from_recipe
from ..report import Report
from ..skeleton import Skeleton
from ..viewing.preview import save_preview
from .grid import Grid, tile_of
from .joining import join_tiles
from .ledger import DONE, FAILED, Row, file_hash
from .loose_ends import Seams

TILE_ENDING = ".npz"
"""Of the skeletons of tiles: what they keep, they keep to the last bit."""
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Job:
    """All that a worker needs to know, as plain data.

    Attributes
    ----------
    name : str
    path : str
        The cloud.
    out_dir : str
        A folder; the sub-folders of the outputs are there.
    outputs : tuple of str
        From `out_dir`. The ending chooses what is written; ``.png`` is a preview.
    recipe : dict
    cut_loops : bool
    stale : tuple of str
        Outputs of an earlier batch, from `out_dir`, which are no longer true.
    foreign : tuple of str
        Outputs that were there before, and of which no ledger knows whose they are: replaced perhaps, never removed.
    source : str
        What the ledger calls the cloud: its path, and which of its points are meant if it is one of many in a file.
    where : str
        The points to take; empty for all.
    origin, input_hash : str
        The file of which `path` holds a part, and its hash; empty where it is that file.
    needs : tuple of str
        The jobs, by name, that come first: the tiles from whose skeletons, their only outputs, this one is joined.
    grid : Grid or None
        Of the tiles, for one of them and for what is joined.
    points, dropped : int
        Of what is joined from tiles: in all, and those that are in none.
    """

    name: str
    path: str
    out_dir: str
    outputs: tuple[str, ...]
    recipe: dict[str, Any]
    cut_loops: bool = False
    stale: tuple[str, ...] = ()
    foreign: tuple[str, ...] = ()
    source: str = ""
    where: str = ""
    origin: str = ""
    input_hash: str = ""
    needs: tuple[str, ...] = ()
    grid: Grid | None = None
    points: int = 0
    dropped: int = 0


def work(job: Job) -> Row:
    """Skeletonise a cloud and write the results; gives what the ledger is to say.

    Whatever goes wrong is in it: nothing is raised. ``kept`` is in it where the cloud is not there: then earlier
    results, if any, are its outputs.
    """
    start = time.perf_counter()
    row: Row = {"error": "", "outputs": [], "version": __version__}
    row["worker"] = f"{socket.gethostname()}, process {os.getpid()}"
    with _Heard() as heard:
        try:
            with suppress(OSError):  # what it is shows when it is read
                row["input_hash"] = job.input_hash or file_hash(job.path)
            _skeletonize(job, row, heard.messages)
            row["status"] = DONE
        except Exception as error:  # whatever it is, the other clouds are to be done
            row |= {"status": FAILED, "error": told(error).removeprefix(f"{job.path}: ")}
            if "points" not in row and not os.path.exists(job.path):  # a disk that is not mounted, say
                row |= {"kept": True, "outputs": [each for each in job.stale if Path(job.out_dir, each).is_file()]}
        clear(job, row["outputs"])
    messages = list(dict.fromkeys(heard.messages))
    row |= {"seconds": round(time.perf_counter() - start, 4), "warnings": len(messages), "messages": messages}
    finished = datetime.now(timezone.utc).isoformat(timespec="seconds")
    return {**row, "finished": finished}


def clear(job: Job, written: Iterable[str] = ()) -> None:
    """Remove what is there of earlier batches and of a job that broke off, but what was `written`; failures are logged.

    Only afterwards, since a cluster may do a job once more, and end while it does.
    """
    for path in sorted({*job.stale, *job.outputs}.difference(job.foreign, written)):
        try:
            Path(job.out_dir, path).unlink(missing_ok=True)
        except OSError as error:
            _log.warning("an old result could not be removed: %s", told(error))


def _skeletonize(job: Job, row: Row, messages: list[str]) -> None:
    row |= {"seams": None, "unmatched": None}
    if job.needs:
        skeleton, seams = _joined(job)
        row |= {"seams": seams.joined, "unmatched": seams.unmatched}
    elif job.grid is not None:
        skeleton = _of_tile(job)
    else:
        pipeline, where = from_recipe(job.recipe), job.where or None
        sample = sample_for(pipeline, job.path, where)  # of many points
        skeleton = pipeline(read_cloud(job.path, where=where) if sample is None else sample)
    messages += skeleton.report.warnings
    facts = summary(skeleton, 0.0).items()
    row |= {name: None if isinstance(value, float) and not math.isfinite(value) else value for name, value in facts}
    for output in job.outputs:
        save = partial(skeleton.save, cut_loops=job.cut_loops)
        if output.endswith(".png"):
            save = partial(save_preview, skeleton, title=os.path.basename(job.source or job.path))
        save(Path(job.out_dir, output))
        row["outputs"].append(output)


def _of_tile(job: Job) -> Skeleton:
    """The skeleton of a tile, without its points; one without vertices, if these are too few or no curve is in them."""
    cloud = read_cloud(job.path)
    none = np.empty((0, 3))
    try:
        skeleton = from_recipe(job.recipe)(cloud)
    except InvalidCloudError as error:
        report = Report(n_input=len(cloud.points)).with_warning(f"no skeleton in this tile: {error}")
        return Skeleton(none, np.empty((0, 2)), np.empty(0), np.empty(0), none, none, report)
    return replace(skeleton, points=none, normals=none, vertex_of_point=np.empty(0))


def _joined(job: Job) -> tuple[Skeleton, Seams]:
    """The skeleton of a scene, from those of its tiles."""
    assert job.grid is not None
    skeletons = {
        tile_of(name.rpartition("/")[2]): read_skeleton(Path(job.out_dir, f"{name}{TILE_ENDING}")) for name in job.needs
    }
    skeleton, seams = join_tiles(skeletons, job.grid)
    report = Report(n_input=job.points, n_dropped=job.dropped)
    none = [each.report.n_input for each in skeletons.values() if not len(each.vertices)]
    said = f"{len(none)} of {len(skeletons)} tiles have no skeleton, of {sum(none)} points: the ledger says why"
    for message in [said] * bool(none) + seams.messages(job.grid):
        report = report.with_warning(message)
    return replace(skeleton, report=report), seams


def told(error: BaseException) -> str:
    """An error in one line; of a mistake in the code also the place."""
    if isinstance(error, MemoryError):
        return f"out of memory {error}".strip()
    if isinstance(error, OSError) and error.strerror and error.filename is not None:
        return f"{error.filename}: {error.strerror}"
    if isinstance(error, GlskError | OSError):
        return " ".join(str(error).split()) or type(error).__name__
    place = traceback.extract_tb(error.__traceback__)
    where = f" ({os.path.basename(place[-1].filename)}, line {place[-1].lineno})" if place else ""
    return " ".join(f"{type(error).__name__}: {error}{where}".split())


class _Heard(logging.Handler):
    """Keeps the warnings that this thread logs; they would otherwise go to the stderr of the worker."""

    def __init__(self):
        super().__init__(logging.WARNING)
        self.messages: list[str] = []
        self._thread = threading.get_ident()

    def emit(self, record):
        if record.thread == self._thread:
            self.messages.append(record.getMessage())

    def __enter__(self):
        logging.getLogger("glsk_o3d").addHandler(self)
        return self

    def __exit__(self, *_):
        logging.getLogger("glsk_o3d").removeHandler(self)
