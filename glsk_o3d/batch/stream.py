"""Skeletons of clouds that come one after the other, as from a camera."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import BrokenExecutor, Future
from typing import Any

import numpy as np

from ..driver import PipelineChoice, chosen_pipeline
from ..errors import BatchError
from ..interop.clouds import cloud_points
from ..parameters import check_number
from ..pipeline import Pipeline
from ..recipes import from_recipe, to_recipe
from ..report import warn
from ..skeleton import Skeleton
from .workers import LocalWorkers


class Skeletonizer:
    """Skeletons of clouds as they come, in their order, by several processes at a time.

    Nothing is kept from one cloud to the next: every skeleton is the one that `glsk_o3d.skeletonize` gives, to the bit.
    Processes and not threads, because most of the time Python itself is busy.

    Parameters
    ----------
    pipeline : as of `glsk_o3d.skeletonize`
        With several workers every filter must be one that a recipe can hold.
    workers : int
        Processes. They start with the first cloud, which takes a second or two; 1 starts none.
    **options
        Parameters of the filters, by name.

    Raises
    ------
    InvalidParameterError, RecipeError
        As of `glsk_o3d.skeletonize` and `glsk_o3d.to_recipe`.

    Examples
    --------
    >>> from glsk_o3d.batch import Skeletonizer
    >>> from glsk_o3d.samples import torus
    >>> frames = (torus(500, seed=seed).points for seed in range(3))
    >>> with Skeletonizer(k=10) as skeletonizer:
    ...     [skeleton.n_loops for skeleton in skeletonizer.stream(frames)]
    [1, 1, 1]
    """

    def __init__(self, pipeline: PipelineChoice = "default", *, workers: int = 1, **options: Any) -> None:
        check_number("workers", workers, "int", low=1)
        self.pipeline: Pipeline[Skeleton] = chosen_pipeline(pipeline, options)
        self._count, self._pool = workers, LocalWorkers(workers)
        self._recipe = to_recipe(self.pipeline) if workers > 1 else {}

    def __enter__(self) -> Skeletonizer:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """End the processes; a later stream starts others."""
        self._pool.close(at_once=True)
        self._pool = LocalWorkers(self._count)

    def stream(self, clouds: Iterable[Any]) -> Iterator[Skeleton]:
        """Skeletons of some clouds, each as soon as it and all before it are there.

        As many clouds are taken ahead as there are workers, so that one that is waited for, such as the next frame of a
        camera, holds back the skeletons of those before it.

        Parameters
        ----------
        clouds : iterable of clouds, each as of `glsk_o3d.skeletonize`

        Raises
        ------
        InvalidCloudError
            Where a cloud cannot be skeletonised; the skeletons before it were given.
        BatchError
            A process died.
        """
        waiting = deque[Future[Skeleton]]()
        for cloud in clouds:
            if self._count == 1:
                yield self.pipeline(cloud)
                continue
            waiting.append(self._pool.submit(_skeletonized, self._recipe, cloud_points(cloud)))
            if len(waiting) > self._count:
                yield _told(waiting.popleft())
        while waiting:
            yield _told(waiting.popleft())


def _skeletonized(recipe: dict[str, Any], points: np.ndarray) -> Skeleton:
    """A skeleton, in another process."""
    skeleton: Skeleton = from_recipe(recipe)(points)
    return skeleton


def _told(future: Future[Skeleton]) -> Skeleton:
    """What another process has made, with the warnings that nobody heard there."""
    try:
        skeleton = future.result()
    except BrokenExecutor as error:
        raise BatchError("a process that skeletonises the stream died, perhaps for want of memory") from error
    warn(skeleton.report.warnings)
    return skeleton
