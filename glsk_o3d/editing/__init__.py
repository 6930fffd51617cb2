"""Functions that prune, simplify, smooth and reroot a skeleton. Each returns a new one."""

from .edits import cut_loops, largest_component, prune, reroot, simplify, smooth

__all__ = ["cut_loops", "largest_component", "prune", "reroot", "simplify", "smooth"]
