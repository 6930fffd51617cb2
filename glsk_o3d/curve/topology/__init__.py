"""Questions about the topology: which loops, limbs, gaps and edges are those of the object."""
