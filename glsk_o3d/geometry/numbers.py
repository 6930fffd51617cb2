"""Numbers that steer results: the fields of small frozen dataclasses, each with where it comes from."""

import dataclasses
from functools import partial
from typing import Any


def _number(value: Any, doc: str, origin: str) -> Any:
    return dataclasses.field(default=value, metadata=dict(origin=origin, doc=doc))


published, derived, measured, fitted = (
    partial(_number, origin=origin) for origin in ("published", "derived", "measured", "fitted")
)
"""Fields with a value, and what it is; they steer a result, and all but those derived might have been others."""
speed, precision, warning = (partial(_number, origin=origin) for origin in ("speed", "precision", "warning"))
"""The same of numbers for speed, which change no result, such as the sizes of blocks; for precision, which change none
when they are finer; and of warnings, which change only what is said about one."""
