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
        fields = {name: values[rows] for name in PER_POINT if (values := getattr(self, name)) is not None}
        return replace(self, **fields, attributes=attributes, triangles=triangles)

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
            column = f"{name}_" if iskeyword(name) else name
            if column not in columns:
                raise InvalidParameterError(did_you_mean(name, columns, "attribute of the points"))
            chosen &= compare(columns[column], value)
        return chosen

    @classmethod
    def of_mesh(cls, mesh: Any) -> Scan:
        """Of an ``open3d.geometry.TriangleMesh``."""
        colors = np.asarray(mesh.vertex_colors) if mesh.has_vertex_colors() else None
        normals = np.asarray(mesh.vertex_normals) if mesh.has_vertex_normals() else None
        return cls(np.asarray(mesh.vertices), colors, normals, triangles=np.asarray(mesh.triangles))

    def to_mesh(self) -> Any:
        """As an ``open3d.geometry.TriangleMesh``, without attributes."""
        o3d = import_open3d()
        corners = o3d.utility.Vector3iVector(self.triangles.astype(np.int32))
        return self._with_looks(o3d.geometry.TriangleMesh(_vectors(self.positions), corners), "vertex_")

    def to_legacy(self) -> Any:
        """As an ``open3d.geometry.PointCloud``, without attributes."""
        return self._with_looks(import_open3d().geometry.PointCloud(_vectors(self.positions)), "")

    def _with_looks(self, geometry: Any, prefix: str) -> Any:
        for name in ("colors", "normals"):
            if (values := getattr(self, name)) is not None:
                setattr(geometry, prefix + name, _vectors(values))
        return geometry

    def to_tensor(self) -> Any:
        """As an ``open3d.t.geometry.PointCloud`` with everything."""
        o3d = import_open3d()
        cloud = o3d.t.geometry.PointCloud(o3d.core.Tensor(np.ascontiguousarray(self.positions, float)))
        if self.colors is not None:
            cloud.point.colors = o3d.core.Tensor(color_bytes(self.colors))
        if self.normals is not None:
            cloud.point.normals = o3d.core.Tensor(np.ascontiguousarray(self.normals, float))
        for name, values in self.attributes.items():  # integers as int32 if they fit: Open3D writes no int64
            whole = values.dtype.kind in "iub" and np.abs(values.astype(float)).max(initial=0) < 2**31
            kind = values.dtype.type if values.dtype in (np.uint8, np.float32) else np.int32 if whole else float
            cloud.point[name] = o3d.core.Tensor(np.ascontiguousarray(values[:, None], kind))
        return cloud


def _vectors(rows: np.ndarray) -> Any:
    return import_open3d().utility.Vector3dVector(np.ascontiguousarray(rows, float))


def color_bytes(colors: np.ndarray) -> np.ndarray:
    """Colours from 0 to 1 as uint8 from 0 to 255."""
    return np.round(255 * np.clip(colors, 0, 1)).astype(np.uint8)


def parsed(where: str) -> list[tuple[str, Callable[[Any, Any], Any], Any]]:
    """The comparisons that a condition joins by ``and``: the name of an attribute, how it is compared, and with what
    number or, behind ``in``, numbers. InvalidParameterError if it is no condition.
    """
    comparisons = []
    for part in re.split(r"\band\b", where):
        try:
            name, sign, number, listed = re.fullmatch(_COMPARISON, part.strip()).groups()  # type: ignore[union-attr]
            value = float(number) if sign else [float(word) for word in listed.split(",") if word]
        except (AttributeError, ValueError):
            raise InvalidParameterError(
                f"where = {where[:200]!r}: {part.strip()[:80]!r} is not understood: compare attributes with numbers, "
                "such as 'classification in (2, 5) and z > 1.5'"
            ) from None
        comparisons.append((name, _SIGNS[sign or "in"], value))
    return comparisons


def scan_of(columns: Mapping[str, np.ndarray], top: float | None = None) -> Scan:
    """Points of columns, (N,) arrays by name: places, colours and normals by their names, all else are attributes, by
    names that can stand in an expression, such as ``class_``, ``Scalar_field`` and ``column_7``.

    Colours are numbers up to 255 or 65535, or up to 1 if they are no integers; `top` is the brightest in the file if
    these are only some of its points. Where they are all 0 they are none.
    """
    others = dict(columns)

    def taken(names: list[str]) -> np.ndarray | None:
        """Those columns side by side, if there are all."""
        return np.column_stack([others.pop(name) for name in names]) if set(names) <= others.keys() else None

    positions, colors, normals = map(taken, ([*"xyz"], COLOR_CHANNELS, NORMAL_NAMES))
    if positions is None:
        raise ValueError("it has no x, y and z")
    if colors is not None:
        top = brightest(colors) if top is None else top
        scale = 1 if top <= 1 and colors.dtype.kind == "f" else 255 if top <= 255 else 65535
        colors = colors / scale if top else None
    attributes: dict[str, np.ndarray] = {}
    for text, values in others.items():
        name = re.sub(r"\W+", "_", text).strip("_") or "column"
        name = f"column_{name}" if name[0].isdigit() else f"{name}_" if iskeyword(name) else name
        while name in {*"xyz", "positions", "colors", "normals", *attributes}:
            name += "_2"
        attributes[name] = values.astype(values.dtype.newbyteorder("="))
    positions = positions.astype(float, copy=False)
    normals = None if normals is None else normals.astype(float, copy=False)
    return Scan(positions, colors, normals, attributes, single=columns["x"].dtype.str[1:] == "f4")


def brightest(values: np.ndarray) -> float:
    """The largest number among colours, at least 0; NaN is none."""
    return float(np.fmax.reduce(values, axis=None, initial=0))
