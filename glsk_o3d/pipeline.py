"""Pipelines: filters joined with `|`, the named ones, and the one easy door."""

from __future__ import annotations

from itertools import pairwise

from .connector import Connector
from .contractor import Contractor
from .errors import InvalidParameterError
from .filter import Filter
from .lpr_reducer import LPRReducer
from .refiner import Refiner
from .ring_builder import RingBuilder
from .skeleton import Skeleton
from .stopping import ExplainedScore, RingSizeRatio


class Pipeline:
    """Filters in a row; called on a cloud, each takes what the one before made.

    Parameters
    ----------
    *stages : Filter
        At least one; made more comfortably with ``RingBuilder() | Contractor() | ...``.

    Examples
    --------
    >>> from glsk_o3d import RingBuilder, Contractor, Connector, Refiner
    >>> RingBuilder(k=12) | Contractor() | Connector(radius="3%")
    RingBuilder(k=12, ...) | Contractor(...) | Connector(radius='3%')
    """

    def __init__(self, *stages: Filter):
        if not stages:
            raise InvalidParameterError("a pipeline needs at least one filter")
        for stage in stages:
            if not isinstance(stage, Filter):
                raise InvalidParameterError(f"{stage!r} is not a filter and cannot be part of a pipeline")
        for before, after in pairwise(stages):
            if before.produces != after.consumes:
                raise InvalidParameterError(
                    f"{type(after).__name__} takes a {after.consumes} but {type(before).__name__} gives a "
                    f"{before.produces}: the order is RingBuilder | Contractor | Connector | Refiner"
                )
        self.stages = stages

    def __call__(self, cloud, *, on_iteration=None):
        """Run all filters on a cloud.

        Parameters
        ----------
        cloud : cloud, or whatever the first filter consumes
        on_iteration : callable, optional
            Called with the IterationRecord of each solve; return False to stop the contraction there.

        Returns
        -------
        Skeleton or Contraction
            Whatever the last filter gives.
        """
        self.check()
        for stage in self.stages:
            cloud = stage(cloud, on_iteration=on_iteration)
        return cloud

    def check(self) -> None:
        """Raise InvalidParameterError if a parameter of a stage is wrong."""
        for stage in self.stages:
            stage.check()

    def __or__(self, other: Filter | Pipeline) -> Pipeline:
        return Pipeline(*self.stages, *(other.stages if isinstance(other, Pipeline) else (other,)))

    def __repr__(self):
        return " | ".join(map(repr, self.stages))

    def __eq__(self, other):
        return isinstance(other, Pipeline) and self.stages == other.stages

    def __hash__(self):
        return hash(self.stages)


def cao2010() -> Pipeline:
    """The baseline: contraction without reduction, stopped by the ring sizes (Cao et al. 2010)."""
    return (
        RingBuilder()
        | Contractor(stop=RingSizeRatio(), max_iterations=20, min_attraction=0, retries=0)
        | Connector(radius="2%", thickness=0, links="nearest")
        | Refiner(opening=0, twig=0, spacing=0, recentre=0)
    )


def wen2024() -> Pipeline:
    """GLSkeleton as published (Wen et al. 2024), with the choices of the authors' code where it differs from the paper.

    Merges visit the points in the order of the input and drop the mass of what they merge; the stopping rule waits for
    the fourth solve. The pages of the filters list every difference.
    """
    return (
        RingBuilder()
        | Contractor(
            reducer=LPRReducer(conserve_mass=False, order="index", mend_rings=False),
            stop=ExplainedScore(),
            min_attraction=0,
            retries=0,
        )
        | Connector(radius="2%", thickness=0, links="nearest")
        | Refiner(opening=0, twig=0, spacing=0, recentre=0)
    )


def default() -> Pipeline:
    """What we recommend: GLSkeleton with the mass of merged points kept and the vertices centred in the surface."""
    return RingBuilder() | Contractor(reducer=LPRReducer(), stop=ExplainedScore()) | Connector() | Refiner()


PIPELINES = {"default": default, "wen2024": wen2024, "cao2010": cao2010}


def named_pipeline(name: str) -> Pipeline:
    """The pipeline of that name.

    Raises
    ------
    InvalidParameterError
        If there is none; the message lists the names.
    """
    if name not in PIPELINES:
        raise InvalidParameterError(f"no pipeline is called {name!r}: there are {', '.join(PIPELINES)}")
    return PIPELINES[name]()


def skeletonize(cloud, pipeline: Pipeline | str = "default", *, on_iteration=None) -> Skeleton:
    """Curve skeleton of a point cloud.

    Parameters
    ----------
    cloud : open3d.geometry.PointCloud, open3d.t.geometry.PointCloud, TriangleMesh of either kind, or (N, 3) array
        Points without order, normals or orientation; of a mesh the vertices. It is not modified.
    pipeline : Pipeline or {"default", "wen2024", "cao2010"}
    on_iteration : callable, optional
        Called with the IterationRecord of each solve; return False to stop the contraction there.

    Returns
    -------
    Skeleton

    Raises
    ------
    InvalidCloudError
        If the points cannot be skeletonised.
    InvalidParameterError
        If the pipeline is unknown, lacks a stage, or has a wrong parameter.
    """
    if isinstance(pipeline, str):
        pipeline = named_pipeline(pipeline)
    elif isinstance(pipeline, Filter):
        pipeline = Pipeline(pipeline)
    if pipeline.stages[0].consumes != "cloud" or pipeline.stages[-1].produces != "Skeleton":
        raise InvalidParameterError(f"{pipeline!r} does not lead from a cloud to a skeleton")
    return pipeline(cloud, on_iteration=on_iteration)
