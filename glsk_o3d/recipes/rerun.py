"""Runs repeated from the recipe in their report."""

import dataclasses
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

from ..errors import InvalidParameterError, RecipeError, SkeletonWarning
from ..interop.clouds import Cloud
from ..pipeline import Pipeline, recipe_of
from ..report import outside
from ..skeleton import Skeleton
from .recipe import from_recipe


def identical(skeleton: Skeleton, other: Skeleton) -> bool:
    """Whether two skeletons have the same vertices, edges and radii, to the last bit."""
    return all(
        np.array_equal(getattr(skeleton, name), getattr(other, name), equal_nan=name == "radii")
        for name in ("vertices", "edges", "radii")
    )


def is_of_sample(skeleton: Skeleton) -> bool:
    """Whether the points that a skeleton was made from stand for more, as those of `glsk_o3d.read_sample` do."""
    return 0 < len(skeleton.points) < skeleton.report.n_input


def rerun(skeleton: Skeleton, cloud: Any = None, **callbacks: Callable | None) -> Skeleton:
    """Make a skeleton again with the recipe in its report.

    Parameters
    ----------
    skeleton : Skeleton
        With its points, as it was computed or as a JSON or npz file holds it.
    cloud : cloud, optional
        Another cloud for the recipe; by default the skeleton's own points. These have passed the filters of clouds,
        which are then skipped.
    **callbacks : callable, optional
        Callbacks of the Pipeline.

    Returns
    -------
    Skeleton

    Raises
    ------
    RecipeError
        There is no recipe, or not a complete one; the message says what is missing.

    Warns
    -----
    SkeletonWarning
        The result on the skeleton's own points differs from it: other releases computed it.

    Examples
    --------
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import torus
    >>> skeleton = skeletonize(torus(1000).points)
    >>> bool((rerun(skeleton).vertices == skeleton.vertices).all())
    True
    """
    recipe = skeleton.report.recipe
    if not recipe:
        raise RecipeError(
            "it holds no recipe: .json and .npz results of glsk-o3d have one, but not those of old releases"
        )
    pipeline = from_recipe(recipe)
    try:
        pipeline.check_complete()
    except InvalidParameterError as error:
        raise RecipeError(f"pipeline: {error}") from None
    if cloud is not None:
        return pipeline(cloud, **callbacks)
    if not len(skeleton.points):
        raise RecipeError("it holds no points: give the scan")
    if is_of_sample(skeleton):
        raise RecipeError(
            "it holds a sample of a large cloud without the number of points that each represents: give the scan"
        )
    first = max((i for i, stage in enumerate(pipeline.stages) if stage.produces is Cloud), default=-1) + 1
    again = Pipeline(*pipeline.stages[first:])(skeleton.points, **callbacks)
    if first:
        skipped, report = pipeline.stages[:first], again.report
        recipe = recipe_of(*(stage.table() for stage in skipped), *report.recipe["pipeline"])
        report = dataclasses.replace(report, recipe=recipe, stages=(*map(repr, skipped), *report.stages))
        again = dataclasses.replace(again, report=report)
    if not identical(again, skeleton):
        then, now = skeleton.report.versions, again.report.versions
        others = [f"{name} {then.get(name)} instead of {now[name]}" for name in now if then.get(name) != now[name]]
        warnings.warn(
            f"the rerun differs from the result, which was made with {', '.join(others) or 'the same releases'}",
            SkeletonWarning,
            stacklevel=outside(),
        )
    return again
