"""What a skeleton says about its object, and how good it is: against a known axis, or its cloud alone."""

from .branches import BranchTable, branch_table
from .curvature import curvature_torsion
from .grasps import GraspCandidates, grasp_candidates
from .metrics import Assessment, Comparison, Loop, assess, compare
from .segmentation import segment
from .truth import Truth

__all__ = [
    "Assessment",
    "BranchTable",
    "Comparison",
    "GraspCandidates",
    "Loop",
    "Truth",
    "assess",
    "branch_table",
    "compare",
    "curvature_torsion",
    "grasp_candidates",
    "segment",
]
