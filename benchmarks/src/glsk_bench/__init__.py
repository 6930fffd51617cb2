"""A benchmark of random shapes with exactly known axes, clouds of them as scanners give them, and scores.

Everything follows from a family, a seed, a variant and a number of points, so that nothing needs to be downloaded. The
shapes, the clouds and the scores need NumPy and SciPy alone.

Examples
--------
>>> from glsk_bench.clouds import cloud
>>> from glsk_bench.shapes import shape
>>> tree = shape("trees", 7)
>>> cloud(tree, "depth2", n=2048).shape
(2048, 3)
"""

import lazy_loader as _lazy

__version__ = "0.1.0"

__getattr__, __dir__, __all__ = _lazy.attach_stub(__name__, __file__)
