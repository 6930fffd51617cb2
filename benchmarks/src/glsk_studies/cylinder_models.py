"""Cylinder models of trees (QSM) that other people publish: those of TreeQSM, SimpleForest and aRchi."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import typer
from scipy.io import loadmat

from glsk_o3d.analysis.forestry import BREAST_HEIGHT
from glsk_o3d.geometry.vectors import norm

MATRIX_STRUCTS = ("OptQSM", "QSM")  # of TreeQSM's .mat, each with a struct called cylinder
# published: the columns of TreeQSM's text, which has one name for each three of them (TreeQSM's manual)
TEXT_COLUMNS = ("radius", "length", "start.x", "start.y", "start.z", "axis.x", "axis.y", "axis.z")
TEXT_COLUMNS += ("parent", "extension", "branch", "BranchOrder", "PositionInBranch")
UNIT_ERROR = 0.01  # precision: of the length of an axis; tables have three digits or more
STARTS, ENDS = ("startX", "startY", "startZ"), ("endX", "endY", "endZ")
PROGRAMS = {
    "TreeQSM": (("start.x", "start.y", "start.z"), ("axis.x", "axis.y", "axis.z"), "radius", "BranchOrder", 0),
    "SimpleForest": (STARTS, ENDS, "radius", "branchOrder", 0),
    "aRchi": (STARTS, ENDS, "radius_cyl", "branching_order", 1),
}
"""What the columns of a program are called: starts, ends or directions, radii, orders; and which order its stem has."""

Columns = dict[str, np.ndarray]


@dataclass(frozen=True)
class CylinderModel:
    """A tree as cylinders in metres: both ends (K, 3), radii (K,), and orders (K,), of which 0 is the stem."""

    start: np.ndarray
    end: np.ndarray
    radius: np.ndarray
    order: np.ndarray

    @property
    def volume(self) -> float:
        """Of all cylinders; where two overlap it counts twice, as in the programs that make them."""
        return float(np.pi * (self.radius**2 * norm(self.end - self.start)).sum())

    @property
    def length(self) -> float:
        """Of all cylinders."""
        return float(norm(self.end - self.start).sum())

    @property
    def height(self) -> float:
        """Of the highest end above the lowest."""
        return float(np.ptp([self.start[:, 2], self.end[:, 2]]))

    @property
    def stem_diameter(self) -> float:
        """Of the cylinder of the stem 1.3 m above the lowest end; NaN where there is none."""
        heights = np.array([self.start[:, 2], self.end[:, 2]])
        level = heights.min() + BREAST_HEIGHT
        at_level = (self.order == 0) & (heights.min(axis=0) <= level) & (level <= heights.max(axis=0))
        return float(2 * self.radius[at_level].mean()) if at_level.any() else float("nan")


def read_cylinder_model(path: Path, names: tuple[str, ...] = ()) -> CylinderModel:
    """The cylinders of a ``.mat`` of TreeQSM, or of text with the columns of one of `PROGRAMS`.

    A ``.mat`` has the struct ``cylinder``, by itself or in `MATRIX_STRUCTS`; of several models the first counts. Text
    without a line of names has the columns `names`, by default those that TreeQSM writes.
    """
    columns = matrix_columns(path) if path.suffix == ".mat" else text_columns(path, names)
    for starts, ends, radius, order, stem in PROGRAMS.values():
        if {*starts, *ends, radius, order, "length"} <= columns.keys():
            start, end = (np.stack([columns[name] for name in names], axis=1) for names in (starts, ends))
            end = end if ends == ENDS else start + end * columns["length"][:, None]
            return CylinderModel(start, end, columns[radius], columns[order].astype(int) - stem)
    raise typer.BadParameter(f"{path}: no columns of {', '.join(PROGRAMS)}; there are {', '.join(columns)}")


def text_columns(path: Path, given: tuple[str, ...] = ()) -> Columns:
    """Columns by their names; commas, semicolons, tabs or spaces are between them, and `#` begins a comment."""
    lines = path.read_text(encoding="utf-8-sig").replace('"', "").splitlines()
    first, *rest = [line for line in lines if line.strip() and not line.lstrip().startswith("#")] or [""]
    between = next((mark for mark in (",", ";", "\t") if mark in first), None)
    names = [name.strip() for name in first.split(between)]
    is_headed = not all(map(is_number, names))
    try:
        rows = np.genfromtxt(rest if is_headed else [first, *rest], delimiter=between, ndmin=2)
        if not is_headed:
            names = list(given or TEXT_COLUMNS)
            if not given and not is_text_of_treeqsm(rows):
                raise ValueError("it has no line of names, and is none of TreeQSM: give --columns, such as startX,...")
            rows = rows[:, : len(names)]
        elif "start_point" in names:
            names, rows = list(TEXT_COLUMNS), rows[:, : len(TEXT_COLUMNS)]
        # R writes the numbers of rows, and no name above them
        return dict(zip(names, rows.T[rows.shape[1] - len(names) :], strict=True))
    except ValueError as error:
        raise typer.BadParameter(f"{path}: no table with a name above each column: {error}") from None


def is_number(word: str) -> bool:
    """Whether a word of a table is a number."""
    try:
        float(word)
    except ValueError:
        return False
    return True


def is_text_of_treeqsm(rows: np.ndarray) -> bool:
    """Whether rows have the columns of TreeQSM: the axes have unit length, and each order is a whole number."""
    axis, order = (TEXT_COLUMNS.index(name) for name in ("axis.x", "BranchOrder"))
    if rows.shape[1] < len(TEXT_COLUMNS):
        return False
    is_unit = np.abs(norm(rows[:, axis : axis + 3]) - 1) < UNIT_ERROR
    return bool(is_unit.all() and (rows[:, order] == rows[:, order].astype(int)).all())


def matrix_columns(path: Path) -> Columns:
    """Fields of the struct ``cylinder``; one of three columns becomes ``name.x``, ``name.y`` and ``name.z``."""
    found = loadmat(path, squeeze_me=True, struct_as_record=False)
    holder = next((np.atleast_1d(found[name])[0] for name in MATRIX_STRUCTS if name in found), None)
    cylinder = found.get("cylinder") if holder is None else holder.cylinder
    if cylinder is None:
        raise typer.BadParameter(f"{path}: has no struct called cylinder, {' or '.join(MATRIX_STRUCTS)}")
    columns: Columns = {}
    for name in cylinder._fieldnames:
        field = np.atleast_1d(getattr(cylinder, name)).astype(float)
        if field.ndim == 2 and field.shape[1] == 3:
            columns |= {f"{name}.{axis}": column for axis, column in zip("xyz", field.T, strict=True)}
        elif field.ndim == 1:
            columns[name] = field
    return columns
