"""What a skeleton says about its object, and how good it is: against a known axis, or its cloud alone."""

from .assessment import Assessment, LoopWidth, assess
from .branches import BranchTable, branch_table
from .comparison import Comparison, compare
from .curvature import curvature_torsion
from .forestry import TreeMeasures, tree_measures
from .grasp_rows import GraspCandidates
from .grasps import grasp_candidates
from .gripper import Gripper
from .loops import Loop, find_loops
from .segmentation import segment
from .thickness import thickness
from .tree_cylinders import Cylinders, cylinders
from .truth import Truth

__all__ = [
    "Assessment",
    "BranchTable",
    "Comparison",
    "Cylinders",
    "GraspCandidates",
    "Gripper",
    "Loop",
    "LoopWidth",
    "TreeMeasures",
    "Truth",
    "assess",
    "branch_table",
    "compare",
    "curvature_torsion",
    "cylinders",
    "find_loops",
    "grasp_candidates",
    "segment",
    "thickness",
    "tree_measures",
]
