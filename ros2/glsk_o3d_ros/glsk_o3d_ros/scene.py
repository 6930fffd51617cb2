"""The parts of a scene: a sample of its points, its largest plane, its largest cluster."""

from __future__ import annotations

import numpy as np

from glsk_o3d.interop.packages import import_open3d

CELLS_PER_GAP = 3  # chosen: points of a cell are less than 0.6 gaps apart, and all of a dense one in one cluster
DENSE = 10  # published: min_points of DBSCAN in `glsk_o3d.analysis.scene_objects`


def sample(points: np.ndarray, size: int) -> np.ndarray:
    """At most `size` of the points, (N, 3) float array, at random and in their order."""
    if len(points) <= size:
        return points
    return points[np.sort(np.random.default_rng(0).choice(len(points), size, replace=False))]


def largest_plane(points: np.ndarray, distance: float) -> np.ndarray:
    """The plane a x + b y + c z + d = 0 with the most points within a distance, (4,) float array."""
    import_open3d().utility.random.seed(0)
    plane, _ = _open3d_cloud(points).segment_plane(distance, ransac_n=3, num_iterations=500)
    return np.asarray(plane)


def largest_cluster(points: np.ndarray, gap: float) -> np.ndarray:
    """Which points are of the largest cluster, (N,) bool array: none if there is no cluster.

    DBSCAN sees as many points of a cell as make it dense: the pairs of all would grow with the square of their number.
    """
    cells = np.floor(points * (CELLS_PER_GAP / gap)).astype(int)
    _, cell, counts = np.unique(cells, axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(cell.ravel(), kind="stable")
    rank_in_cell = np.arange(len(points)) - np.repeat(np.cumsum(counts) - counts, counts)
    seen = order[rank_in_cell < DENSE]
    label_of_cell = np.empty(len(counts), int)
    label_of_cell[cell.ravel()[seen]] = _open3d_cloud(points[seen]).cluster_dbscan(gap, DENSE)
    label = label_of_cell[cell.ravel()]
    return label == np.argmax(np.bincount(label + 1, minlength=2)[1:])


def _open3d_cloud(points):
    o3d = import_open3d()
    return o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
