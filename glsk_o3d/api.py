"""The driver: from a cloud to its skeleton in one call, and to the points that say most about it."""

import os
from collections.abc import Mapping
from typing import Any, TypeAlias

import numpy as np

from .data.skeleton import Skeleton
from .errors import InvalidCloudError, InvalidParameterError
from .filters.contractor import Contractor
from .filters.lpr_reducer import LPRReducer
from .filters.ring_builder import RingBuilder
from .interop.clouds import open3d_class
from .interop.packages import import_open3d
from .parameters import check_number
from .pipeline import Filter, OnIteration, OnState, Pipeline
from .recipes import RECIPE_ENDING, load_recipe
from .recipes.catalogue import named_pipeline

PipelineChoice: TypeAlias = Pipeline[Any, Skeleton] | str | os.PathLike[str] | Mapping[str, Any]
"""A pipeline, its name, the path of a recipe, or options for the default."""


def skeletonize(
    cloud: Any,
    pipeline: PipelineChoice = "default",
    *,
    on_iteration: OnIteration | None = None,
    on_state: OnState | None = None,
    **options: Any,
) -> Skeleton:
    """Curve skeleton of a point cloud.

    Parameters
    ----------
    cloud : open3d.geometry.PointCloud, open3d.t.geometry.PointCloud, TriangleMesh of either kind, or (N, 3) array
        Points, or a mesh, of which the points are its vertices or, where these are too far apart, a sample by area; see
        ``Sampler.sample``. They need no order, normals or orientation, and are not modified.
    pipeline : Pipeline, {"default", "fast", "tree", "wen2024", "cao2010"}, name of a plugin's, or path of a recipe
        A name that ends in ``.json`` is a path. A mapping is options for ``"default"``.
    on_iteration : callable, optional
        Called with the IterationRecord of each solve; return False, or 0, to stop the contraction there.
    on_state : callable, optional
        Called before `on_iteration` with a copy of the Contraction after each solve.
    **options
        Parameters of the filters, by name. If more than one filter has the name, give a mapping,
        ``{"Connector.radius": "2%"}``: as `pipeline` for ``"default"``, else to `Pipeline.with_options`.

    Returns
    -------
    Skeleton

    Raises
    ------
    InvalidCloudError
        If the points cannot be skeletonised.
    InvalidParameterError
        If the pipeline is unknown, lacks a stage, or an option is unknown or wrong.
    RecipeError
        If the recipe is wrong.

    Examples
    --------
    >>> from glsk_o3d.samples import torus
    >>> ring = skeletonize(torus(1000).points)
    >>> ring.n_loops, ring.vertices.shape[1]
    (1, 3)
    >>> skeletonize(torus(1000).points, k=12, drop_invalid=True).n_loops
    1
    """
    return chosen_pipeline(pipeline, options)(cloud, on_iteration=on_iteration, on_state=on_state)


def chosen_pipeline(pipeline: PipelineChoice, options: Mapping[str, Any]) -> Pipeline[Any, Skeleton]:
    """The pipeline that is meant, with options: what `skeletonize` takes."""
    if isinstance(pipeline, Mapping):
        return as_pipeline("default").with_options(pipeline, **options)
    return as_pipeline(pipeline).with_options(options)


def as_pipeline(
    pipeline: Pipeline[Any, Skeleton] | Filter[Any, Skeleton] | str | os.PathLike[str],
) -> Pipeline[Any, Skeleton]:
    """The pipeline from a cloud to a skeleton that is meant by a pipeline, a filter, a name, or the path of a recipe.

    InvalidParameterError and RecipeError as of `skeletonize`.
    """
    if isinstance(pipeline, os.PathLike) or (isinstance(pipeline, str) and pipeline.lower().endswith(RECIPE_ENDING)):
        pipeline = load_recipe(pipeline)
    elif isinstance(pipeline, str):
        pipeline = named_pipeline(pipeline)
    elif isinstance(pipeline, Filter):
        pipeline = Pipeline(pipeline)
    elif not isinstance(pipeline, Pipeline):
        raise InvalidParameterError(f"pipeline = {pipeline!r}: must be a Pipeline, its name, or the path of a recipe")
    pipeline.check_complete()
    return pipeline


def remove_redundant_points(cloud: Any, *, passes: int = 1) -> tuple[Any, Any]:
    """Remove points that add little to the skeleton beyond their neighbours, by local point reduction.

    One pass contracts the points, merges redundant ones into their neighbours, and keeps about three fifths at their
    original places, with smaller gaps than a random sample has.

    Parameters
    ----------
    cloud : open3d.geometry.PointCloud, open3d.t.geometry.PointCloud or (N, 3) array_like
        Not modified.
    passes : int
        Solves, each with a merging pass after it. They cost as much as the contraction of a skeleton. Points are
        neither set aside nor denoised before them.

    Returns
    -------
    reduced : like cloud
        With colours, normals and all other attributes of the points that are left.
    kept : list of int, open3d.core.Tensor or (n,) int array
        Their indices in `cloud`, ascending: a list for a legacy cloud, an int64 tensor on its device for a tensor
        cloud. ``cloud.select_by_index(kept)`` is `reduced`, and with ``invert=True`` the points that were removed.

    Raises
    ------
    InvalidCloudError
        The cloud is a mesh, or the points cannot be skeletonised.
    InvalidParameterError

    Examples
    --------
    >>> from glsk_o3d.samples import torus
    >>> points = torus(1000).points
    >>> reduced, kept = remove_redundant_points(points)
    >>> bool((reduced == points[kept]).all()), 500 < len(kept) < 700
    (True, True)
    """
    check_number("passes", passes, "int", low=1)
    name, tensor = open3d_class(cloud)
    if name == "TriangleMesh":
        raise InvalidCloudError("points cannot be removed from a mesh: make a cloud of its vertices first")
    contraction = Contractor(reducer=LPRReducer(), max_iterations=int(passes), stop=lambda iterations: None)
    kept = np.sort((RingBuilder() | contraction)(cloud).map.point_of_survivor)
    if name == "PointCloud" and not tensor:
        return cloud.select_by_index(kept), kept.tolist()
    if tensor:
        o3d = import_open3d()
        kept = o3d.core.Tensor(kept.astype(np.int64), device=cloud.device)
        return (cloud.select_by_index(kept) if name == "PointCloud" else cloud[kept]), kept
    return np.asarray(cloud)[kept], kept
