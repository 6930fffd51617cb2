"""What a worker does: one cloud, from file to files."""

import logging
import math
import os
import socket
import threading
import time
import traceback
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..analysis.summary import summary
from ..errors import GlskError, InvalidCloudError, in_words
from ..io.scans import read_cloud
from ..io.skeletons import read_skeleton, save_skeleton
from ..io.streaming import sample_for
from ..recipes import from_recipe
from ..report import Report
from ..skeleton import Skeleton
from ..viewing.preview import save_preview
from .grid import tile_of
from .joining import join_tiles
from .ledger import DONE, FAILED, Row, file_hash
from .splitting import Split

TILE_ENDING = ".npz"  # of the skeletons of tiles: it keeps all to the last bit
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Task:
    """A cloud of a batch, or a scene whose tiles are joined: all that a worker must know, and why it is to be done."""

    name: str  # of the results, without ending
    source: str  # what the ledger calls the cloud: its path, and which of its points are meant if not all
    path: str  # of the cloud
    outputs: tuple[str, ...] = ()  # from out_dir; the ending chooses what is written, and .png is a preview
    why: str = "new"  # as `Plan` lists them
    out_dir: str = ""
    recipe: dict[str, Any] = field(default_factory=dict)
    cut_loops: bool = False
    where: str = ""  # the points to take; empty for all
    stale: tuple[str, ...] = ()  # outputs of an earlier batch, which are no longer true
    foreign: tuple[str, ...] = ()  # outputs that no ledger knows: replaced perhaps, never removed
    origin: str = ""  # the file of which `path` holds a part
    needs: tuple[str, ...] = ()  # names of the tiles from whose skeletons, their only outputs, this one is joined
    split: Split | None = None  # how the scene was taken apart, but for the list of its parts


def work(task: Task) -> Row:
    """Skeletonise a cloud and write the results; gives what the ledger is to say, whatever goes wrong.

    Of what failed it also says in ``absent`` whether this machine lacks the cloud or the output folder.
    """
    start = time.perf_counter()
    row: Row = {"error": "", "outputs": [], "version": __version__}
    row["worker"] = f"{socket.gethostname()}, process {os.getpid()}"
    with _logged_warnings() as heard:
        try:
            with suppress(OSError):  # what it is shows when it is read
                row["input_hash"] = file_hash(task.path) if task.split is None else task.split.input_hash
            _skeletonize(task, row, heard)
            row["status"] = DONE
        except Exception as error:  # whatever it is, the other clouds are to be done
            row |= {"status": FAILED, "error": in_one_line(error).removeprefix(f"{task.path}: ")}
            row["absent"] = not (os.path.exists(task.path) and os.path.isdir(task.out_dir))
            if "points" not in row and not os.path.exists(task.path):  # on a disk that is not mounted, say
                row["outputs"] = [each for each in task.stale if Path(task.out_dir, each).is_file()]
        clear(task, row["outputs"])
    messages = list(dict.fromkeys(heard))
    row |= {"seconds": round(time.perf_counter() - start, 4), "warnings": len(messages), "messages": messages}
    return {**row, "finished": datetime.now(timezone.utc).isoformat(timespec="seconds")}


def clear(task: Task, written: Iterable[str] = ()) -> None:
    """Remove what is there of earlier batches and of a task that broke off, but what was `written`; log failures.

    Only afterwards, since a cluster may do a task once more, and end while it does.
    """
    for path in sorted({*task.stale, *task.outputs}.difference(task.foreign, written)):
        try:
            Path(task.out_dir, path).unlink(missing_ok=True)
        except OSError as error:
            _log.warning("an old result could not be removed: %s", in_one_line(error))


def _skeletonize(task: Task, row: Row, messages: list[str]) -> None:
    row |= {"seams": None, "unmatched": None}
    if task.needs:
        skeleton = _joined(task, row)
    elif task.split and task.split.grid:
        skeleton = _of_tile(task)
    else:
        pipeline, where = from_recipe(task.recipe), task.where or None
        sample = sample_for(pipeline, task.path, where)  # of many points
        skeleton = pipeline(read_cloud(task.path, where=where) if sample is None else sample)
    messages += skeleton.report.warnings
    facts = summary(skeleton, 0.0).items()
    row |= {name: None if isinstance(value, float) and not math.isfinite(value) else value for name, value in facts}
    for output in task.outputs:
        path = Path(task.out_dir, output)
        if output.endswith(".png"):
            save_preview(skeleton, path, title=os.path.basename(task.source))
        else:
            save_skeleton(skeleton, path, cut_loops=task.cut_loops)
        row["outputs"].append(output)


def _of_tile(task: Task) -> Skeleton:
    """The skeleton of a tile, without its points; one without vertices, if these are too few or no curve is in them."""
    cloud = read_cloud(task.path)
    none = np.empty((0, 3))
    try:
        skeleton = from_recipe(task.recipe)(cloud)
    except InvalidCloudError as error:
        report = Report(n_input=len(cloud.points)).with_warning(f"no skeleton in this tile: {error}")
        return Skeleton(none, np.empty((0, 2)), np.empty(0), np.empty(0), none, none, report)
    return replace(skeleton, points=none, normals=none, vertex_of_point=np.empty(0))


def _joined(task: Task, row: Row) -> Skeleton:
    """The skeleton of a scene, from those of its tiles; the row gets how they met."""
    split, files = task.split, [Path(task.out_dir, f"{name}{TILE_ENDING}") for name in task.needs]
    assert split is not None
    assert split.grid is not None
    skeletons = {tile_of(file.stem): read_skeleton(file) for file in files}
    skeleton, seams = join_tiles(skeletons, split.grid)
    row |= {"seams": seams.joined, "unmatched": seams.unmatched}
    report = Report(n_input=split.points, n_dropped=split.dropped)
    bare = [each.report.n_input for each in skeletons.values() if not len(each.vertices)]
    if bare:
        message = f"{len(bare)} of {len(files)} tiles have no skeleton, of {sum(bare)} points: the ledger says why"
        report = report.with_warning(message)
    for message in seams.messages(split.grid):
        report = report.with_warning(message)
    return replace(skeleton, report=report)


def in_one_line(error: BaseException) -> str:
    """An error in one line; of a mistake in the code also the place."""
    if isinstance(error, MemoryError):
        return f"out of memory {error}".strip()
    if isinstance(error, GlskError | OSError):
        return in_words(error)
    place = traceback.extract_tb(error.__traceback__)
    where = f" ({os.path.basename(place[-1].filename)}, line {place[-1].lineno})" if place else ""
    return " ".join(f"{type(error).__name__}: {error}{where}".split())


@contextmanager
def _logged_warnings() -> Iterator[list[str]]:
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
