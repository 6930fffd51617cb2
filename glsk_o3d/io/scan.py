"""What a scan holds, points and what a file says of each; and which of them: ``classification == 5 and z > 2``."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from keyword import iskeyword
from typing import Any

import numpy as np

from ..data.points import on_surface
from ..data.report import warn
from ..errors import InvalidParameterError, did_you_mean
from ..filters.sampler import Sampler
from ..interop.packages import import_open3d

COLOR_CHANNELS = ["red", "green", "blue"]
NORMAL_NAMES = ["nx", "ny", "nz"]
PER_POINT = ("positions", "colors", "normals")
NO_TRIANGLES = np.empty((0, 3), np.int64)
ALL_ROWS = sys.maxsize  # derived: more than any file has
_SIGNS: dict[str, Callable[[Any, Any], Any]] = {
    **{"==": np.equal, "!=": np.not_equal, "<=": np.less_equal, ">=": np.greater_equal},
    **{"<": np.less, ">": np.greater, "in": np.isin},
}
_COMPARISON = r"(\w+)\s*(?:([=!<>]=|[<>])\s*(.+)|\bin\b\s*[([](.*)[)\]])"


class NoPoints(Exception):
    """A file is not damaged, but holds no points; why not."""


@dataclass(frozen=True, eq=False)
class Scan:
    """Points, (N, 3) arrays, and what a file says of each."""

    positions: np.ndarray
    colors: np.ndarray | None = None  # red, green and blue from 0 to 1
    normals: np.ndarray | None = None
    attributes: Mapping[str, np.ndarray] = field(default_factory=dict)  # all else; names can stand in an expression
    triangles: np.ndarray = field(default_factory=lambda: NO_TRIANGLES)  # between the points, if it is a mesh
    single: bool = False  # the file has its places as float32

    def __len__(self) -> int:
        return len(self.positions)

    def __getitem__(self, rows: np.ndarray) -> Scan:
        """Some of the points, and the triangles between them if `rows` are a bool array."""
        triangles = NO_TRIANGLES
        if len(self.triangles) and rows.dtype == bool:
            triangles = (np.cumsum(rows) - 1)[self.triangles[rows[self.triangles].all(axis=1)]]
        attributes = {name: values[rows] for name, values in self.attributes.items()}
        known = {name: values[rows] for name in PER_POINT if (values := getattr(self, name)) is not None}
        return replace(self, **known, attributes=attributes, triangles=triangles)

    def by_area(self, sample: Any = "auto") -> Scan:
        """The points that stand for a mesh, see `Sampler.sample`, with normals, and all else as a corner has it."""
        places, corners, normals, _ = on_surface((self.positions, self.triangles), Sampler(sample=sample).sample)
        if isinstance(sample, int) and not len(places):
            warn([f"sample = {sample}: the file has no triangles with an area: its points are taken"])
        return replace(self[corners[:, 0]], positions=places, normals=normals) if len(places) else self

    def chosen(self, where: str) -> np.ndarray:
        """For which points a condition holds, (N,) bool array; InvalidParameterError if it is none, or names what the
        points do not have.
        """
        columns = {**dict(zip("xyz", self.positions.T, strict=True)), **self.attributes}
        chosen = np.ones(len(self), bool)
        for name, compare, value in parsed(where):
            known = f"{name}_" if iskeyword(name) else name
            if known not in columns:
                raise InvalidParameterError(did_you_mean(name, columns, "attribute of the points"))
            chosen &= compare(columns[known], value)
        return chosen

    @property
    def shades(self) -> np.ndarray | None:
        """The colours from 0 to 255, (N, 3) uint8 array or None."""
        return None if self.colors is None else np.round(255 * np.clip(self.colors, 0, 1)).astype(np.uint8)

    def to_legacy(self) -> Any:
        """As an ``open3d.geometry.PointCloud``, which has no place for attributes."""
        vectors = import_open3d().utility.Vector3dVector
        cloud = import_open3d().geometry.PointCloud(vectors(self.positions))
        for name in ("colors", "normals"):
            values = getattr(self, name)
            if values is not None:
                setattr(cloud, name, vectors(np.ascontiguousarray(values, float)))
        return cloud

    def to_tensor(self) -> Any:
        """As an ``open3d.t.geometry.PointCloud`` with everything."""
        o3d = import_open3d()
        cloud = o3d.t.geometry.PointCloud(o3d.core.Tensor(np.ascontiguousarray(self.positions, float)))
        if (shades := self.shades) is not None:
            cloud.point.colors = o3d.core.Tensor(shades)
        if self.normals is not None:
            cloud.point.normals = o3d.core.Tensor(np.ascontiguousarray(self.normals, float))
        for name, values in self.attributes.items():  # integers as int32 if they fit: Open3D writes no int64
            whole = values.dtype.kind in "iub" and np.abs(values.astype(float)).max(initial=0) < 2**31
            kind = values.dtype.type if values.dtype in (np.uint8, np.float32) else np.int32 if whole else float
            cloud.point[name] = o3d.core.Tensor(np.ascontiguousarray(values[:, None], kind))
        return cloud


def parsed(where: str) -> list[tuple[str, Callable[[Any, Any], Any], Any]]:
    """The comparisons that a condition joins by ``and``: the name of an attribute, how it is compared, and with what
    number or, behind ``in``, numbers. InvalidParameterError if it is no condition.
    """
    found = []
    for part in re.split(r"\band\b", where):
        try:
            name, sign, number, listed = re.fullmatch(_COMPARISON, part.strip()).groups()  # type: ignore[union-attr]
            value = float(number) if sign else [float(word) for word in listed.split(",") if word]
        except (AttributeError, ValueError):
            raise InvalidParameterError(
                f"where = {where[:200]!r}: {part.strip()[:80]!r} is not understood: compare attributes with numbers, "
                "such as 'classification in (2, 5) and z > 1.5'"
            ) from None
        found.append((name, _SIGNS[sign or "in"], value))
    return found


def scan_of(columns: Mapping[str, np.ndarray], top: float | None = None) -> Scan:
    """Points of columns, (N,) arrays by name: places, colours and normals by their names, all else are attributes, by
    names that can stand in an expression, such as ``class_``, ``Scalar_field`` and ``column_7``.

    Colours are numbers up to 255 or 65535, or up to 1 if they are no integers; `top` is the brightest in the file if
    these are only some of its points. Where they are all 0 they are none.
    """
    left = dict(columns)

    def together(names: list[str]) -> np.ndarray | None:
        if not set(names) <= left.keys():
            return None
        return np.column_stack([left.pop(name) for name in names])

    positions, colors, normals = (together(names) for names in ([*"xyz"], COLOR_CHANNELS, NORMAL_NAMES))
    if positions is None:
        raise ValueError("it has no x, y and z")
    if colors is not None:
        top = brightest(colors) if top is None else top
        scale = 1 if top <= 1 and colors.dtype.kind == "f" else 255 if top <= 255 else 65535
        colors = colors / scale if top else None
    attributes: dict[str, np.ndarray] = {}
    for text, values in left.items():
        name = re.sub(r"\W+", "_", text).strip("_") or "column"
        name = f"column_{name}" if name[0].isdigit() else f"{name}_" if iskeyword(name) else name
        while name in {*"xyz", "positions", "colors", "normals", *attributes}:
            name += "_2"
        attributes[name] = values.astype(values.dtype.newbyteorder("="))
    return Scan(
        np.ascontiguousarray(positions, float),
        colors,
        None if normals is None else np.ascontiguousarray(normals, float),
        attributes,
        single=columns["x"].dtype.str[1:] == "f4",
    )


def brightest(values: np.ndarray) -> float:
    """The largest number among colours, at least 0; NaN is none."""
    return float(np.fmax.reduce(values, axis=None, initial=0))
