# The public names and where they live; the package imports each when it is first asked for.
from . import analysis as analysis
from . import pipelines as pipelines
from .connector import Connector
from .contractor import Contractor
from .errors import (
    FileFormatError,
    GlskError,
    InvalidCloudError,
    InvalidParameterError,
    MissingPackageError,
    PluginWarning,
    RecipeError,
    SkeletonWarning,
    StageError,
)
from .filter import Filter
from .interop.files import read_cloud, read_skeleton, save_skeleton
from .interop.preview import save_preview
from .lpr_reducer import LPRReducer
from .pipeline import Pipeline, skeletonize
from .recipes import load_recipe, rerun, save_recipe
from .refiner import Refiner
from .report import IterationRecord, Report
from .ring_builder import RingBuilder
from .skeleton import Skeleton
from .state import Contraction
from .stopping import ExplainedScore, RingSizeRatio

__version__: str

__all__ = [
    "Connector",
    "Contraction",
    "Contractor",
    "ExplainedScore",
    "FileFormatError",
    "Filter",
    "GlskError",
    "InvalidCloudError",
    "InvalidParameterError",
    "IterationRecord",
    "LPRReducer",
    "MissingPackageError",
    "Pipeline",
    "PluginWarning",
    "RecipeError",
    "Refiner",
    "Report",
    "RingBuilder",
    "RingSizeRatio",
    "Skeleton",
    "SkeletonWarning",
    "StageError",
    "analysis",
    "load_recipe",
    "pipelines",
    "read_cloud",
    "read_skeleton",
    "rerun",
    "save_preview",
    "save_recipe",
    "save_skeleton",
    "skeletonize",
]
