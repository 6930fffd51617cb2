"""Which point represents which."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..geometry.vectors import Ints


@dataclass(frozen=True, eq=False)
class PointMap:
    """Which row of a cloud each input point belongs to, and which of the surviving rows represents each row.

    Attributes
    ----------
    row_of_point : (N,) int array
        Of each input point; -1 if it is not finite.
    outlier, sampled : (N,) bool array
        Outliers, which belong to the nearest row; and points that determine the surface: no outliers, one of copies,
        and only the sample of a large cloud.
    survivors : (n,) int array
        Remaining rows, ascending; all until the cloud is thinned.
    survivor_of_row : (m,) int array
        The survivor (0 .. n-1) that each row was merged into; itself for a survivor.

    Examples
    --------
    >>> once = PointMap.of_rows(np.array([0, 1, 1, 2]), np.array([True, True, False, True]), 3)
    >>> merged = once.merge(np.array([0, 0, 2]))
    >>> merged.survivors, merged.survivor_of_point
    (array([0, 2]), array([0, 0, 0, 1]))
    """

    row_of_point: np.ndarray
    outlier: np.ndarray
    sampled: np.ndarray
    survivors: Ints
    survivor_of_row: np.ndarray

    @classmethod
    def of_rows(cls, row_of_point: np.ndarray, sampled: np.ndarray, m: int) -> PointMap:
        """That of m rows, all of which survive, without outliers."""
        rows = np.arange(m)
        return cls(row_of_point, np.zeros(len(row_of_point), bool), sampled, rows, rows)

    def merge(self, into: np.ndarray) -> PointMap:
        """The same with survivors merged `into` others (n,); one that stays is its own."""
        stays = into == np.arange(len(into))
        survivor = (np.cumsum(stays) - 1)[into]
        return replace(self, survivors=self.survivors[stays], survivor_of_row=survivor[self.survivor_of_row])

    def moved(self, row: np.ndarray, m: int) -> PointMap:
        """The same with m rows, all of which survive, in place of the old ones: `row` is the new one of each."""
        rows = np.arange(m)
        return replace(self, row_of_point=self.to_points(row), survivors=rows, survivor_of_row=rows)

    def set_aside(self, rows: np.ndarray) -> PointMap:
        """The same with the points of some rows, (m,) bool array, as outliers."""
        aside = self.to_points(rows) > 0
        return replace(self, outlier=self.outlier | aside, sampled=self.sampled & ~aside)

    def to_points(self, of_rows: np.ndarray, missing: int = -1) -> np.ndarray:
        """Ints (m,) of the rows for every input point, (N,) int array; `missing` for points without a row."""
        return np.append(of_rows, missing)[self.row_of_point]

    @property
    def survivor_of_point(self) -> np.ndarray:
        """The survivor that represents every input point, (N,) int array; -1 for points without a row."""
        return self.to_points(self.survivor_of_row)

    @property
    def point_of_row(self) -> np.ndarray:
        """The first input point that every row is, (m,) int array."""
        points = np.flatnonzero(self.sampled)[::-1]  # of several writes the last one stays
        first = np.empty(len(self.survivor_of_row), int)
        first[self.row_of_point[points]] = points
        return first

    @property
    def point_of_survivor(self) -> np.ndarray:
        """The first input point that every survivor is, (n,) int array."""
        return self.point_of_row[self.survivors]
