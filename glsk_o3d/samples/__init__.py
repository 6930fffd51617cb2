"""Sample clouds with exactly known axes, from formulas.

Most shapes are unions of tapered capsules (the convex hull of two balls), so a shape *is* its axis: nodes, edges, and a
radius at every node. All clouds are uniform by area, reproducible through `seed`, and, but for the tree, about one unit
in size. An impossible shape raises InvalidParameterError.
"""

from collections.abc import Callable

from ..errors import InvalidParameterError
from .capsules import Sample, signed_distance
from .limbs import TWO_CAMERAS, sauropod, tree, y_junction
from .shapes import helix, sheet, sphere, torus, tube, two_rings

__all__ = ["SAMPLES", "TWO_CAMERAS", "Sample", "sample_object", "signed_distance"]
__all__ += ["helix", "sauropod", "sheet", "sphere", "torus", "tree", "tube", "two_rings", "y_junction"]

SAMPLES: dict[str, Callable[..., Sample]] = {
    shape.__name__: shape for shape in (sauropod, tube, torus, helix, y_junction, two_rings, tree, sphere, sheet)
}
"""Every sample by its name; each takes at least ``n``, ``noise`` and ``seed``."""


def sample_object(n: int = 8192, noise: float = 0.002, seed: int = 0, name: str = "sauropod") -> Sample:
    """The object of ``glsk demo``, or another sample by its name.

    Parameters
    ----------
    n : int
        Number of points.
    noise : float
        Standard deviation of the Gaussian noise on every coordinate, as a share of the bounding-box diagonal.
    seed : int
        Of the random numbers.
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
