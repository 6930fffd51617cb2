"""The parts of speed.py: a file for each of its commands, and what these share."""
