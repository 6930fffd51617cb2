"""Random shapes with exactly known axes: six families, as many shapes as there are seeds.

Examples
--------
>>> from glsk_bench.shapes import FAMILIES, shape
>>> FAMILIES
('tubes', 'trees', 'frames', 'figures', 'handles', 'groups')
>>> shape("groups", 0)
Shape('groups_0': 2 components, 0 loops, 4 leaves)
"""

from .drawing import FAMILIES, Shape, shape

__all__ = ["FAMILIES", "Shape", "shape"]
