from .assessment import Assessment, assess
from .branches import BranchTable, branch_table
from .comparison import Comparison, Truth, compare
from .crowns import DiameterClass, diameter_classes
from .forestry import TreeMeasures, tree_measures
from .grasps import grasp_candidates
from .gripper import GraspCandidates, Gripper
from .segmentation import segment
from .stems import Stem, StemSection, stem
from .trees import Cylinders, cylinders

__all__ = [
    "Assessment",
    "BranchTable",
    "Comparison",
    "Cylinders",
    "DiameterClass",
    "GraspCandidates",
    "Gripper",
    "Stem",
    "StemSection",
    "TreeMeasures",
    "Truth",
    "assess",
    "branch_table",
    "compare",
    "cylinders",
    "diameter_classes",
    "grasp_candidates",
    "segment",
    "stem",
    "tree_measures",
]
