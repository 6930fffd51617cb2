"""What a worker does: one cloud, from file to files."""

from __future__ import annotations

import logging
import math
import os
import socket
import threading
import time
import traceback
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from datetime import datetime, timezone
from pathlib import Path

import numpy as np

from .. import __version__
from ..analysis.summary import summary
from ..errors import GlskError, InvalidCloudError
from ..io.scans import read_cloud
from ..io.skeletons import read_skeleton, save_skeleton
from ..io.streaming import sample_for
from ..recipes import from_recipe
from ..report import Report
from ..skeleton import Skeleton
from ..viewing.preview import save_preview
from .grid import Grid, tile_of
from .jobs import TILE_ENDING, Job
from .joining import join_tiles
from .ledger import DONE, FAILED, Row, file_hash

_log = logging.getLogger(__name__)


def work(job: Job) -> Row:
    """Skeletonise a cloud and write the results; gives what the ledger is to say.

    Whatever goes wrong is in it: nothing is raised. ``kept`` is in it where the cloud is not there: then earlier
    results, if any, are its outputs.
    """
    start = time.perf_counter()
    row: Row = {"error": "", "outputs": [], "version": __version__}
    row["worker"] = f"{socket.gethostname()}, process {os.getpid()}"
    with _heard() as heard:
        try:
            with suppress(OSError):  # what it is shows when it is read
                row["input_hash"] = file_hash(job.path) if job.split is None else job.split.input_hash
            _skeletonize(job, row, heard)
            row["status"] = DONE
        except Exception as error:  # whatever it is, the other clouds are to be done
            row |= {"status": FAILED, "error": told(error).removeprefix(f"{job.path}: ")}
            if "points" not in row and not os.path.exists(job.path):  # a disk that is not mounted, say
                row |= {"kept": True, "outputs": [each for each in job.stale if Path(job.out_dir, each).is_file()]}
        clear(job, row["outputs"])
    messages = list(dict.fromkeys(heard))
    row |= {"seconds": round(time.perf_counter() - start, 4), "warnings": len(messages), "messages": messages}
    return {**row, "finished": datetime.now(timezone.utc).isoformat(timespec="seconds")}


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
    grid = job.split and job.split.grid
    if job.needs:
        skeleton = _joined(job, row)
    elif grid:
        skeleton = _of_tile(job)
    else:
        pipeline, where = from_recipe(job.recipe), job.where or None
        sample = sample_for(pipeline, job.path, where)  # of many points
        skeleton = pipeline(read_cloud(job.path, where=where) if sample is None else sample)
    messages += skeleton.report.warnings
    facts = summary(skeleton, 0.0).items()
    row |= {name: None if isinstance(value, float) and not math.isfinite(value) else value for name, value in facts}
    for output in job.outputs:
        path = Path(job.out_dir, output)
        if output.endswith(".png"):
            save_preview(skeleton, path, title=os.path.basename(job.source))
        else:
            save_skeleton(skeleton, path, cut_loops=job.cut_loops)
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


def _joined(job: Job, row: Row) -> Skeleton:
    """The skeleton of a scene, from those of its tiles; the row is told how they met."""
    assert job.split is not None
    assert job.split.grid is not None
    grid: Grid = job.split.grid
    skeletons = {
        tile_of(name.rpartition("/")[2]): read_skeleton(Path(job.out_dir, f"{name}{TILE_ENDING}")) for name in job.needs
    }
    skeleton, seams = join_tiles(skeletons, grid)
    row |= {"seams": seams.joined, "unmatched": seams.unmatched}
    report = Report(n_input=job.split.points, n_dropped=job.split.dropped)
    none = [each.report.n_input for each in skeletons.values() if not len(each.vertices)]
    said = f"{len(none)} of {len(skeletons)} tiles have no skeleton, of {sum(none)} points: the ledger says why"
    for message in [said] * bool(none) + seams.messages(grid):
        report = report.with_warning(message)
    return replace(skeleton, report=report)


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


@contextmanager
def _heard() -> Iterator[list[str]]:
    """The warnings that this thread logs; they would otherwise go to the stderr of the worker."""
    messages: list[str] = []
    thread, logger, handler = threading.get_ident(), logging.getLogger("glsk_o3d"), logging.Handler(logging.WARNING)
    handler.addFilter(lambda record: record.thread == thread)
    handler.emit = lambda record: messages.append(record.getMessage())  # type: ignore[method-assign]
    logger.addHandler(handler)
    try:
        yield messages
    finally:
        logger.removeHandler(handler)
