# The public names and where they live; the package imports each when it is first asked for.
from . import analysis as analysis
from . import batch as batch
from . import crosscheck as crosscheck
from . import editing as editing
from . import pipelines as pipelines
from . import samples as samples
from .connector import Connector
from .contractor import Contractor
from .decisions import Decision, Supported
from .denoiser import Denoiser
from .driver import remove_redundant_points, skeletonize
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
from .inscriber import Inscriber
from .interop.clouds import Cloud
from .io.annotation import annotate
from .io.formats.gltf import save_rig
from .io.geometry import to_line_set, to_tubes
from .io.scans import read_cloud, read_tensor_cloud
from .io.skeletons import read_skeleton, read_truth, save_skeleton
from .io.streaming import annotate_file, read_sample
from .lpr_reducer import LPRReducer
from .meshlab.layers import to_pymeshlab
from .meshlab.meshset import MeshSet
from .outlier_remover import OutlierRemover
from .pipeline import Filter, Pipeline
from .points import Points
from .recipes import from_recipe, load_recipe, save_recipe, to_recipe
from .refiner import Refiner
from .report import IterationRecord, Report
from .resampling import support
from .ring_builder import RingBuilder
from .sampler import Sampler
from .skeleton import Skeleton
from .state import Contraction
from .stopping import ExplainedScore, RingSizeRatio
from .thinner import Thinner
from .tracer import Tracer
from .viewing.page import save_report
from .viewing.plot import plot_skeleton
from .viewing.preview import save_preview

__version__: str

__all__ = [
    "BatchError",
    "Cloud",
    "Connector",
    "Contraction",
    "Contractor",
    "Decision",
    "Denoiser",
    "DisplayError",
    "ExplainedScore",
    "FileFormatError",
    "Filter",
    "GlskError",
    "Inscriber",
    "InvalidCloudError",
    "InvalidParameterError",
    "IterationRecord",
    "LPRReducer",
    "MeshSet",
    "MissingPackageError",
    "OutlierRemover",
    "Pipeline",
    "PluginWarning",
    "Points",
    "RecipeError",
    "Refiner",
    "Report",
    "RingBuilder",
    "RingSizeRatio",
    "Sampler",
    "ScriptError",
    "Skeleton",
    "SkeletonWarning",
    "StageError",
    "Supported",
    "Thinner",
    "Tracer",
    "analysis",
    "annotate",
    "annotate_file",
    "batch",
    "crosscheck",
    "from_recipe",
    "load_recipe",
    "pipelines",
    "plot_skeleton",
    "read_cloud",
    "read_sample",
    "read_skeleton",
    "read_tensor_cloud",
    "read_truth",
    "remove_redundant_points",
    "save_preview",
    "save_recipe",
    "save_report",
    "save_rig",
    "save_skeleton",
    "skeletonize",
    "support",
    "to_line_set",
    "to_pymeshlab",
    "to_recipe",
    "to_tubes",
]
