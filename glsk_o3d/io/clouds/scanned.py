"""What a scan holds: points, and all that is known of each."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable
from dataclasses import dataclass, field
from keyword import iskeyword
from typing import Any

import numpy as np

from ...interop.packages import import_open3d

COLOR_CHANNELS = ["red", "green", "blue"]
NORMAL_NAMES = ["nx", "ny", "nz"]
NO_TRIANGLES = np.empty((0, 3), np.int64)
ALL_ROWS = sys.maxsize  # derived: more than any file has


class NoPoints(Exception):
    """A file is not damaged, but holds no points; why not."""


@dataclass(frozen=True, eq=False)
class Scan:
    """Points, (N, 3) arrays, and what a file says of each."""

    positions: np.ndarray
    colors: np.ndarray | None = None  # red, green and blue from 0 to 1
    normals: np.ndarray | None = None
    attributes: dict[str, np.ndarray] = field(default_factory=dict)  # all else; the names can stand in an expression
    triangles: np.ndarray = field(default_factory=lambda: NO_TRIANGLES)  # between the points, if it is a mesh
    unset: frozenset[str] = frozenset()  # attributes that nobody gave: they can be asked for, but are not told

    def __len__(self) -> int:
        return len(self.positions)

    def __getitem__(self, rows: np.ndarray) -> Scan:
        """Some of the points, without triangles."""
        return Scan(
            self.positions[rows],
            None if self.colors is None else self.colors[rows],
            None if self.normals is None else self.normals[rows],
            {name: values[rows] for name, values in self.attributes.items()},
            unset=self.unset,
        )

    @property
    def given(self) -> dict[str, np.ndarray]:
        """The attributes that are not unset."""
        return {name: values for name, values in self.attributes.items() if name not in self.unset}

    @property
    def columns(self) -> dict[str, np.ndarray]:
        """Everything that can be asked about a point, by name: the attributes, and ``x``, ``y`` and ``z``."""
        return {**dict(zip("xyz", self.positions.T, strict=True)), **self.attributes}

    @property
    def kinds(self) -> dict[str, np.dtype]:
        """As what Open3D's clouds have the given attributes: int32, since Open3D writes no int64, or floats."""
        found = {}
        for name, values in self.given.items():
            whole = values.dtype.kind in "iub" and np.abs(values.astype(float)).max(initial=0) < 2**31
            found[name] = np.dtype(np.int32 if whole else values.dtype if values.dtype == np.float32 else float)
        return found

    @property
    def shades(self) -> np.ndarray | None:
        """The colours from 0 to 255, (N, 3) uint8 array or None."""
        return None if self.colors is None else np.round(255 * np.clip(self.colors, 0, 1)).astype(np.uint8)

    def to_legacy(self) -> Any:
        """As an ``open3d.geometry.PointCloud``, which has no place for attributes."""
        o3d = import_open3d()
        cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(self.positions))
        for name in ("colors", "normals"):
            values = getattr(self, name)
            if values is not None:
                setattr(cloud, name, o3d.utility.Vector3dVector(np.ascontiguousarray(values, float)))
        return cloud

    def to_tensor(self) -> Any:
        """As an ``open3d.t.geometry.PointCloud`` with everything: integers as int32, since Open3D writes no int64."""
        o3d = import_open3d()
        cloud = o3d.t.geometry.PointCloud(o3d.core.Tensor(np.ascontiguousarray(self.positions, float)))
        if (shades := self.shades) is not None:
            cloud.point.colors = o3d.core.Tensor(shades)
        if self.normals is not None:
            cloud.point.normals = o3d.core.Tensor(np.ascontiguousarray(self.normals, float))
        for name, kind in self.kinds.items():
            cloud.point[name] = o3d.core.Tensor(np.ascontiguousarray(self.attributes[name][:, None], kind))
        return cloud


def attribute_name(text: str, taken: Iterable[str] = ()) -> str:
    """A name that can stand in an expression, and that nothing else has.

    Examples
    --------
    >>> attribute_name("Scalar field #2")
    'Scalar_field_2'
    >>> attribute_name("class")
    'class_'
    """
    name = re.sub(r"\W+", "_", text).strip("_") or "column"
    name = f"column_{name}" if name[0].isdigit() else f"{name}_" if iskeyword(name) else name
    taken, unique, n = {"x", "y", "z", "positions", "colors", "normals", *taken}, name, 2
    while unique in taken:
        unique, n = f"{name}_{n}", n + 1
    return unique


def named_attributes(columns: Iterable[tuple[str, np.ndarray]]) -> dict[str, np.ndarray]:
    """Columns by names that can stand in an expression, each its own."""
    found: dict[str, np.ndarray] = {}
    for name, values in columns:
        found[attribute_name(name, found)] = values
    return found


def brightest(values: np.ndarray) -> float:
    """The largest number among colours, at least 0; NaN is none."""
    return float(np.fmax.reduce(values, axis=None, initial=0))


def unit_colors(values: np.ndarray, top: float | None = None) -> np.ndarray:
    """Colours from 0 to 1, of numbers up to 255 or 65535, or up to 1 if they are no integers.

    `top` is the brightest of all, where these are only some.
    """
    top = brightest(values) if top is None else top
    scale = 1 if top <= 1 and values.dtype.kind == "f" else 255 if top <= 255 else 65535
    return np.asarray(values, float) / scale
