"""Random shapes with exactly known axes: twelve families, as many shapes as there are seeds.

Examples
--------
>>> from glsk_bench.shapes import FAMILIES, shape
>>> FAMILIES["v1"]
('tubes', 'trees', 'frames', 'figures', 'handles', 'groups')
>>> shape("groups", 0)
Shape('groups_0': 2 components, 0 loops, 4 leaves)
>>> FAMILIES["v2"]
('prisms', 'implements', 'animals', 'plates', 'blades', 'mugs')
>>> shape("plates", 0)
"""

from .drawing import FAMILIES, Shape, Thing, shape

__all__ = ["FAMILIES", "Shape", "Thing", "shape"]
