"""The named pipelines: the paper's baseline, the paper, and what we recommend."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from .connector import Connector
from .contractor import Contractor
from .errors import InvalidParameterError
from .lpr_reducer import LPRReducer
from .refiner import Refiner
from .ring_builder import RingBuilder
from .stopping import ExplainedScore, RingSizeRatio

if TYPE_CHECKING:
    from .pipeline import Pipeline


def cao2010() -> Pipeline:
    """The baseline: contraction without reduction, stopped by the ring sizes (Cao et al. 2010).

    Examples
    --------
    >>> cao2010().stages[1].reducer is None
    True
    """
    return (
        RingBuilder(k="published", thin_to="all", outlier_factor=0, denoise=0, frame="box")
        | Contractor(stop=RingSizeRatio(), max_iterations=20, min_attraction=0, line_hold=1, keep_last=False, retries=0)
        | Connector(radius="2%", thickness=0, links="nearest", stray=0)
        | Refiner(opening=0, twig=0, spacing=0, recentre=0, weak=0, sure=0, bridge=0)
    )


def wen2024() -> Pipeline:
    """GLSkeleton as published (Wen et al. 2024), with the choices of the authors' code where it differs from the paper.

    Merges visit the points in the order of the input and drop the mass of what they merge; the stopping rule waits for
    the fourth solve. The pages of the filters list every difference.

    Examples
    --------
    >>> wen2024().stages[1].reducer.conserve_mass
    False
    """
    return (
        RingBuilder(k="published", thin_to="all", outlier_factor=0, denoise=0, frame="box")
        | Contractor(
            reducer=LPRReducer(conserve_mass=False, order="index", mend_rings=False),
            reduce_above=0,
            stop=ExplainedScore(threshold=0.02),
            min_attraction=0,
            line_hold=1,
            keep_last=False,
            retries=0,
        )
        | Connector(radius="2%", thickness=0, links="nearest", stray=0)
        | Refiner(opening=0, twig=0, spacing=0, recentre=0, weak=0, sure=0, bridge=0)
    )


def default() -> Pipeline:
    """What we recommend: GLSkeleton with the mass of merged points kept and the vertices centred in the surface.

    Examples
    --------
    >>> from glsk_o3d.samples import torus
    >>> default()(torus(1000).points).n_loops
    1
    """
    return RingBuilder() | Contractor(reducer=LPRReducer(), stop=ExplainedScore()) | Connector() | Refiner()


PIPELINES: dict[str, Callable[[], Pipeline]] = {"default": default, "wen2024": wen2024, "cao2010": cao2010}


def known_pipelines() -> dict[str, Callable[[], Pipeline]]:
    """All pipelines by name, those of plugins after the built-in ones.

    Returns
    -------
    dict of str to callable
        Each makes a Pipeline.
    """
    from .plugins import plugin_pipelines

    return {**PIPELINES, **plugin_pipelines()}


def named_pipeline(name: str) -> Pipeline:
    """The pipeline of that name, built in or of a plugin.

    Parameters
    ----------
    name : str

    Returns
    -------
    Pipeline

    Raises
    ------
    InvalidParameterError
        If there is none; the message says which was meant, or lists the names.
    """
    from .catalogue import nearest

    make = PIPELINES.get(name) or known_pipelines().get(name)
    if make is None:
        raise InvalidParameterError(nearest(name, known_pipelines(), "pipeline"))
    return make()
