"""Random shapes with exactly known axes: fourteen families, as many shapes as there are seeds.

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
Shape('plates_0': 1 component, 4 loops, 0 leaves)
>>> FAMILIES["v3"][6:]
('toys', 'rings')
"""

from .drawing import FAMILIES, Shape, Thing, shape

__all__ = ["FAMILIES", "Shape", "Thing", "shape"]
