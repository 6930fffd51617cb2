"""The cross-check: a mesh of the same points, libigl's Laplacian on it, and the skeleton that it contracts to."""

from .check import CrossCheck, cross_check, save_crosscheck_picture

__all__ = ["CrossCheck", "cross_check", "save_crosscheck_picture"]
