"""
Where a gripper takes a mug
===========================

From two depth images: the table and the mug on it, the mug's skeleton, and places where a gripper can take the mug
without touching anything else.
"""

# sphinx_gallery_thumbnail_number = 2

import warnings
from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import numpy as np
import open3d as o3d
from mpl_toolkits.mplot3d.art3d import Line3DCollection

import glsk_o3d as glsk
from glsk_o3d.analysis import Gripper, grasp_candidates


def turned(outline, angle, axis):
    """The surface that an outline sweeps about an axis."""
    row = np.arange(len(outline) - 1)
    lines = o3d.t.geometry.LineSet(
        np.float32(outline), np.column_stack([row, row + 1]).astype(np.int32)
    )
    return lines.extrude_rotation(angle, axis, resolution=64)


ring = np.linspace(0, 2 * np.pi, 25)
wall = [
    [0, 0, 0],
    [0.04, 0, 0],
    [0.04, 0, 0.095],
    [0.036, 0, 0.095],
    [0.036, 0, 0.006],
    [0, 0, 0.006],
]  # in metres
mug = turned(wall, 360, [0, 0, 1])
handle = turned(
    np.stack([0 * ring, 0.006 * np.sin(ring), -0.033 - 0.006 * np.cos(ring)], axis=1),
    -180,
    [0, 1, 0],
)
handle.translate([0.036, 0, 0.048])
table = o3d.t.geometry.TriangleMesh.create_box(0.6, 0.6, 0.02).translate([-0.3, -0.3, -0.02])

# %%
# Two cameras look at it; depths have a noise of half a millimetre. Here they are simulated by rays through the pixels;
# with a camera, ``create_from_depth_image`` makes the clouds.

scene, rng = o3d.t.geometry.RaycastingScene(), np.random.default_rng(0)
for mesh in (mug, handle, table):
    scene.add_triangles(mesh)
clouds, (figure, axes) = [], plt.subplots(1, 2, figsize=(8, 3.2), layout="constrained")
for axis, eye in zip(axes, ([0.28, -0.38, 0.32], [0.15, 0.42, 0.34]), strict=True):
    rays = scene.create_rays_pinhole(32, [0, 0, 0.04], eye, [0, 0, -1], 240, 180).numpy()
    depth = scene.cast_rays(rays)["t_hit"].numpy() + rng.normal(scale=0.0005, size=(180, 240))
    clouds.append((rays[..., :3] + depth[..., None] * rays[..., 3:])[np.isfinite(depth)])
    axis.imshow(depth, cmap="viridis_r")
    axis.set_axis_off()
plt.show()

# %%
# The largest plane is the table, and the largest object on it is the mug. Its skeleton has a loop, the handle. The rest
# is round and hollow and has no axis: the report and the confidence show this.

cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(np.concatenate(clouds)))
o3d.utility.random.seed(0)
plane, below = cloud.segment_plane(distance_threshold=0.003, ransac_n=3, num_iterations=500)
above = cloud.select_by_index(below, invert=True)
label = np.array(above.cluster_dbscan(eps=0.01, min_points=10))
above = above.select_by_index(np.flatnonzero(label == np.bincount(label[label >= 0]).argmax()))
with warnings.catch_warnings():
    warnings.simplefilter("ignore", glsk.SkeletonWarning)
    skeleton = glsk.skeletonize(above)
print(skeleton, *skeleton.report.warnings, sep="\n")

# %%
# The gripper opens 80 mm and is otherwise like a Franka Hand. It may come from above and from the sides, not from below
# the table, which is solid behind its plane. The whole volume that fingers and palm sweep on their way in must be free.

gripper = Gripper(max_opening=0.08)
options = dict(
    around=12, spacing=0.006, clearance=0.006, accept="no curve skeleton"
)  # for its handle
blind = grasp_candidates(skeleton, gripper, cloud=(), **options)
safe = grasp_candidates(skeleton, gripper, plane=plane, **options)
print(f"{len(blind)} by the skeleton alone, {len(safe)} that touch nothing else")
print(*safe.left_out.items(), sep="\n")


near = o3d.geometry.AxisAlignedBoundingBox([-0.06, -0.07, -1], [0.15, 0.07, 0.2])
around = cloud.voxel_down_sample(0.004).crop(near)
figure = plt.figure(figsize=(9, 4.2), layout="constrained")
for column, (grasps, color) in enumerate(((blind[:15], "#c0504d"), (safe[:15], "#3b6ea5"))):
    axes = figure.add_subplot(1, 2, column + 1, projection="3d")
    glsk.plot_skeleton(skeleton, axes, cloud=around, view=(40, -75))
    lines = grasps.to_line_set()
    ends = np.asarray(lines.points)[np.asarray(lines.lines)]
    axes.add_collection(
        Line3DCollection(ends, colors=color, linewidths=1.2, zorder=3, clip_on=False)
    )
plt.show()

# %%
# Left, the best 15 by the skeleton alone; right, of those that touch nothing else: forks from palm to fingertips. For a
# robot they are poses in JSON. ``glsk grasps mug.json --opening 0.08 --plane 0,0,1,0`` writes them, too.

with TemporaryDirectory() as folder:
    safe[:20].to_json(Path(folder, "grasps.json"))
print(safe.poses[0].round(3))
