from .assessment import Assessment, assess
from .branches import BranchTable, branch_table
from .comparison import Comparison, Truth, compare
from .crowns import diameter_classes
from .forestry import TreeMeasures, tree_measures
from .grasps import grasp_candidates
from .gripper import GraspCandidates, Gripper
from .scenes import SceneObject, scene_objects
from .segmentation import segment
from .stems import Stem, stem
from .trees import Cylinders, cylinders

__all__ = [
    "Assessment",
    "BranchTable",
    "Comparison",
    "Cylinders",
    "GraspCandidates",
    "Gripper",
    "SceneObject",
    "Stem",
    "TreeMeasures",
    "Truth",
    "assess",
    "branch_table",
    "compare",
    "cylinders",
    "diameter_classes",
    "grasp_candidates",
    "scene_objects",
    "segment",
    "stem",
    "tree_measures",
]
