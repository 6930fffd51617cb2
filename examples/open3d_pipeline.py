"""An Open3D pipeline with skeletons dropped in: crop, thin, clean, cluster, a skeleton per cluster, annotate, write.

    python examples/open3d_pipeline.py SCENE.ply FOLDER [legacy | tensor]

The scene is cropped to the space above the ground (z > 0). Lengths are in its units.
"""

import sys
from pathlib import Path

import numpy as np
import open3d as o3d

import glsk_o3d as glsk

VOXEL, APART, LEAST = 0.012, 0.06, 300  # voxel size, gap between objects, points of the smallest object


def legacy_objects(path):
    """The objects of a scene, with Open3D's first API."""
    scene = o3d.io.read_point_cloud(str(path))
    box = scene.get_axis_aligned_bounding_box()
    box.min_bound = (*box.min_bound[:2], 1e-6)
    scene = scene.crop(box)
    scene = scene.voxel_down_sample(VOXEL)
    scene, _ = scene.remove_statistical_outlier(nb_neighbors=16, std_ratio=3.0)
    labels = np.asarray(scene.cluster_dbscan(eps=APART, min_points=8))
    objects = [scene.select_by_index(np.flatnonzero(labels == label)) for label in range(labels.max() + 1)]
    return [cloud for cloud in objects if len(cloud.points) >= LEAST]


def tensor_objects(path):
    """The objects of a scene, with the tensor API: attributes such as the intensity come along."""
    scene = o3d.t.io.read_point_cloud(str(path))
    low, high = scene.get_min_bound(), scene.get_max_bound()
    low[2] = 1e-6
    scene = scene.crop(o3d.t.geometry.AxisAlignedBoundingBox(low, high))
    scene = scene.voxel_down_sample(VOXEL)
    scene, _ = scene.remove_statistical_outliers(nb_neighbors=16, std_ratio=3.0)
    labels = scene.cluster_dbscan(eps=APART, min_points=8)
    objects = [scene.select_by_mask(labels == label) for label in range(labels.max().item() + 1)]
    return [cloud for cloud in objects if len(cloud.point.positions) >= LEAST]


def main(path, folder, api="legacy"):
    folder = Path(folder)
    folder.mkdir(exist_ok=True)
    objects = {"legacy": legacy_objects, "tensor": tensor_objects}[api](path)
    for number, cloud in enumerate(objects):
        skeleton = glsk.skeletonize(cloud)

        # the cloud, every point with its branch: what Open3D does next goes by these attributes
        annotated = skeleton.annotate(cloud, color="branch")
        o3d.t.io.write_point_cloud(str(folder / f"{number}_cloud.ply"), annotated)
        table = skeleton.branch_table()
        longest = annotated.select_by_mask((annotated.point.branch == int(table.length.argmax())).reshape((-1,)))
        o3d.t.io.write_point_cloud(str(folder / f"{number}_longest.ply"), longest)

        # the skeleton: a graph to compute with, lines and tubes to look at, a table to read
        skeleton.save(folder / f"{number}_skeleton.json")
        if len(skeleton.edges):  # a blob may become a single vertex, and Open3D writes no lines where there are none
            o3d.io.write_line_set(str(folder / f"{number}_lines.ply"), skeleton.to_line_set(color="radius"))
        o3d.io.write_triangle_mesh(str(folder / f"{number}_tubes.ply"), skeleton.to_tubes())
        table.to_csv(folder / f"{number}_branches.csv")
        print(f"object {number}: {len(skeleton.points)} points, {skeleton}")

        # a smaller cloud for whatever comes after, without the points that say little about the shape
        reduced, kept = glsk.remove_redundant_points(cloud)
        print(f"  reduced: {len(kept)} points are left of them: {reduced}")


if __name__ == "__main__":
    main(*sys.argv[1:])
