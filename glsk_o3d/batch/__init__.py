"""Many clouds: worked through in parallel, recorded in a ledger, and carried on where they were left."""

import lazy_loader as _lazy

__getattr__, __dir__, __all__ = _lazy.attach_stub(__name__, __file__)
