"""How good a skeleton is: against a known axis, or against its cloud alone."""

from .metrics import Assessment, Comparison, Loop, assess, compare
from .picture import save_picture
from .truth import Truth, read_truth

__all__ = ["Assessment", "Comparison", "Loop", "Truth", "assess", "compare", "read_truth", "save_picture"]
