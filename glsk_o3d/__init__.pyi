# The public names and where they live; the package imports each when it is first asked for.
from . import analysis as analysis
from . import editing as editing
from . import pipelines as pipelines
from . import samples as samples
from .analysis.support import support
from .api import remove_redundant_points, skeletonize
from .apps import batch as batch
from .apps import crosscheck as crosscheck
from .apps.meshlab.layers import to_pymeshlab
from .apps.meshlab.meshset import MeshSet
from .data.contraction import Contraction
from .data.decisions import Decision, Supported
from .data.points import Points
from .data.report import IterationRecord, Report
from .data.skeleton import Skeleton
from .data.verdict import Reason, Verdict
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
from .filters.connector import Connector
from .filters.contractor import Contractor
from .filters.denoiser import Denoiser
from .filters.lpr_reducer import LPRReducer
from .filters.outlier_remover import OutlierRemover
from .filters.refiner import Refiner
from .filters.ring_builder import RingBuilder
from .filters.sampler import Sampler
from .filters.stopping import ExplainedScore, RingSizeRatio
from .filters.thinner import Thinner
from .filters.tracer import Tracer
from .interop.clouds import Cloud
from .io.annotation import annotate
from .io.formats.gltf import save_rig
from .io.geometry import to_line_set, to_tubes, to_voxels
from .io.scans import read_cloud, read_tensor_cloud
from .io.skeletons import read_skeleton, read_truth, save_skeleton
from .io.streaming import annotate_file, read_sample
from .pipeline import Filter, Pipeline
from .recipes import from_recipe, load_recipe, save_recipe, to_recipe
from .tracking import Tracked, Tracker
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
    "Reason",
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
    "Tracked",
    "Tracker",
    "Verdict",
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
    "to_voxels",
]
