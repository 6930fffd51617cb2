"""Many clouds in parallel, with a ledger that lets an interrupted batch continue."""

import lazy_loader as _lazy

__getattr__, __dir__, __all__ = _lazy.attach_stub(__name__, __file__)
