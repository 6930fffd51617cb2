"""What a worker does: one cloud, from file to files."""

import logging
import math
import os
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import numpy as np

from ... import __version__
from ...analysis.forestry import measures_of_grown
from ...analysis.summary import summary
from ...data.report import Report
from ...data.skeleton import Skeleton
from ...data.verdict import Reason, Verdict
from ...errors import GlskError, InvalidCloudError, in_words
from ...io.scans import read_scan
from ...io.skeletons import read_skeleton, save_skeleton
from ...io.streaming import points_for
from ...recipes import from_recipe
from ...viewing.preview import save_preview
from .joining import join_tiles
from .ledger import DONE, FAILED, Row, file_hash
from .tiles import read_split, tile_of

TILE_ENDING = ".npz"  # of the skeletons of tiles: it keeps all to the last bit


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
    where: str | None = None  # the points to take
    accept: Verdict | None = None  # the worst verdict of a skeleton that is written
    is_tile: bool = False
    needs: tuple[str, ...] = ()  # names of the tiles that are joined; `path` then holds what is known of them


def work(task: Task) -> Row:
    """Skeletonise a cloud and write the results; gives what the ledger is to say, whatever goes wrong."""
    start = time.perf_counter()
    row: Row = {"status": DONE, "error": "", "worker": f"{socket.gethostname()}, process {os.getpid()}"}
    with _logged_warnings() as messages:
        try:
            with suppress(OSError):  # what it is shows when it is read
                row["input_hash"] = file_hash(task.path)
            _skeletonize(task, row, messages)
        except Exception as error:  # whatever it is, the other clouds are to be done
            row |= failure(in_one_line(error).removeprefix(f"{task.path}: "))
    messages = list(dict.fromkeys(messages))
    row |= {"seconds": round(time.perf_counter() - start, 4), "warnings": len(messages), "messages": messages}
    return {**row, "version": __version__, "finished": datetime.now(timezone.utc).isoformat(timespec="seconds")}


def failure(error: str) -> Row:
    """What the ledger is to say of a cloud that failed, and why."""
    return {"status": FAILED, "error": error, "version": __version__}


def _skeletonize(task: Task, row: Row, messages: list[str]) -> None:
    if task.needs:
        skeleton = _joined(task, row)
    elif task.is_tile:
        skeleton = _of_tile(task)
    else:
        pipeline = from_recipe(task.recipe)
        skeleton = pipeline(points_for(pipeline, task.path, task.where))
    messages += skeleton.report.warnings
    tree = measures_of_grown(skeleton)
    facts = ({} if tree is None else tree.sums()) | summary(skeleton, 0.0)  # traced is a number of points
    row |= {k: None if isinstance(value, float) and not math.isfinite(value) else value for k, value in facts.items()}
    if task.accept and not task.is_tile and skeleton.verdict < task.accept:
        why = "; ".join(reason.text for reason in skeleton.reasons)
        raise InvalidCloudError(f"the skeleton is not accepted: {skeleton.verdict.value}: {why}")
    for output in task.outputs:
        path = Path(task.out_dir, output)
        if output.endswith(".png"):
            save_preview(skeleton, path, title=os.path.basename(task.source))
        else:
            save_skeleton(skeleton, path, cut_loops=task.cut_loops)


def _of_tile(task: Task) -> Skeleton:
    """The skeleton of a tile, without its points; one without vertices, if these are too few or no curve is in them."""
    points = read_scan(task.path).positions
    none = np.empty((0, 3))
    try:
        skeleton: Skeleton = from_recipe(task.recipe)(points)
    except InvalidCloudError as error:
        report = Report(n_input=len(points)).with_reason("no edges", f"no skeleton in this tile: {error}")
        return Skeleton(none, np.empty((0, 2)), np.empty(0), np.empty(0), none, none, report)
    return replace(skeleton, points=none, normals=none, vertex_of_point=np.empty(0))


def _joined(task: Task, row: Row) -> Skeleton:
    """The skeleton of a scene, from those of its tiles; the row gets how they met."""
    split, files = read_split(Path(task.path)), [Path(task.out_dir, f"{name}{TILE_ENDING}") for name in task.needs]
    skeletons = {tile_of(file.stem): read_skeleton(file) for file in files}
    skeleton, seams = join_tiles(skeletons, split.grid)
    row |= {"seams": seams.joined, "unmatched": seams.unmatched}
    report = Report(n_input=split.points, n_dropped=split.dropped)
    bare = [tile.report.n_input for tile in skeletons.values() if not len(tile.vertices)]
    messages = seams.messages(split.grid)
    if bare:
        why = f"of {sum(bare)} points: the ledger says why"
        messages.insert(0, f"{len(bare)} of {len(files)} tiles have no skeleton, {why}")
    return replace(skeleton, report=replace(report, reasons=tuple(Reason("tiles", text) for text in messages)))


def in_one_line(error: BaseException) -> str:
    """An error in one line, with its name if it is none that users can mend."""
    words = in_words(error)
    return words if isinstance(error, GlskError | OSError) else f"{type(error).__name__}: {words}"


@contextmanager
def _logged_warnings() -> Iterator[list[str]]:
    """The warnings that the package logs; they would otherwise go to the stderr of the worker."""
    messages: list[str] = []
    logger, handler = logging.getLogger("glsk_o3d"), logging.Handler(logging.WARNING)
    handler.emit = lambda record: messages.append(record.getMessage())  # type: ignore[method-assign]
    logger.addHandler(handler)
    try:
        yield messages
    finally:
        logger.removeHandler(handler)
