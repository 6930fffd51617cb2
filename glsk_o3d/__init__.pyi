# The public names and where they live; the package imports each when it is first asked for.
from . import analysis as analysis
from . import batch as batch
from . import pipelines as pipelines
from .connector import Connector
from .contractor import Contractor
from .errors import (
    BatchError,
    DisplayError,
    FileFormatError,
    GlskError,
    InvalidCloudError,
    InvalidParameterError,
    MissingPackageError,
    PluginWarning,
    RecipeError,
    ScriptError,
    SkeletonWarning,
    StageError,
)
from .filter import Filter
from .interop.files import read_cloud, read_skeleton, save_skeleton
from .interop.meshlab.meshset import MeshSet
from .interop.preview import save_preview
from .lpr_reducer import LPRReducer
from .pipeline import Pipeline, skeletonize
from .recipes import load_recipe, rerun, save_recipe
from .reduction import remove_redundant_points
from .refiner import Refiner
from .report import IterationRecord, Report
from .ring_builder import RingBuilder
from .skeleton import Skeleton
from .state import Contraction
from .stopping import ExplainedScore, RingSizeRatio
from .viewing.page import save_report
from .viewing.plot import plot_skeleton
from .viewing.recorder import ContractionRecorder

__version__: str

__all__ = [
    "BatchError",
    "Connector",
    "Contraction",
    "ContractionRecorder",
    "Contractor",
    "DisplayError",
    "ExplainedScore",
    "FileFormatError",
    "Filter",
    "GlskError",
    "InvalidCloudError",
    "InvalidParameterError",
    "IterationRecord",
    "LPRReducer",
    "MeshSet",
    "MissingPackageError",
    "Pipeline",
    "PluginWarning",
    "RecipeError",
    "Refiner",
    "Report",
    "RingBuilder",
    "RingSizeRatio",
    "ScriptError",
    "Skeleton",
    "SkeletonWarning",
    "StageError",
    "analysis",
    "batch",
    "load_recipe",
    "pipelines",
    "plot_skeleton",
    "read_cloud",
    "read_skeleton",
    "remove_redundant_points",
    "rerun",
    "save_preview",
    "save_recipe",
    "save_report",
    "save_skeleton",
    "skeletonize",
]
