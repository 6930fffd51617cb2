"""Sample clouds with exactly known axes, made from formulas: to try things on, to test with, to draw.

Most shapes are unions of tapered capsules (the convex hull of two balls), so a shape *is* its axis: nodes, edges, and a
radius at every node. All clouds are uniform by area, reproducible through `seed`, and, but for the tree, about one unit
in size.

Examples
--------
>>> from glsk_o3d.samples import sample_object
>>> toy = sample_object(n=2000)
>>> toy
Sample('sauropod', 2000 points, 54 nodes, 54 edges)
"""

from .by_name import SAMPLES, sample_object
from .capsules import signed_distance
from .sample import Sample
from .sauropod import TWO_CAMERAS, sauropod
from .shapes import helix, sheet, sphere, tube, y_junction
from .tori import torus, two_rings
from .trees import tree

__all__ = [
    "SAMPLES",
    "TWO_CAMERAS",
    "Sample",
    "helix",
    "sample_object",
    "sauropod",
    "sheet",
    "signed_distance",
    "sphere",
    "torus",
    "tree",
    "tube",
    "two_rings",
    "y_junction",
]
