"""The named pipelines: the recommended one, those for control loops and for trees, the paper, and the baseline."""

from collections.abc import Callable
from typing import Any

import numpy as np

from .curve.numbers import CURVE
from .data.contraction import Contraction
from .data.skeleton import Skeleton
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
from .parameters import Parameters
from .pipeline import Pipeline


def cao2010() -> Pipeline[Cloud, Skeleton]:
    """The baseline: contraction without reduction, stopped by the ring sizes (Cao et al. 2010).

    Examples
    --------
    >>> cao2010().stages[2].reducer is None
    True
    """
    return _published(stop=RingSizeRatio(), max_iterations=20)


def wen2024() -> Pipeline[Cloud, Skeleton]:
    """GLSkeleton as published (Wen et al. 2024), with the choices of the authors' code where it differs from the paper.

    Merges visit the points in the order of the input and drop the mass of merged points. The stopping rule waits for
    the fourth solve. docs/differences.md lists every difference.

    Examples
    --------
    >>> wen2024().stages[2].reducer.conserve_mass
    False
    """
    reducer = LPRReducer(conserve_mass=False, order="index", mend_rings=False)
    return _published(reducer=reducer, stop=ExplainedScore(threshold=0.02))


def _published(**contraction: Any) -> Pipeline[Cloud, Skeleton]:
    """What both published pipelines have in common: none of what this package adds."""
    return (
        Sampler(size="all", frame="box")
        | RingBuilder(k="published")
        | Contractor(line_hold=1, keep_last=False, retries=0, **contraction)
        | Connector(radius="2%", thickness=0, links="nearest", shut=1)
        | Refiner(collapse="degree", handle=0, air=0, bridge=0, limb=0, spacing=0, recentre=0)
    )


def default() -> Pipeline[Cloud, Skeleton]:
    """The recommended pipeline: GLSkeleton with conserved mass, a fit to the axis and a test of the topology.

    Examples
    --------
    >>> from glsk_o3d.samples import torus
    >>> default()(torus(1000).points).n_loops
    1
    """
    return _graph() | Refiner() | Tracer()


def fast() -> Pipeline[Cloud, Skeleton]:
    """For control loops: at most a third of the time of `default` from 2000 points on; docs/speed.md has its accuracy.

    Two solves contract a sample of about 800 points, half as strongly as in `default`. Only the questions about loops
    and limbs are asked, and no fit to the axis follows: loops and limbs are right more often than places. The Denoiser
    is left out, since the neighbours in such a sample are far apart, and the Tracer, since thin parts have no surface
    in it. Clouds of up to 1600 points are taken whole, which takes longer.

    Examples
    --------
    >>> from glsk_o3d.samples import torus
    >>> ring = fast()(torus(4000).points)
    >>> ring.n_loops, ring.report.n_sampled < 1000
    (1, True)
    """
    contractor = Contractor(max_iterations=2, initial_contraction=0.1)
    refiner = Refiner(recentre=0, handle=0.2, limb=0.35, air=0, bridge=0, set_aside=False)
    return Sampler(size=800) | OutlierRemover() | RingBuilder() | contractor | Connector(shut=1) | refiner


def tree(root: str | Any = "z") -> Pipeline[Cloud, Skeleton]:
    """One rooted tree, for trees and plants: the result of `default` with gaps joined and loops closed.

    It assumes that all points are of one plant. Remove ground, pot and neighbours first.

    Parameters
    ----------
    root : str or (x, y, z)
        As the option ``root`` of `Tracer`; by default the lowest place in z.

    Examples
    --------
    >>> from glsk_o3d.samples import y_junction
    >>> grown = tree()(y_junction(1000).points)
    >>> grown.n_components, grown.n_loops, len(grown.leaves)
    (1, 0, 3)
    """
    if isinstance(root, np.ndarray):
        root = root.tolist()
    return _graph(shut=1) | Refiner(handle=1) | Tracer(root=tuple(root) if isinstance(root, list) else root)


def _graph(**connection: Any) -> Pipeline[Cloud, Skeleton]:
    """The raw graph of `default`. Its merges wait for large clouds: which pairs they take hangs on the least change."""
    return rings() | Contractor(reducer=LPRReducer(least=2 * CURVE.enough_points)) | Connector(**connection)


def rings() -> Pipeline[Cloud, Contraction]:
    """From a cloud to its rings, with outliers, noise and surplus points removed: the start of `default`.

    Examples
    --------
    >>> from glsk_o3d.samples import torus
    >>> state = (rings() | Contractor())(torus(1000).points)
    >>> len(state.contracted)
    1000
    """
    return Sampler() | OutlierRemover() | Denoiser() | Thinner() | RingBuilder()


PIPELINES: dict[str, Callable[[], Pipeline[Cloud, Skeleton]]] = {
    make.__name__: make for make in (default, fast, tree, wen2024, cao2010)
}

BUILTIN: dict[str, type[Parameters]] = {
    cls.__name__: cls
    for cls in (
        *(Sampler, OutlierRemover, Denoiser, Thinner, RingBuilder),
        *(Contractor, LPRReducer, Connector, Refiner, Tracer, ExplainedScore, RingSizeRatio),
    )
}
"""The filters and stopping rules of this package, in the order in which they run."""
