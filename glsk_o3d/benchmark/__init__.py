"""A public benchmark: shapes with exactly known axes, clouds of them, and scores for any program's skeletons."""

import lazy_loader as _lazy

__getattr__, __dir__, __all__ = _lazy.attach_stub(__name__, __file__)
