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


def sides(faces: np.ndarray) -> np.ndarray:
    """The sides of every triangle in its direction, (3 f, 2) int array."""
    return np.concatenate([faces[:, pair] for pair in ([0, 1], [1, 2], [2, 0])])


def corners(faces: np.ndarray) -> np.ndarray:
    """Every triangle from each of its corners, (3 f, 3) int array: a vertex and the two others, the smaller first."""
    corner = np.concatenate([faces, faces[:, [1, 2, 0]], faces[:, [2, 0, 1]]])
    corner[:, 1:] = np.sort(corner[:, 1:], axis=1)
    return corner


def spokes(n: int, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Each edge of a mesh of `clean_faces` from both ends: that end, the other, its triangles, its fan: (2 e,) arrays.

    Spokes of a vertex are in one fan if triangles lead from one to the other.
    """
    corner = corners(faces)
    ends = np.concatenate([corner[:, [0, 1]], corner[:, [0, 2]]])
    spoke, row, count = np.unique(ends @ [n, 1], return_inverse=True, return_counts=True)
    return spoke // n, spoke % n, count, component_labels(len(spoke), row.reshape(2, -1).T)


def umbrellas(n: int, faces: np.ndarray) -> np.ndarray:
    """Vertices whose triangles make one closed umbrella, (n,) bool array: neither border nor fan of fans nor bare.

    The faces, (f, 3) int array, are as from `clean_faces`.
    """
    vertex, _, count, fan = spokes(n, faces)
    odd = np.bincount(vertex, count != 2, n) > 0
    vertex_of_fan = np.unique(np.column_stack([vertex, fan]), axis=0)[:, 0]
    return ~odd & (np.bincount(vertex_of_fan, minlength=n) == 1)


def border_lengths(n: int, faces: np.ndarray) -> np.ndarray:
    """How many edges the border has that each vertex is on, (n,) int array: 0 inside, 3 at a hole of one triangle.

    The faces, (f, 3) int array, are as from `clean_faces`.
    """
    edges, count = np.unique(np.sort(sides(faces), axis=1), axis=0, return_counts=True)
    label = component_labels(n, edges[count == 1])
    return np.bincount(label[edges[count == 1, 0]], minlength=n)[label]


def mesh_rings(n: int, faces: np.ndarray) -> Rings:
    """The neighbours of every vertex of a mesh of `clean_faces` as Rings; every vertex needs a face.

    They are ascending, not in rotational order, since there may be none: `triangles` mean nothing.
    """
    edges = sides(faces)
    centre, neighbour = np.unique(np.concatenate([edges, edges[:, ::-1]]), axis=0).T
    return Rings(np.searchsorted(centre, np.arange(n + 1)), neighbour, umbrellas(n, faces))


def common_share(rings: Rings, faces: np.ndarray) -> np.ndarray:
    """How much of each ring is in the mesh of `clean_faces`: triangles in both over triangles in either, (n,).

    1 where the ring and the mesh's one-ring have the same neighbours in the same cyclic order, whichever way they are
    walked; 0 where there is no triangle at all.
    """
    n = len(rings)
    fans = rings.triangles
    fans[:, 1:] = np.sort(fans[:, 1:], axis=1)
    key = [n * n, n, 1]  # three indices below 2 million in 63 bits
    in_rings, in_mesh = (np.unique(corner @ key) for corner in (fans, corners(faces)))
    ours, theirs, both = (
        np.bincount(keys // (n * n), minlength=n)
        for keys in (in_rings, in_mesh, np.intersect1d(in_rings, in_mesh, assume_unique=True))
    )
    return both / np.maximum(ours + theirs - both, 1)
