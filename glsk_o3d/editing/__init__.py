"""Functions that edit a skeleton: each returns a new one."""

from .curves import resample, smooth, transform
from .graph import cut_loops, detailed, largest_component, prune, reroot, simplify

__all__ = [
    "cut_loops",
    "detailed",
    "largest_component",
    "prune",
    "reroot",
    "resample",
    "simplify",
    "smooth",
    "transform",
]
