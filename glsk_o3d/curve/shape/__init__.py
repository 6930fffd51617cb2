"""Where the curve goes at junctions, at ends, and in wide ends and handles."""
