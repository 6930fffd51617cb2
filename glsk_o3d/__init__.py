"""Curve skeletons from point clouds, as composable Open3D filters."""

import lazy_loader as _lazy

__version__ = "0.1.0"

# The names stand in __init__.pyi; importing them late keeps the import of this package at a few milliseconds.
__getattr__, __dir__, __all__ = _lazy.attach_stub(__name__, __file__)
__all__.remove("MeshSet")  # needs an extra, which `from glsk_o3d import *` must not ask for
