"""JSON and npz: keep everything, to the last bit; JSON as text that every language reads, npz small.

In JSON NaN is null and the infinities are strings, since strict JSON has neither. An npz file is never unpickled; its
report is a string of JSON.
"""

import io
import json
import math
from collections.abc import Iterable
from contextlib import suppress
from typing import Any

import numpy as np

from ...data.report import Report
from ...data.skeleton import ARRAYS, Skeleton, of_input
from ..paths import check_budget, check_promised

FORMAT, FORMAT_VERSION = "glsk-o3d skeleton", 1
REPRESENTATIVES = "representative_of_point"
"""An array that only skeletons have that are to be refined."""


def write_json(skeleton: Skeleton) -> bytes:
    """The content of a JSON file."""
    return dumps({**_arrays(skeleton), "report": skeleton.report.to_dict()}).encode()


def read_json(data: bytes) -> Skeleton:
    """The skeleton in the content of a JSON file."""
    return _decode(json.loads(data))


def write_npz(skeleton: Skeleton) -> bytes:
    """The content of an npz file."""
    stream = io.BytesIO()
    np.savez_compressed(stream, **_arrays(skeleton), report=dumps(skeleton.report.to_dict()))
    return stream.getvalue()


def read_npz(data: bytes) -> Skeleton:
    """The skeleton in the content of an npz file."""
    words = ("format", "format_version", "report")
    values = npz_arrays(data, (*words, *ARRAYS))
    values |= {name: values[name].item() for name in words if name in values and values[name].ndim == 0}
    return _decode({**values, "report": json.loads(values["report"])})


def npz_arrays(data: bytes, names: Iterable[str]) -> dict[str, Any]:
    """Those arrays of an npz archive that it has; ValueError where they are pickled, or unpack to more than memory."""
    arrays: dict[str, Any] = {}
    with np.load(io.BytesIO(data), allow_pickle=False) as archive:
        check_budget(sum(info.file_size for info in archive.zip.infolist()), len(data))
        for name in {*names} & {*archive}:
            with archive.zip.open(f"{name}.npy") as stream:
                oldest = np.lib.format.read_magic(stream) == (1, 0)  # later ones may have longer headers
                read = np.lib.format.read_array_header_1_0 if oldest else np.lib.format.read_array_header_2_0
                shape, _, kind = read(stream)
            check_promised(math.prod(shape) * kind.itemsize, archive.zip.getinfo(f"{name}.npy").file_size, name)
            arrays[name] = archive[name]
    return arrays


def dumps(value: Any) -> str:
    """Strict JSON of numbers, arrays, dicts and lists."""
    return json.dumps(_plain(value), allow_nan=False)


def _arrays(skeleton: Skeleton) -> dict[str, Any]:
    arrays = {name: getattr(skeleton.whole, name) for name in ARRAYS}
    if (arrays[REPRESENTATIVES] < 0).all():  # as of finished skeletons
        del arrays[REPRESENTATIVES]
    return {"format": FORMAT, "format_version": FORMAT_VERSION, **arrays}


def _decode(values: Any) -> Skeleton:
    """The skeleton whose fields stand in a dict; ValueError where it is something else, or from a newer release."""
    if not isinstance(values, dict) or values.get("format") != FORMAT:
        raise ValueError(f"it is not marked as a {FORMAT!r}")
    if (version := values.get("format_version")) != FORMAT_VERSION:
        raise ValueError(f"it has format_version {version!r} and this release reads {FORMAT_VERSION}: update glsk-o3d")
    values = {REPRESENTATIVES: []} | values
    missing = [name for name in (*ARRAYS, "report") if name not in values]
    if missing:
        raise ValueError(f"it lacks {', '.join(missing)}")
    arrays: dict[str, Any] = {name: values[name] for name in ARRAYS}
    for name, (_, kind) in ARRAYS.items():
        if kind is float and isinstance(values[name], list):
            with suppress(TypeError, ValueError, OverflowError):  # a skeleton says best what is wrong
                arrays[name] = np.asarray(values[name], float)  # null is NaN, and words infinity
    return of_input(Skeleton(**arrays, report=Report.from_dict(_with_nan(values["report"]))))


def _plain(value: Any) -> Any:
    """What JSON can hold: NaN becomes null and the infinities strings, in arrays, dicts and lists alike."""
    if isinstance(value, (np.ndarray, np.generic)):
        value = value.tolist()
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return {math.inf: "Infinity", -math.inf: "-Infinity"}.get(value)
    return value


def _with_nan(value: Any) -> Any:
    """Inverse of `_plain` for the report; of arrays NumPy does it."""
    if isinstance(value, dict):
        return {key: _with_nan(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_with_nan(item) for item in value]
    return math.nan if value is None else float(value) if value in ("Infinity", "-Infinity") else value
