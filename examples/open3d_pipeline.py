"""An Open3D pipeline with skeletons: crop, thin, cluster, a skeleton per cluster, annotate, write."""

import argparse
import sys
from pathlib import Path

import numpy as np
import open3d as o3d

import glsk_o3d as glsk


def legacy_objects(path, floor, voxel, gap, least):
    """The objects of a scene, with Open3D's first API."""
    scene = o3d.io.read_point_cloud(str(path))
    box = scene.get_axis_aligned_bounding_box()
    box.min_bound = (*box.min_bound[:2], floor)
    scene = scene.crop(box)
    scene = scene.voxel_down_sample(voxel)
    labels = np.asarray(scene.cluster_dbscan(eps=gap, min_points=8))  # -1 for single outliers
    objects = [scene.select_by_index(np.flatnonzero(labels == label)) for label in range(labels.max(initial=-1) + 1)]
    return [cloud for cloud in objects if len(cloud.points) >= least]


def tensor_objects(path, floor, voxel, gap, least):
    """The objects of a scene, with the tensor API: attributes such as the intensity come along."""
    scene = o3d.t.io.read_point_cloud(str(path))
    low, high = scene.get_min_bound(), scene.get_max_bound()
    low[2] = floor
    scene = scene.crop(o3d.t.geometry.AxisAlignedBoundingBox(low, high))
    scene = scene.voxel_down_sample(voxel)
    labels = scene.cluster_dbscan(eps=gap, min_points=8)
    objects = [scene.select_by_mask(labels == label) for label in range(labels.numpy().max(initial=-1) + 1)]
    return [cloud for cloud in objects if len(cloud.point.positions) >= least]


def main(path, folder, api="legacy", ground=0.0, voxel=None, gap=None, least=300):
    scene = glsk.read_cloud(path)  # says what is wrong where Open3D gives an empty cloud
    points = np.asarray(scene.points)
    points = points[points[:, 2] > ground]
    if len(points) == 0:
        sys.exit(f"error: {path}: no point lies above z = {ground:g}: give another --ground")
    voxel = voxel or np.linalg.norm(np.ptp(points, axis=0)) / 400
    gap = gap or max(5 * voxel, 4 * np.median(scene.compute_nearest_neighbor_distance()))
    floor = ground + voxel / 100  # the ground itself stays below
    objects = {"legacy": legacy_objects, "tensor": tensor_objects}[api](path, floor, voxel, gap, least)
    found = f"{len(objects)} of at least {least} points, {gap:.3g} apart, in cells of {voxel:.3g}"
    if not objects:
        sys.exit(f"error: {path}: no object found: {found}: try other values of --voxel, --gap and --least")
    print(f"objects: {found}")
    folder = Path(folder)
    folder.mkdir(exist_ok=True)
    for number, cloud in enumerate(objects):
        skeleton = glsk.skeletonize(cloud)

        # the cloud, every point with its branch: what Open3D does next goes by these attributes
        annotated = glsk.annotate(skeleton, cloud, color="branch")
        o3d.t.io.write_point_cloud(str(folder / f"{number}_cloud.ply"), annotated)
        table = glsk.analysis.branch_table(skeleton)
        longest = annotated.select_by_mask((annotated.point.branch == int(table.length.argmax())).reshape((-1,)))
        o3d.t.io.write_point_cloud(str(folder / f"{number}_longest.ply"), longest)

        # the skeleton: a graph to compute with, lines and tubes to look at, a table to read
        glsk.save_skeleton(skeleton, folder / f"{number}_skeleton.json")
        if len(skeleton.edges):  # a blob may become a single vertex, and Open3D writes no lines where there are none
            o3d.io.write_line_set(str(folder / f"{number}_lines.ply"), glsk.to_line_set(skeleton, color="radius"))
        o3d.io.write_triangle_mesh(str(folder / f"{number}_tubes.ply"), glsk.to_tubes(skeleton))
        table.to_csv(folder / f"{number}_branches.csv")
        print(f"object {number}: {len(skeleton.points)} points, {skeleton}")

        # a smaller cloud for whatever comes after, without the points that say little about the shape
        reduced, kept = glsk.remove_redundant_points(cloud)
        print(f"  reduced: {len(kept)} points are left of them: {reduced}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, epilog="Lengths are in the units of the scene.")
    parser.add_argument("path", metavar="SCENE", help="a point cloud that Open3D reads")
    parser.add_argument("folder", metavar="FOLDER", help="for the results; made if it is not there")
    parser.add_argument("api", nargs="?", choices=["legacy", "tensor"], default="legacy", help="of Open3D")
    parser.add_argument("--ground", type=float, default=0.0, help="only what is higher counts [%(default)s]")
    parser.add_argument("--voxel", type=float, help="cell to thin the scene with [1/400 of its diagonal]")
    parser.add_argument("--gap", type=float, help="how far apart objects are [5 cells, or 4 spacings of the points]")
    parser.add_argument("--least", type=int, default=300, help="points of the smallest object [%(default)s]")
    try:
        main(**vars(parser.parse_args()))
    except (OSError, glsk.GlskError) as error:
        sys.exit(f"error: {error}")
