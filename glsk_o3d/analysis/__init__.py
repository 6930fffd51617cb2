"""Measures of an object by its skeleton, and of a skeleton against a known axis or its cloud."""

import lazy_loader as _lazy

__getattr__, __dir__, __all__ = _lazy.attach_stub(__name__, __file__)
