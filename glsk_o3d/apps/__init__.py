"""Applications, each for one kind of user: batches, MeshLab, the cross-check. Only the command line imports them."""

import lazy_loader as _lazy

__getattr__, __dir__, __all__ = _lazy.attach_stub(__name__, __file__)
