"""The cross-check with a mesh of the same points: libigl's Laplacian on it, and its skeleton."""

from .check import CrossCheck, cross_check

__all__ = ["CrossCheck", "cross_check"]
