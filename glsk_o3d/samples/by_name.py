"""Samples by their names."""

from __future__ import annotations

from collections.abc import Callable

from ..errors import InvalidParameterError
from .sample import Sample
from .sauropod import sauropod
from .shapes import helix, sheet, sphere, tube, y_junction
from .tori import torus, two_rings
from .trees import tree

SAMPLES: dict[str, Callable[..., Sample]] = {
    shape.__name__: shape for shape in (sauropod, tube, torus, helix, y_junction, two_rings, tree, sphere, sheet)
}
"""Every sample by its name; each takes at least ``n``, ``noise`` and ``seed``."""


def sample_object(n: int = 8192, noise: float = 0.002, seed: int = 0, name: str = "sauropod") -> Sample:
    """The object of ``glsk demo``, or any other sample by its name.

    Parameters
    ----------
    n : int
        Number of points.
    noise : float
        Standard deviation of the Gaussian noise on every coordinate, as a share of the bounding-box diagonal.
    seed : int
    name : str
        One of `SAMPLES`.

    Returns
    -------
    Sample

    Examples
    --------
    >>> sample_object(500)
    Sample('sauropod', 500 points, 54 nodes, 54 edges)
    """
    if name not in SAMPLES:
        raise InvalidParameterError(f"no sample is called {name!r}; there are {', '.join(SAMPLES)}")
    return SAMPLES[name](n=n, noise=noise, seed=seed)
