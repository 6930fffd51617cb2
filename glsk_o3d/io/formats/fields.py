"""What the two formats that keep everything have in common: the fields of a skeleton, by name."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np

from ...report import Report
from ...skeleton import Skeleton
from .graphs import checked

FORMAT, FORMAT_VERSION = "glsk-o3d skeleton", 1
ARRAYS: dict[str, tuple[tuple[int, ...], type]] = {
    "vertices": ((3,), float),
    "edges": ((2,), int),
    "radii": ((), float),
    "confidence": ((), float),
    "vertex_of_point": ((), int),
    "points": ((3,), float),
    "normals": ((3,), float),
    "half_width": ((), float),
    "half_thickness": ((), float),
    "support": ((), float),
}
"""The arrays of a skeleton: the shape of a row and the type of each. The one field more is ``report``."""
LATER = ("half_width", "half_thickness", "support")
"""Those that older files lack: there they are the radii, and the support is not known."""


def decode(values: Any) -> Skeleton:
    """The skeleton whose fields stand in a dict.

    Parameters
    ----------
    values : dict
        With ``format``, ``format_version``, the arrays or lists of numbers, and the report as a dict of `plain` values.

    Raises
    ------
    ValueError
        It is something else, is from a newer release, lacks a field, or the fields do not fit together.
    """
    if not isinstance(values, dict) or values.get("format") != FORMAT:
        raise ValueError(f"it is not marked as a {FORMAT!r}")
    if values.get("format_version") != FORMAT_VERSION:
        found = values.get("format_version")
        raise ValueError(f"it has format_version {found!r} and this release reads {FORMAT_VERSION}: update glsk-o3d")
    unknown = np.full(len(values.get("radii", ())), np.nan)
    values = dict(zip(LATER, (values.get("radii"), values.get("radii"), unknown), strict=True)) | values
    missing = [name for name in (*ARRAYS, "report") if name not in values]
    if missing:
        raise ValueError(f"it lacks {', '.join(missing)}")
    arrays = {}
    for name, (columns, kind) in ARRAYS.items():
        array = np.asarray(values[name], None if kind is int else kind)  # 1.5 must not become 1
        if array.size == 0:
            array = np.empty((0, *columns), kind)
        if array.shape[1:] != columns or array.dtype.kind not in ("iu" if kind is int else "f"):
            raise ValueError(f"{name} has shape {array.shape} and dtype {array.dtype}")
        arrays[name] = array
    for name, words in (("confidence", "confidences"), *((name, name) for name in LATER)):
        if len(arrays[name]) != len(arrays["vertices"]):
            raise ValueError(f"{len(arrays[name])} {words} for {len(arrays['vertices'])} vertices")
    return checked(Skeleton(**arrays, report=Report.from_dict(_with_nan(values["report"]))))


def plain(value: Any) -> Any:
    """What JSON can hold: NaN becomes null and the infinities strings, in arrays, dicts and lists alike."""
    if isinstance(value, np.ndarray):
        cells = value.astype(object)
        if value.dtype.kind == "f":
            cells[np.isnan(value)] = None
            cells[np.isposinf(value)], cells[np.isneginf(value)] = "Infinity", "-Infinity"
        return cells.tolist()
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    value = value.item() if isinstance(value, np.generic) else value
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else "Infinity" if value > 0 else "-Infinity"
    return value


def _with_nan(value: Any) -> Any:
    """Inverse of `plain` for the report; of arrays NumPy does it."""
    if isinstance(value, dict):
        return {key: _with_nan(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_with_nan(item) for item in value]
    return math.nan if value is None else float(value) if value in ("Infinity", "-Infinity") else value


def dumps(value: Any) -> str:
    """JSON of `plain` values."""
    return json.dumps(plain(value), allow_nan=False)
