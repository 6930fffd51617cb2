"""
A scan that moves: bones and skin
=================================

A rigger's day: a scanned animal without bones becomes a mesh with an armature, in a file that Blender opens.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import numpy as np
import open3d as o3d
import pygltflib

import glsk_o3d as glsk
from glsk_o3d import samples

# %%
# A scan and its surface: Poisson's, from the points and normals.

animal = samples.sauropod(20000)
cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(animal.points))
cloud.estimate_normals()
cloud.orient_normals_consistent_tangent_plane(12)
mesh, _ = o3d.geometry.TriangleMesh.create_from_point_cloud_poisson(cloud, depth=7)
print(mesh)

# %%
# Few bones are easier to pose: 25 joints, at ends, junctions and bends. The handle on its back is a loop, and an
# armature has none: it is cut open at its thinnest place. The mesh stays whole.

skeleton = glsk.skeletonize(cloud)
folder = TemporaryDirectory()
path = Path(folder.name, "animal.glb")
armature = glsk.save_rig(skeleton, path, mesh, joints=25, cut_loops=True)
print(armature)
print(f"{path.stat().st_size // 1024} kB")

# %%
# A glTF library reads joints, and for every vertex of the mesh the few joints that move it. Blender shows the same,
# with the bones named after the limbs.

file = pygltflib.GLTF2().load(str(path))


def array(number):
    found, kinds = file.accessors[number], {5123: "<u2", 5125: "<u4", 5126: "<f4"}
    view = file.bufferViews[found.bufferView]
    data = file.binary_blob()[view.byteOffset : view.byteOffset + view.byteLength]
    return np.frombuffer(data, kinds[found.componentType]).reshape(found.count, -1)


primitive = file.meshes[0].primitives[0]
place, joints, weights = (
    array(getattr(primitive.attributes, name)) for name in ("POSITION", "JOINTS_0", "WEIGHTS_0")
)
triangles = array(primitive.indices).reshape(-1, 3)
print(
    f"{len(file.skins[0].joints)} joints, {len(place)} vertices, {(weights > 0).sum(axis=1).mean():.2f} joints each"
)

# %%
# Pose it: every joint on the way to the end of the neck turns by a few degrees about the axis across the body. That is
# what a program for animation does: matrices down the tree, and their weighted mean on the surface.

parent = {child: number for number, node in enumerate(file.nodes) for child in node.children or ()}
rest = {}
for joint in file.skins[0].joints:  # they are numbered from the root outwards
    rest[joint] = np.array(file.nodes[joint].translation) + rest.get(parent.get(joint), 0)
neck = [joint for joint in rest if file.nodes[joint].name.startswith(("neck", "head"))]
print([file.nodes[joint].name for joint in neck])


def posed(angle):
    c, s = np.cos(angle), np.sin(angle)
    turn, world = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]), {}
    for joint in file.skins[0].joints:
        matrix = np.eye(4)
        matrix[:3, :3] = turn if joint in neck else np.eye(3)
        matrix[:3, 3] = file.nodes[joint].translation
        world[joint] = world.get(parent.get(joint), np.eye(4)) @ matrix
    moves = np.stack([world[joint] for joint in file.skins[0].joints])
    moves[:, :3, 3] -= np.einsum("nij,nj->ni", moves[:, :3, :3], np.stack(list(rest.values())))
    ahead = np.pad(place, ((0, 0), (0, 1)), constant_values=1)
    return np.einsum("nk,nkij,nj->ni", weights, moves[joints][..., :3, :], ahead)


figure = plt.figure(figsize=(10, 4), layout="constrained")
for number, (angle, title) in enumerate(
    [(0.0, "at rest"), (-0.15, "the neck turned up"), (0.15, "and down")], 1
):
    axes = figure.add_subplot(1, 3, number, projection="3d")
    axes.plot_trisurf(*posed(angle).T, triangles=triangles, color="0.8", linewidth=0)
    axes.set(aspect="equal", title=title)
    axes.view_init(10, -75)
    axes.set_axis_off()
plt.show()
folder.cleanup()
