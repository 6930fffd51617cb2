"""Tables of arrays with a row per thing: to read, to iterate over, to write."""

import csv
import math
import os
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ..interop.atomic import write_atomically


class Rows:
    """Base of dataclasses whose fields are arrays with a row per thing.

    Iteration gives a dict of plain numbers and strings per row, the number of the row first; a point becomes three
    columns, whose names end in ``_x``, ``_y`` and ``_z``. Fields that are no arrays are no columns.
    """

    _row: ClassVar[str]

    def __init_subclass__(cls, row: str) -> None:
        super().__init_subclass__()
        cls._row = row

    def __len__(self) -> int:
        return len(next(iter(self._arrays().values())))

    def _arrays(self) -> dict[str, np.ndarray]:
        """The fields that are arrays."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}  # type: ignore[arg-type]
        return {name: value for name, value in values.items() if isinstance(value, np.ndarray)}

    def _columns(self) -> dict[str, list[Any]]:
        columns: dict[str, list[Any]] = {self._row: list(range(len(self)))}
        for name, array in self._arrays().items():
            names = [name] if array.ndim == 1 else [f"{name}_{axis}" for axis in "xyz"]
            columns |= zip(names, np.atleast_2d(array.T).tolist(), strict=True)
        return columns

    def __iter__(self) -> Iterator[dict[str, Any]]:
        columns = self._columns()
        for row in zip(*columns.values(), strict=True):
            yield dict(zip(columns, row, strict=True))

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write the table as CSV: a line of names, then a line per row. NaN and infinity are left empty.

        The file appears complete or not at all; an OSError says why it does not.
        """
        write_table(path, self._columns(), [list(row.values()) for row in self])


def write_table(path: str | os.PathLike[str], names: Iterable[str], rows: Iterable[Sequence[Any]]) -> None:
    """Write CSV, complete or not at all: a line of names, then a line per row. NaN and infinity are left empty."""
    cells = [["" if isinstance(v, float) and not math.isfinite(v) else v for v in row] for row in rows]

    def write(temporary: Path) -> None:
        with temporary.open("w", newline="", encoding="utf-8", errors="replace") as stream:
            csv.writer(stream, lineterminator="\n").writerows([names, *cells])

    write_atomically(path, write)
