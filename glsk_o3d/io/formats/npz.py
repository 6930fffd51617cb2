"""npz, NumPy's compressed archives: keep everything, to the last bit, small.

A file is never unpickled; its report is a string of JSON.
"""

from __future__ import annotations

import io
import json
import math
import zipfile
from typing import Any

import numpy as np

from ...skeleton import Skeleton
from .fields import ARRAYS, FORMAT, FORMAT_VERSION, decode, dumps

MOST_EXPANDED = 200  # fitted: times the size of a file that its arrays may have; those of skeletons have 1 to 20
SMALL_ARCHIVE = 1 << 26  # derived: bytes that may always be held


def write(skeleton: Skeleton) -> bytes:
    """The content of an npz file."""
    arrays: dict[str, Any] = {name: getattr(skeleton, name) for name in ARRAYS}
    stream = io.BytesIO()
    report = dumps(skeleton.report.to_dict())
    np.savez_compressed(stream, format=FORMAT, format_version=FORMAT_VERSION, **arrays, report=report)
    return stream.getvalue()


def read(data: bytes) -> Skeleton:
    """The skeleton in the content of an npz file."""
    words = ("format", "format_version", "report")
    with zipfile.ZipFile(io.BytesIO(data)) as packed:
        _check_sizes(packed, len(data))
    with np.load(io.BytesIO(data), allow_pickle=False) as archive:
        values = {name: archive[name] for name in (*words, *ARRAYS) if name in archive.files}
    for name in words:
        values[name] = values[name].item() if name in values and values[name].ndim == 0 else None
    return decode({**values, "report": json.loads(values["report"] or "null")})


def _check_sizes(packed: zipfile.ZipFile, size: int) -> None:
    """Raise ValueError where arrays are larger than those of a skeleton in so small a file, or than they say."""
    if sum(info.file_size for info in packed.infolist()) > max(MOST_EXPANDED * size, SMALL_ARCHIVE):
        raise ValueError(f"its {size} bytes would become more than {MOST_EXPANDED} times as many: no skeleton packs so")
    for name in ARRAYS:
        if f"{name}.npy" not in packed.namelist():
            continue  # which is said later
        with packed.open(f"{name}.npy") as stream:
            if np.lib.format.read_magic(stream) != (1, 0):
                raise ValueError(f"{name} has a header that no skeleton needs")
            shape, _, dtype = np.lib.format.read_array_header_1_0(stream)
            held = packed.getinfo(f"{name}.npy").file_size - stream.tell()
        if len(shape) > 2 or math.prod(shape) * dtype.itemsize != held:
            raise ValueError(f"{name} has shape {shape}, dtype {dtype} and {held} bytes")
