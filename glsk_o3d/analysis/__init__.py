"""What a skeleton says about its object, and how good it is: against a known axis, its cloud alone, or a mesh of it."""

from .branches import BranchTable, branch_table
from .crosscheck import CrossCheck, cross_check
from .crosscheck_picture import save_crosscheck_picture
from .curvature import curvature_torsion
from .grasps import GraspCandidates, grasp_candidates
from .metrics import Assessment, Comparison, Loop, assess, compare
from .picture import save_picture
from .segmentation import segment
from .truth import Truth, read_truth

__all__ = [
    "Assessment",
    "BranchTable",
    "Comparison",
    "CrossCheck",
    "GraspCandidates",
    "Loop",
    "Truth",
    "assess",
    "branch_table",
    "compare",
    "cross_check",
    "curvature_torsion",
    "grasp_candidates",
    "read_truth",
    "save_crosscheck_picture",
    "save_picture",
    "segment",
]
