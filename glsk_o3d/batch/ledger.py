"""The ledger of a batch: one line per input, which a later batch reads."""

import hashlib
import json
import logging
import os
import socket
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ..errors import BatchError, InvalidParameterError
from ..interop.atomic import write_atomically, write_csv, writing

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

Row = dict[str, Any]
DONE, FAILED, STALE = "done", "failed", "stale"  # the last: what is there is of something else, and to be done anew
LOCK_FILE = ".ledger.lock"
LEDGER_COLUMNS = (
    *("name", "input", "status", "error", "seconds", "points", "dropped", "sampled", "outliers"),
    *("distinct", "contracted", "vertices", "edges", "components", "loops", "leaves", "junctions", "length"),
    *("loops_closed", "cuts", "bridges", "uncertain", "seams", "unmatched"),
    *("iterations", "converged", "stop_reason", "warnings", "messages", "parameters", "input_hash"),
    *("outputs", "worker", "version", "finished"),
)
"""What a row tells."""
_log = logging.getLogger(__name__)


class Ledger:
    """The rows of an output folder, by name; in the folder they are ``ledger.jsonl``, and a table in ``ledger.csv``.

    While a batch runs, every row is a line that is added to the end. A process that dies may leave half a line: it is
    passed over, and gone when the ledger is next written whole.
    """

    def __init__(self, folder: Path):
        self.path, self.table = folder / "ledger.jsonl", folder / "ledger.csv"
        self.rows: dict[str, Row] = {}
        refuse_ways_out(folder, (self.path.name, self.table.name))
        lines = self.path.read_bytes().splitlines() if self.path.exists() else []
        rows = [row for line in lines if (row := _checked(line)) is not None]
        for row in rows:
            self._keep(row)
        self._sort()
        if len(rows) < len(lines):
            message = "%s: %d broken lines passed over; their inputs are done anew"
            _log.warning(message, self.path, len(lines) - len(rows))

    def _keep(self, row: Row) -> None:
        self.rows.pop(row["name"], None)  # the last comes last
        self.rows[row["name"]] = row

    def _sort(self) -> None:
        """Keep one row per input, in the order of the names."""
        last = {row["input"]: name for name, row in self.rows.items()}
        self.rows = {name: self.rows[name] for name in sorted(last.values())}

    def rewrite(self) -> None:
        """Write one line per input, in the place of all that was there."""
        self._sort()
        data = b"".join(map(_line, self.rows.values()))
        write_atomically(self.path, lambda temporary: temporary.write_bytes(data))

    def add(self, row: Row) -> None:
        """Add a row, to the file at once; it replaces the one of its name."""
        self._keep(row)
        with writing(self.path), self.path.open("ab") as stream:
            stream.write(_line(row))

    def close(self) -> None:
        """Write one line per input, and the table."""
        self.rewrite()
        cells = ([_cell(row.get(name)) for name in LEDGER_COLUMNS] for row in self.rows.values())
        write_csv(self.table, LEDGER_COLUMNS, cells)


def _checked(line: bytes) -> Row | None:
    """The row on a line, None if no batch has written it: its outputs may be removed, so they must be in the folder."""
    try:
        row = json.loads(line)
        known = row["status"] in (DONE, FAILED, STALE) and isinstance(row["input"], str)
        lists = isinstance(row["outputs"], list) and isinstance(row.get("messages", []), list)
        return row if known and lists and all(map(_is_inside, [row["name"], *row["outputs"]])) else None
    except (ValueError, KeyError, TypeError, RecursionError):
        return None


def _is_inside(path: Any) -> bool:
    """Whether a path is one below a folder, without a way out of it."""
    if not isinstance(path, str) or "\0" in path or os.path.isabs(path) or os.path.splitdrive(path)[0]:
        return False
    return not {"", ".", ".."} & set(path.replace(os.sep, "/").split("/"))


def refuse_ways_out(folder: Path, paths: Iterable[str]) -> None:
    """Raise InvalidParameterError where some paths in an output folder do not stay in it, or apart.

    A link leads out of it, or two of them to one file; or there is a pipe or a device.
    """
    inside, taken = os.path.join(os.path.realpath(folder), ""), {}
    for path in paths:
        real = os.path.realpath(folder / path)
        if taken.setdefault(real, path) != path:
            raise InvalidParameterError(f"{folder / path}: a link makes it the same file as {taken[real]}: remove it")
        if os.path.exists(real) and not (os.path.isfile(real) or os.path.isdir(real)):
            raise InvalidParameterError(f"{folder / path}: is a pipe or a device, not a file: remove it")
        if not real.startswith(inside):
            raise InvalidParameterError(
                f"{folder / path}: a link leads out of the output folder, to {real}: remove it, or give the results "
                "another folder"
            )


def _line(row: Row) -> bytes:
    try:
        return json.dumps(row, ensure_ascii=False).encode() + b"\n"
    except UnicodeEncodeError:  # a file name that is no Unicode
        return json.dumps(row).encode() + b"\n"


def _cell(value: Any) -> Any:
    text = "; ".join(map(str, value)) if isinstance(value, list) else value
    formula = isinstance(text, str) and text.startswith(("=", "+", "-", "@"))  # to a spreadsheet
    return f"'{text}" if formula else text


def file_hash(path: str | os.PathLike) -> str:
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
    with (folder / LOCK_FILE).open("a+", encoding="utf-8") as stream:
        try:
            if fcntl is not None:
                fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            stream.seek(0)
            raise BatchError(
                f"{folder}: another batch ({stream.read().strip()}) writes there: wait until it is done, or give "
                "another folder"
            ) from None
        except OSError as error:
            _log.warning("%s: this file system has no locks (%s): start no second batch there", folder, error.strerror)
        stream.truncate(0)
        stream.write(f"process {os.getpid()} on {socket.gethostname()}")
        stream.flush()
        yield
