"""Curve skeletons from point clouds, as composable Open3D filters."""

from importlib.metadata import PackageNotFoundError as _NotFound
from importlib.metadata import version as _version

from . import pipeline as pipelines
from .connector import Connector
from .contractor import Contractor
from .errors import (
    FileFormatError,
    GlskError,
    InvalidCloudError,
    InvalidParameterError,
    MissingPackageError,
    SkeletonWarning,
    StageError,
)
from .filter import Filter
from .interop.files import read_cloud, read_skeleton, save_skeleton
from .interop.preview import save_preview
from .lpr_reducer import LPRReducer
from .pipeline import Pipeline, skeletonize
from .refiner import Refiner
from .report import IterationRecord, Report
from .ring_builder import RingBuilder
from .skeleton import Skeleton
from .state import Contraction
from .stopping import ExplainedScore, RingSizeRatio

try:
    __version__ = _version("glsk-o3d")
except _NotFound:  # a source tree that was not installed
    __version__ = "0.0.0"

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
    "Refiner",
    "Report",
    "RingBuilder",
    "RingSizeRatio",
    "Skeleton",
    "SkeletonWarning",
    "StageError",
    "pipelines",
    "read_cloud",
    "read_skeleton",
    "save_preview",
    "save_skeleton",
    "skeletonize",
]
