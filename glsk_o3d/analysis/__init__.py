"""Measures of an object by its skeleton, and of a skeleton against a known axis or its cloud."""

from .assessment import Assessment, assess
from .branches import BranchTable, branch_table
from .comparison import Comparison, Truth, compare
from .curves import curvature_torsion
from .forestry import TreeMeasures, tree_measures
from .grasps import grasp_candidates
from .gripper import GraspCandidates, Gripper
from .loops import Loop, find_loops
from .segmentation import segment, thickness
from .trees import Cylinders, cylinders

__all__ = [
    "Assessment",
    "BranchTable",
    "Comparison",
    "Cylinders",
    "GraspCandidates",
    "Gripper",
    "Loop",
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
