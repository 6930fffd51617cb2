"""Functions that prune, simplify and reroot a skeleton. Each returns a new one."""

from .edits import cut_loops, largest_component, prune, reroot, simplify

__all__ = ["cut_loops", "largest_component", "prune", "reroot", "simplify"]
