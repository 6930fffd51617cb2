"""
A mug on a table: from depth images to grasps
=============================================

What a robot does with two depth images: find the table and the mug on it, the mug's skeleton, and where its gripper can
take the mug without touching anything else.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import numpy as np
import open3d as o3d
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

import glsk_o3d as glsk
from glsk_o3d.analysis import Gripper, grasp_candidates


def swept(grid):
    """The mesh of a grid of points."""
    n, m, _ = grid.shape
    corner = (m * np.arange(n - 1)[:, None] + np.arange(m - 1)).ravel()[:, None]
    faces = np.concatenate([corner + [0, m, m + 1], corner + [0, m + 1, 1]])
    return o3d.t.geometry.TriangleMesh(grid.reshape(-1, 3).astype(np.float32), faces.astype(np.int32))


turn, bend = np.linspace(0, 2 * np.pi, 65)[:, None], np.linspace(-1.6, 1.6, 33)[:, None]
r, z = np.array([[0, 0], [40, 0], [40, 95], [36, 95], [36, 6], [0, 6]]).T / 1000  # in metres: half a cut through it
mug = swept(np.stack([r * np.cos(turn), r * np.sin(turn), z + 0 * turn], axis=2))
out, aside = 0.033 + 0.006 * np.cos(turn.T), 0.006 * np.sin(turn.T)  # half a ring is its handle
handle = swept(np.stack([0.036 + out * np.cos(bend), aside + 0 * bend, 0.048 + out * np.sin(bend)], axis=2))
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
# The largest plane is the table, and the largest thing on it is the mug. Its skeleton has a loop, the handle.

cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(np.concatenate(clouds)))
o3d.utility.random.seed(0)
plane, below = cloud.segment_plane(distance_threshold=0.003, ransac_n=3, num_iterations=500)
above = cloud.select_by_index(below, invert=True)
label = np.array(above.cluster_dbscan(eps=0.01, min_points=10))
above = above.select_by_index(np.flatnonzero(label == np.bincount(label[label >= 0]).argmax()))
skeleton = glsk.skeletonize(above)
print(skeleton)

# %%
# The gripper opens 80 mm and is otherwise like a Franka Hand. It may come from above and from the sides, not from below
# the table, which is solid behind its plane. Whatever the fingers or the palm would sweep over on the way in counts.

gripper = Gripper(max_opening=0.08)
options = dict(cone=((0, 0, -1), 95), around=24, spacing=0.004, clearance=0.006)
blind = grasp_candidates(skeleton, gripper, cloud=(), **options)
safe = grasp_candidates(skeleton, gripper, obstacles=plane, **options)
print(f"{len(blind)} by the skeleton alone, {len(safe)} that touch nothing else")
print(*safe.left_out.items(), sep="\n")


def show(grasp, axes, color):
    """Fingers and palm of the gripper, in its pose."""
    pose, faces = grasp.poses[0], [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]]
    for low, high in zip(*(corner[0] for corner in gripper.boxes(grasp.opening, grasp.depth)), strict=True):
        corners = np.where(np.arange(8)[:, None] >> [2, 1, 0] & 1, high, low) @ pose[:3, :3].T + pose[:3, 3]
        axes.add_collection3d(Poly3DCollection(corners[faces], fc=color, ec="0.2", lw=0.4, alpha=0.5, clip_on=False))


around = cloud.voxel_down_sample(0.006).crop(o3d.geometry.AxisAlignedBoundingBox([-0.13, -0.13, -1], [0.2, 0.15, 1]))
figure = plt.figure(figsize=(8, 4.2), layout="constrained")
for column, (grasp, color) in enumerate(((blind[0], "#c0504d"), (safe[0], "#3b6ea5"), (safe[-1], "#3b6ea5"))):
    axes = glsk.plot_skeleton(
        skeleton, figure.add_subplot(1, 3, column + 1, projection="3d"), cloud=around, view=(28, -55), point_size=2.5
    )
    show(grasp, axes, color)
plt.show()

# %%
# Left, the best of the skeleton alone; then the best and the last of those that touch nothing else. For a robot they
# are poses in JSON; ``glsk grasps mug.json --opening 0.08 --plane 0,0,1,0 --cone -z,95`` writes them from files.

with TemporaryDirectory() as folder:
    safe[:20].to_json(Path(folder, "grasps.json"))
print(safe.poses[0].round(3))
