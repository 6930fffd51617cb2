"""The cross-check with a mesh of its own: libigl's Laplacian on it, and the skeleton it contracts to."""

from .check import CrossCheck, cross_check

__all__ = ["CrossCheck", "cross_check"]
