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
from dataclasses import dataclass
from datetime import datetime, timezone
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

from .. import __version__
from ..analysis.summary import summary
from ..errors import GlskError
from ..io.clouds.scanned import Scan
from ..io.clouds.selection import select
from ..io.scans import read_cloud, read_scan
from ..io.streaming import sample_for
from ..pipeline import Pipeline
from ..recipes import from_recipe
from ..viewing.preview import save_preview
from .ledger import DONE, FAILED, Row, file_hash

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
                row["input_hash"] = file_hash(job.path)
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
    pipeline = from_recipe(job.recipe)
    skeleton = pipeline(_cloud(job, pipeline))
    messages += skeleton.report.warnings
    facts = summary(skeleton, 0.0).items()
    row |= {name: None if isinstance(value, float) and not math.isfinite(value) else value for name, value in facts}
    for output in job.outputs:
        save = partial(skeleton.save, cut_loops=job.cut_loops)
        if output.endswith(".png"):
            save = partial(save_preview, skeleton, title=os.path.basename(job.source or job.path))
        save(Path(job.out_dir, output))
        row["outputs"].append(output)


def _cloud(job: Job, pipeline: Pipeline[Any]) -> Any:
    """The points that are meant, or of many a sample; a smaller file that is taken apart is read once for all that
    follow each other.
    """
    sample = sample_for(pipeline, job.path, job.where or None)
    if sample is not None:
        return sample
    if not job.where:
        return read_cloud(job.path)
    state = os.stat(job.path)
    return select(_last_scan(job.path, (state.st_mtime_ns, state.st_size)), job.where).to_legacy()


@lru_cache(maxsize=1)
def _last_scan(path: str, state: tuple[int, int]) -> Scan:
    return read_scan(path)


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
