"""The parts of accuracy.py: what its commands measure, their tables and their pictures."""
