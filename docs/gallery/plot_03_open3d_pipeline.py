"""
Two objects on a table, with Open3D
===================================

A scene with two objects on a table: Open3D thins it and finds the table and the clusters. Each cluster gets a skeleton,
as objects that Open3D works with.
"""

import matplotlib.pyplot as plt
import numpy as np
import open3d as o3d
from mpl_toolkits.mplot3d.art3d import Line3DCollection

import glsk_o3d as glsk
from glsk_o3d import samples

# %%
# The scene: a Y, a torus, the table, and outliers.

rng = np.random.default_rng(0)
table = np.column_stack(
    [rng.uniform([-0.7, -0.6], [1.9, 0.6], (6000, 2)), rng.normal(scale=0.002, size=6000)]
)
scene = o3d.geometry.PointCloud()
scene.points = o3d.utility.Vector3dVector(
    np.concatenate(
        [
            samples.y_junction(8000, noise=0.001).points + [0, 0, 0.65],
            samples.torus(8000, noise=0.001).points + [1.2, 0, 0.25],
            table,
            rng.uniform([-0.7, -0.6, 0.1], [1.9, 0.6, 1.3], (40, 3)),
        ]
    )
)

# %%
# Open3D finds the objects. ``cluster_dbscan`` gives single outliers the label -1.

o3d.utility.random.seed(0)
scene = scene.voxel_down_sample(0.012)
plane, on_table = scene.segment_plane(distance_threshold=0.02, ransac_n=3, num_iterations=200)
objects = scene.select_by_index(on_table, invert=True)
labels = np.asarray(objects.cluster_dbscan(eps=0.06, min_points=8))
clusters = [
    objects.select_by_index(np.flatnonzero(labels == label)) for label in range(labels.max() + 1)
]
clusters = [cluster for cluster in clusters if len(cluster.points) > 300]
print(f"table {plane.round(2)}, {len(clusters)} objects")

# %%
# ``skeletonize`` takes each cloud as it is. ``annotate`` returns a copy with branch and radius of every point.
# ``o3d.visualization.draw_geometries`` draws line sets and tubes.

skeletons = [glsk.skeletonize(cluster) for cluster in clusters]
for cluster, skeleton in zip(clusters, skeletons, strict=True):
    annotated = glsk.annotate(skeleton, cluster, color="branch")
    lines, tubes = glsk.to_line_set(skeleton, color="branch"), glsk.to_tubes(skeleton)
    print(skeleton, annotated.point, lines, tubes, sep="\n  ")

# %%
# Left the scene, right the clusters and their skeletons.

figure = plt.figure(figsize=(11, 3.6), layout="constrained")
left, right = (figure.add_subplot(1, 2, place, projection="3d") for place in (1, 2))
glsk.plot_skeleton(None, left, cloud=scene).set_title("the scene, thinned")
glsk.plot_skeleton(None, right, cloud=sum(clusters, o3d.geometry.PointCloud())).set_title(
    "objects and skeletons"
)
for skeleton in skeletons:
    lines = glsk.to_line_set(skeleton, color="branch")
    ends, colours = np.asarray(lines.points)[np.asarray(lines.lines)], np.asarray(lines.colors)
    right.add_collection(
        Line3DCollection(ends, colors=colours, linewidths=2, zorder=2, clip_on=False)
    )
plt.show()
