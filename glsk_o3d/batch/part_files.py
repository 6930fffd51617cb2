"""Many clouds written side by side, a block at a time, as PLY."""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from ..errors import BatchError
from ..io.clouds.scanned import COLOR_CHANNELS, Scan
from ..io.formats import ply_rows

_COUNT_WIDTH = 20  # derived: digits of the largest 64-bit number: the header is written before the count is known


class PartFiles:
    """Files of points with their normals and colours, if the first block has them; coordinates keep all digits.

    Parameters
    ----------
    folder : Path
    only : container of str, optional
        Labels of the parts to write; by default all.
    """

    def __init__(self, folder: Path, only: Container[str] | None = None):
        self._folder, self._only = folder, only
        self._counts: dict[Path, int] = {}
        self._row: np.dtype | None = None

    def add(self, scan: Scan, rows: Mapping[str, np.ndarray]) -> None:
        """Append to each part, by its label, some of the points.

        Parameters
        ----------
        scan : Scan
        rows : mapping of str to (m,) int array

        Raises
        ------
        BatchError
            It cannot be written.
        """
        table = self._table(scan)
        with writing(self._folder):
            for label, chosen in rows.items():
                if self._only is None or label in self._only:
                    path = self._folder / f"{label}.ply"
                    with path.open("ab" if path in self._counts else "wb") as stream:
                        if path not in self._counts:
                            stream.write(self._header(0))
                        stream.write(table[chosen].tobytes())
                    self._counts[path] = self._counts.get(path, 0) + len(chosen)

    def close(self) -> None:
        """Put into every file how many points it has: before, it is an empty cloud with something behind it."""
        with writing(self._folder):
            for path, count in self._counts.items():
                with path.open("r+b") as stream:
                    stream.write(self._header(count))

    def _table(self, scan: Scan) -> np.ndarray:
        columns = {"<f8": dict(zip("xyz", scan.positions.T, strict=True)), "<f4": {}}
        for names, values in ((("nx", "ny", "nz"), scan.normals), (COLOR_CHANNELS, scan.colors)):
            if values is not None:
                columns["<f4"] |= dict(zip(names, values.T, strict=True))
        if self._row is None:
            self._row = np.dtype([(name, kind) for kind, named in columns.items() for name in named])
        table = np.zeros(len(scan), self._row)
        for name, values in (columns["<f8"] | columns["<f4"]).items():
            if name in (self._row.names or ()):
                table[name] = values
        return table

    def _header(self, count: int) -> bytes:
        assert self._row is not None
        return ply_rows.header(self._row, count, width=_COUNT_WIDTH)


@contextmanager
def writing(folder: Path) -> Iterator[None]:
    """Raise BatchError where parts of a scene cannot be written into a folder."""
    try:
        yield
    except OSError as error:
        raise BatchError(f"{folder}: the parts of a scene cannot be written there: {error.strerror}") from error
