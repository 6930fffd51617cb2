"""Runs repeated from the recipe in their report."""

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np

from ..errors import InvalidParameterError, RecipeError
from ..interop.clouds import Cloud
from ..pipeline import Pipeline
from ..skeleton import Skeleton
from .recipe import from_recipe


def identical(skeleton: Skeleton, other: Skeleton) -> bool:
    """Whether two skeletons have the same vertices, edges and radii, to the last bit."""
    pairs = [(getattr(skeleton, name), getattr(other, name)) for name in ("vertices", "edges", "radii")]
    return all(np.array_equal(one, two, equal_nan=True) for one, two in pairs)


def is_of_sample(skeleton: Skeleton) -> bool:
    """Whether the points that a skeleton was made from stand for more, as those of `glsk_o3d.read_sample` do."""
    return 0 < len(skeleton.points) < skeleton.report.n_input


def rerun(skeleton: Skeleton, cloud: Any = None, **callbacks: Callable | None) -> Skeleton:
    """Make a skeleton again with the recipe in its report: on the same machine with the same releases bit for bit.

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
        There is no recipe, or not a complete one, or not all points; the message says what is missing.

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
        raise RecipeError("it holds no recipe: results of glsk-o3d as .json and .npz have one")
    pipeline = from_recipe(recipe)
    try:
        pipeline.check_complete()
    except InvalidParameterError as error:
        raise RecipeError(f"pipeline: {error}") from None
    if cloud is not None:
        return pipeline(cloud, **callbacks)
    if not len(skeleton.points) or is_of_sample(skeleton):
        raise RecipeError("it does not hold all points, but none or a sample: give the scan")
    first = max((i for i, stage in enumerate(pipeline.stages) if stage.produces is Cloud), default=-1) + 1
    again = Pipeline(*pipeline.stages[first:])(skeleton.points, **callbacks)
    return dataclasses.replace(again, report=dataclasses.replace(again.report, recipe=recipe))
