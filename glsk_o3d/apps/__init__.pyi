from . import batch as batch
from . import crosscheck as crosscheck
from . import meshlab as meshlab

__all__ = ["batch", "crosscheck", "meshlab"]
