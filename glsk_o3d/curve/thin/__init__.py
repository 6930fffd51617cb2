"""Parts that have no surface: which they are, and paths through their points."""
