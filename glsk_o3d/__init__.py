"""Curve skeletons from point clouds, as composable Open3D filters."""

import sys

import lazy_loader as _lazy

__version__ = "0.1.0"

# The names stand in __init__.pyi; importing them late keeps the import of this package at a few milliseconds.
__getattr__, __dir__, __all__ = _lazy.attach_stub(__name__, __file__)
__all__.remove("MeshSet")  # needs an extra, which `from glsk_o3d import *` must not ask for


def _show_in_notebooks():
    """Let Jupyter show skeletons as pictures; their class itself knows nothing of pictures."""
    shell = sys.modules["IPython"].get_ipython() if "IPython" in sys.modules else None
    if shell is not None:
        html = shell.display_formatter.formatters["text/html"]
        html.for_type_by_name("glsk_o3d.skeleton", "Skeleton", _picture)


def _picture(skeleton):
    from .viewing.html import to_html

    return to_html(skeleton)


_show_in_notebooks()
