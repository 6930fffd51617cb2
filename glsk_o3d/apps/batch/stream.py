"""Skeletons of clouds that come one after the other, as from a camera."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Future
from typing import Any

from ...api import PipelineChoice, chosen_pipeline
from ...data.report import warn
from ...data.skeleton import Skeleton
from ...errors import BatchError
from ...interop.clouds import open3d_class, surface_mesh
from ...parameters import check_number
from ...pipeline import Pipeline
from ...recipes import from_recipe, to_recipe
from .workers import Workers

CLOSED = "the Skeletonizer was closed before its stream was at an end"


class Skeletonizer:
    """Skeletons of clouds as they come, in their order, by several processes at a time.

    Nothing is kept from one cloud to the next: every skeleton is the one that `glsk_o3d.skeletonize` gives, to the bit.
    Processes and not threads, because most of the time Python itself is busy.

    Parameters
    ----------
    pipeline : as of `glsk_o3d.skeletonize`
        With several workers every filter must be one that a recipe can hold.
    workers : int
        Processes. They start with the first cloud, which takes a second or two; 1 starts none. In a script, several
        must begin under ``if __name__ == "__main__"``, since every one imports it.
    **options
        Parameters of the filters, by name.

    Raises
    ------
    InvalidParameterError, RecipeError
        As of `glsk_o3d.skeletonize` and `glsk_o3d.to_recipe`.

    Examples
    --------
    >>> from glsk_o3d.apps.batch import Skeletonizer
    >>> from glsk_o3d.samples import torus
    >>> frames = (torus(500, seed=seed).points for seed in range(3))
    >>> with Skeletonizer(k=10) as skeletonizer:
    ...     [skeleton.n_loops for skeleton in skeletonizer.stream(frames)]
    [1, 1, 1]
    """

    def __init__(self, pipeline: PipelineChoice = "default", *, workers: int = 1, **options: Any) -> None:
        check_number("workers", workers, "int", low=1)
        self.pipeline: Pipeline[Any, Skeleton] = chosen_pipeline(pipeline, options)
        self._count, self._pool = workers, Workers(workers)
        self._recipe = to_recipe(self.pipeline) if workers > 1 else {}

    def __enter__(self) -> Skeletonizer:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """End the processes when they have done what they do; a later stream starts others."""
        pool, self._pool = self._pool, Workers(self._count)
        pool.close(at_once=False)  # a process that is killed while it sends leaves the other end waiting for ever

    def stream(self, clouds: Iterable[Any]) -> Iterator[Skeleton]:
        """Skeletons of some clouds, in their order.

        With several workers, as many clouds are taken ahead: each skeleton comes so many clouds late. Other processes
        see the points and, of a tensor cloud, its attributes.

        Parameters
        ----------
        clouds : iterable of clouds, each as of `glsk_o3d.skeletonize`

        Raises
        ------
        InvalidCloudError
            Where a cloud cannot be skeletonised. That ends the stream: the skeletons before it were given, and clouds
            taken ahead are lost. Another stream may go on with those that follow.
        BatchError
            With several workers: a process died, or the Skeletonizer was closed.
        """
        if self._count == 1:
            yield from map(self.pipeline, clouds)
            return
        pool, waiting = self._pool, deque[Future[Skeleton]]()

        def futures() -> Iterator[Future[Skeleton]]:
            try:
                for cloud in clouds:
                    if pool is not self._pool:
                        raise BatchError(CLOSED)
                    if open3d_class(cloud) != ("PointCloud", True):  # Open3D's others cannot be sent to a process
                        cloud = surface_mesh(cloud)
                    yield pool.submit(_skeletonized, self._recipe, cloud)
            except Exception as error:  # of a cloud, or of what gives them: it is raised after what is underway
                failed = Future[Skeleton]()
                failed.set_exception(error)
                yield failed

        try:
            for future in futures():
                waiting.append(future)
                if len(waiting) > self._count:
                    yield _result(waiting.popleft())
            while waiting:
                yield _result(waiting.popleft())
        finally:
            for future in waiting:
                future.cancel()


def _skeletonized(recipe: dict[str, Any], cloud: Any) -> Skeleton:
    """A skeleton, in another process."""
    skeleton: Skeleton = from_recipe(recipe)(cloud)
    return skeleton


def _result(future: Future[Skeleton]) -> Skeleton:
    """What another process has made, with the warnings that nobody heard there."""
    try:
        skeleton = future.result()
    except CancelledError:
        raise BatchError(CLOSED) from None
    except BrokenExecutor as error:
        raise BatchError("a process that skeletonises the stream died, perhaps for want of memory") from error
    warn(skeleton.report.warnings)
    return skeleton
