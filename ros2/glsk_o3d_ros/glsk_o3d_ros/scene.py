"""The parts of a scene: a sample of its points, its largest plane, its largest cluster."""

from __future__ import annotations

import numpy as np

from glsk_o3d.interop.packages import import_open3d

CELLS_PER_GAP = 5  # derived: a line has 11 cells within the gap to both sides, and is dense to DBSCAN
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

    DBSCAN sees one point per cell, for the number of its pairs would grow with the square of the points within the gap.
    """
    cells = np.floor(points * (CELLS_PER_GAP / gap)).astype(int)
    _, representative, cell = np.unique(cells, axis=0, return_index=True, return_inverse=True)
    labels = np.array(_open3d_cloud(points[representative]).cluster_dbscan(gap, DENSE), int)[cell.ravel()]
    counts = np.bincount(labels + 1, minlength=2)
    return labels == np.argmax(counts[1:])


def _open3d_cloud(points):
    o3d = import_open3d()
    return o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
