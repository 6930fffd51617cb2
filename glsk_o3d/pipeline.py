"""Pipeline: filters joined with `|`, and the one easy door."""

from __future__ import annotations

import dataclasses
import os
import time
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

from .errors import InvalidParameterError
from .filter import Filter
from .pipelines import named_pipeline
from .report import Report
from .skeleton import Skeleton


class Pipeline:
    """Filters in a row; called on a cloud, each takes what the one before made.

    Parameters
    ----------
    *stages : Filter
        At least one; made more comfortably with ``RingBuilder() | Contractor() | ...``.

    Examples
    --------
    >>> from glsk_o3d import RingBuilder, Contractor, Connector, Refiner
    >>> RingBuilder(k=12) | Contractor() | Connector(radius="3%")  # doctest: +ELLIPSIS
    RingBuilder(k=12, ...) | Contractor(...) | Connector(radius='3%', ...)
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

    def __call__(self, cloud, *, on_iteration=None, on_state=None, on_stage: Callable[[Filter], object] | None = None):
        """Run all filters on a cloud.

        Parameters
        ----------
        cloud : cloud, or whatever the first filter consumes
        on_iteration : callable, optional
            Called with the IterationRecord of each solve; return False to stop the contraction there.
        on_state : callable, optional
            Called before it with the Contraction after each solve, such as a `ContractionRecorder`.
        on_stage : callable, optional
            Called with each filter before it runs.

        Returns
        -------
        Skeleton, Contraction or cloud
            Whatever the last filter gives.
        """
        self.check()
        ahead = Report()
        for stage in self.stages:
            if on_stage is not None:
                on_stage(stage)
            start = time.perf_counter()
            cloud = stage(cloud, on_iteration=on_iteration, on_state=on_state)
            if stage.produces == "cloud":
                ahead = ahead.with_stage(stage, time.perf_counter() - start)
            elif ahead.stages and stage.consumes == "cloud":
                cloud = dataclasses.replace(cloud, report=cloud.report.after(ahead))
        return cloud

    def check(self) -> None:
        """Raise InvalidParameterError if a parameter of a stage is wrong."""
        for stage in self.stages:
            stage.check()

    def check_complete(self) -> None:
        """Raise InvalidParameterError unless the pipeline leads from a cloud to a skeleton."""
        if self.stages[0].consumes != "cloud" or self.stages[-1].produces != "Skeleton":
            raise InvalidParameterError(f"{self!r} does not lead from a cloud to a skeleton")

    def to_recipe(self) -> dict[str, Any]:
        """The pipeline as a plain dict; see `glsk_o3d.recipes.to_recipe`."""
        from .recipes import to_recipe

        return to_recipe(self)

    @classmethod
    def from_recipe(cls, recipe: dict[str, Any]) -> Pipeline:
        """The pipeline that a plain dict describes; see `glsk_o3d.recipes.from_recipe`."""
        from .recipes import from_recipe

        return from_recipe(recipe)

    def save_recipe(self, path: str | os.PathLike) -> None:
        """Write the pipeline to a JSON or TOML file, which `glsk_o3d.load_recipe` reads."""
        from .recipes import save_recipe

        save_recipe(self, path)

    def __or__(self, other: Filter | Pipeline) -> Pipeline:
        return Pipeline(*self.stages, *(other.stages if isinstance(other, Pipeline) else (other,)))

    def __repr__(self):
        return " | ".join(map(repr, self.stages))

    def __eq__(self, other):
        return isinstance(other, Pipeline) and self.stages == other.stages

    def __hash__(self):
        return hash(self.stages)


def skeletonize(
    cloud, pipeline: Pipeline | str | os.PathLike = "default", *, on_iteration=None, on_state=None
) -> Skeleton:
    """Curve skeleton of a point cloud.

    Parameters
    ----------
    cloud : open3d.geometry.PointCloud, open3d.t.geometry.PointCloud, TriangleMesh of either kind, or (N, 3) array
        Points without order, normals or orientation; of a mesh the vertices. It is not modified.
    pipeline : Pipeline, {"default", "wen2024", "cao2010"}, name of a plugin's pipeline, or path of a recipe
        A name that ends in ``.json`` or ``.toml`` is a path.
    on_iteration : callable, optional
        Called with the IterationRecord of each solve; return False to stop the contraction there.
    on_state : callable, optional
        Called before it with the Contraction after each solve, such as a `ContractionRecorder`.

    Returns
    -------
    Skeleton

    Raises
    ------
    InvalidCloudError
        If the points cannot be skeletonised.
    InvalidParameterError
        If the pipeline is unknown, lacks a stage, or has a wrong parameter.
    RecipeError
        If the recipe is wrong.

    Examples
    --------
    >>> from glsk_o3d.samples import torus
    >>> ring = skeletonize(torus(1000).points)
    >>> ring.n_loops, ring.vertices.shape[1]
    (1, 3)
    """
    return as_pipeline(pipeline)(cloud, on_iteration=on_iteration, on_state=on_state)


def as_pipeline(pipeline: Pipeline | Filter | str | os.PathLike) -> Pipeline:
    """The pipeline that is meant, from a cloud to a skeleton.

    Parameters
    ----------
    pipeline : Pipeline, Filter, name, or path of a recipe

    Returns
    -------
    Pipeline

    Raises
    ------
    InvalidParameterError, RecipeError
        As in `skeletonize`.
    """
    if isinstance(pipeline, os.PathLike) or (
        isinstance(pipeline, str) and Path(pipeline).suffix.lower() in (".json", ".toml")
    ):
        from .recipes import load_recipe

        pipeline = load_recipe(pipeline)
    elif isinstance(pipeline, str):
        pipeline = named_pipeline(pipeline)
    elif isinstance(pipeline, Filter):
        pipeline = Pipeline(pipeline)
    elif not isinstance(pipeline, Pipeline):
        raise InvalidParameterError(
            f"pipeline = {pipeline!r}: must be a Pipeline, the name of one, or the path of a recipe"
        )
    pipeline.check_complete()
    return pipeline
