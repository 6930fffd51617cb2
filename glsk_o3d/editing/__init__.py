"""After the skeleton: shorten it, thin it out, smooth it, and make a tree of it. Each gives a new skeleton."""

from .edits import cut_loops, largest_component, prune, reroot, simplify, smooth

__all__ = ["cut_loops", "largest_component", "prune", "reroot", "simplify", "smooth"]
