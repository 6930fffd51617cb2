"""npz, NumPy's compressed archives: keep everything, to the last bit, small.

A file is never unpickled; its report is a string of JSON.
"""

from __future__ import annotations

import io
import json
from typing import Any

import numpy as np

from ...skeleton import Skeleton
from .fields import ARRAYS, FORMAT, FORMAT_VERSION, decode, dumps


def write(skeleton: Skeleton) -> bytes:
    """The content of an npz file."""
    arrays: dict[str, Any] = {name: getattr(skeleton, name) for name in ARRAYS}
    stream = io.BytesIO()
    report = dumps(skeleton.report.to_dict())
    np.savez_compressed(stream, format=FORMAT, format_version=FORMAT_VERSION, **arrays, report=report)
    return stream.getvalue()


def read(data: bytes) -> Skeleton:
    """The skeleton in the content of an npz file."""
    with np.load(io.BytesIO(data), allow_pickle=False) as archive:
        values = {name: archive[name] for name in archive.files}
    for name in ("format", "format_version", "report"):
        values[name] = values[name].item() if name in values and values[name].ndim == 0 else None
    return decode({**values, "report": json.loads(values["report"] or "null")})
