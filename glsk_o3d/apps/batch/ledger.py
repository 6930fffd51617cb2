"""The ledger of a batch: one line per input, which a later batch reads."""

import hashlib
import json
import logging
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ...errors import BatchError, InvalidParameterError
from ...interop.atomic import check_ends, write_atomically, writing

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

Row = dict[str, Any]
DONE, FAILED, STARTED = "done", "failed", "started"
LOCK_FILE = ".ledger.lock"
_log = logging.getLogger(__name__)


class Ledger:
    """The rows of an output folder, by name; in the folder they are ``ledger.jsonl``.

    While a batch runs, every row is a line that is added to the end, and the last of a name counts. A process that dies
    may leave half a line: it is passed over.
    """

    def __init__(self, folder: Path):
        self.path = folder / "ledger.jsonl"
        self.rows: dict[str, Row] = {}
        refuse_ways_out(folder, [self.path.name])
        check_ends(self.path)
        lines = self.path.read_bytes().splitlines() if self.path.exists() else []
        for number, line in enumerate(lines, 1):
            try:
                row = _checked(json.loads(line), folder)
            except (ValueError, KeyError, TypeError, RecursionError):
                _log.warning("%s, line %d: broken, passed over; its input is done anew", self.path, number)
            else:
                self.rows[row["name"]] = row

    def rewrite(self) -> None:
        """Write one line per input, in the order of the names, in the place of all that was there."""
        data = b"".join(_line(row) for _, row in sorted(self.rows.items()))
        write_atomically(self.path, lambda temporary: temporary.write_bytes(data))

    def add(self, row: Row) -> None:
        """Add a row, to the file at once; it replaces the one of its name."""
        self.rows[row["name"]] = row
        with writing(self.path), self.path.open("ab") as stream:
            stream.write(_line(row))


def _checked(row: Row, folder: Path) -> Row:
    """A row, if a batch has written it: its outputs may be removed, so they must be in the folder."""
    known = row["status"] in (DONE, FAILED, STARTED) and isinstance(row["input"], str)
    if not (known and isinstance(row["outputs"], list)):
        raise ValueError("no batch has written it")
    refuse_ways_out(folder, [row["name"], *row["outputs"]])
    return row


def refuse_ways_out(folder: Path, paths: Iterable[str]) -> None:
    """Raise InvalidParameterError where paths in an output folder lead out of it, by ``..`` or a link."""
    inside = Path(os.path.realpath(folder))  # Path.resolve raises where links go in a circle
    for path in paths:
        real = Path(os.path.realpath(folder / path))
        if inside not in real.parents:
            raise InvalidParameterError(
                f"{folder / path}: leads out of the output folder, to {real}: if it is a link, remove it, or give the "
                "results another folder"
            )


def _line(row: Row) -> bytes:
    return json.dumps(row).encode() + b"\n"


def file_hash(path: str | os.PathLike[str]) -> str:
    """SHA-256 of the bytes of a file, as ``sha256sum`` prints it; OSError for a pipe, which may never end."""
    if os.path.exists(path) and not os.path.isfile(path):
        raise OSError(f"{os.fspath(path)}: is no file")
    digest = hashlib.sha256()
    with open(path, "rb") as stream:  # hashlib.file_digest needs Python 3.11
        while chunk := stream.read(1 << 20):
            digest.update(chunk)
    return digest.hexdigest()


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Keep other batches out of an output folder: BatchError where another process has it.

    The lock is one of the operating system: it ends with the process that holds it, however that dies.
    """
    check_ends(folder / LOCK_FILE)
    with (folder / LOCK_FILE).open("a") as stream:
        try:
            if fcntl is not None:
                fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            message = f"{folder}: another batch writes there: wait until it is done, or give another folder"
            raise BatchError(message) from None
        except OSError as error:
            _log.warning("%s: this file system has no locks (%s): start no second batch there", folder, error.strerror)
        yield
