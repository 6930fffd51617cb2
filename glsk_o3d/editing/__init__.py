"""After the skeleton: shorten it, thin it out, smooth it, and make a tree of it. Each gives a new skeleton."""

from .curves import simplify, smooth
from .graphs import cut_loops, largest_component, prune, reroot

__all__ = ["cut_loops", "largest_component", "prune", "reroot", "simplify", "smooth"]
