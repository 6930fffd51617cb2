"""JSON: keeps everything, to the last bit, in a text that every language reads.

NaN is null and the infinities are strings, since strict JSON has neither.
"""

from __future__ import annotations

import json

from ...skeleton import Skeleton
from .fields import ARRAYS, FORMAT, FORMAT_VERSION, decode, dumps


def write(skeleton: Skeleton) -> bytes:
    """The content of a JSON file."""
    arrays = {name: getattr(skeleton, name) for name in ARRAYS}
    report = skeleton.report.to_dict()
    return dumps({"format": FORMAT, "format_version": FORMAT_VERSION, **arrays, "report": report}).encode()


def read(data: bytes) -> Skeleton:
    """The skeleton in the content of a JSON file."""
    return decode(json.loads(data))
