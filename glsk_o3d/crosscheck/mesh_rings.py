"""One-rings of triangle meshes, manifold or not."""

import numpy as np

from ..numerics.groups import component_labels
from ..numerics.rings import Rings


def clean_faces(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Triangles with an area, each once, (g, 3) int64 array, in the order and with the orientation of their first copy.

    Vertices without a triangle stay, so that rows keep their meaning.
    """
    faces = np.asarray(faces, np.int64).reshape(-1, 3)
    first = np.sort(np.unique(np.sort(faces, axis=1), axis=0, return_index=True)[1])
    a, b, c = points[faces[first]].transpose(1, 0, 2)
    return faces[first[np.cross(b - a, c - a).any(axis=1)]]


def umbrellas(n: int, faces: np.ndarray) -> np.ndarray:
    """Vertices whose triangles make one closed umbrella, (n,) bool array: neither border nor fan of fans nor bare.

    The faces, (f, 3) int array, are as from `clean_faces`.
    """
    corner = np.concatenate([faces, faces[:, [1, 2, 0]], faces[:, [2, 0, 1]]])  # each triangle from all its corners
    ends = np.concatenate([corner[:, [0, 1]], corner[:, [0, 2]]])
    spoke, row, count = np.unique(ends @ [n, 1], return_inverse=True, return_counts=True)
    fan = component_labels(len(spoke), row.reshape(2, -1).T)  # spokes that triangles lead between are in one
    odd = np.bincount(spoke // n, count != 2, n) > 0
    vertex_of_fan = np.unique(np.column_stack([spoke // n, fan]), axis=0)[:, 0]
    return ~odd & (np.bincount(vertex_of_fan, minlength=n) == 1)


def mesh_rings(n: int, faces: np.ndarray) -> Rings:
    """The neighbours of every vertex of a mesh of `clean_faces` as Rings; every vertex needs a face.

    They are ascending, not in rotational order, since there may be none: `triangles` mean nothing.
    """
    edges = faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)  # the sides of every triangle
    centre, neighbour = np.unique(np.concatenate([edges, edges[:, ::-1]]), axis=0).T
    return Rings(np.searchsorted(centre, np.arange(n + 1)), neighbour, umbrellas(n, faces))
