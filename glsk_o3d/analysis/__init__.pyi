from .assessment import Assessment, assess
from .branches import BranchTable, branch_table
from .comparison import Comparison, Truth, compare
from .forestry import TreeMeasures, tree_measures
from .grasps import grasp_candidates
from .gripper import GraspCandidates, Gripper
from .scenes import SceneObject, scene_objects
from .segmentation import segment
from .trees import Cylinders, cylinders

__all__ = [
    "Assessment",
    "BranchTable",
    "Comparison",
    "Cylinders",
    "GraspCandidates",
    "Gripper",
    "SceneObject",
    "TreeMeasures",
    "Truth",
    "assess",
    "branch_table",
    "compare",
    "cylinders",
    "grasp_candidates",
    "scene_objects",
    "segment",
    "tree_measures",
]
