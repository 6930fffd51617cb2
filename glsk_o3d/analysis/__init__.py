"""How good a skeleton is: against a known axis, against its cloud alone, or against a mesh of its cloud."""

from .crosscheck import CrossCheck, cross_check
from .crosscheck_picture import save_crosscheck_picture
from .metrics import Assessment, Comparison, Loop, assess, compare
from .picture import save_picture
from .truth import Truth, read_truth

__all__ = [
    "Assessment",
    "Comparison",
    "CrossCheck",
    "Loop",
    "Truth",
    "assess",
    "compare",
    "cross_check",
    "read_truth",
    "save_crosscheck_picture",
    "save_picture",
]
