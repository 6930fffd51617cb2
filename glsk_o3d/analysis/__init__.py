"""What a skeleton says about its object, and how good it is: against a known axis, or against its cloud alone."""

from .branches import BranchTable, branch_table
from .curvature import curvature_torsion
from .metrics import Assessment, Comparison, Loop, assess, compare
from .picture import save_picture
from .segmentation import segment
from .truth import Truth, read_truth

__all__ = [
    "Assessment",
    "BranchTable",
    "Comparison",
    "Loop",
    "Truth",
    "assess",
    "branch_table",
    "compare",
    "curvature_torsion",
    "read_truth",
    "save_picture",
    "segment",
]
