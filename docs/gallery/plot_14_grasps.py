"""
Grasp candidates along a skeleton
=================================

Where could a gripper with parallel jaws take this object? The skeleton knows the axis and the thickness of every part:
the jaws close across it.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import numpy as np
from mpl_toolkits.mplot3d.art3d import Line3DCollection

import glsk_o3d as glsk
from glsk_o3d.analysis import grasp_candidates
from glsk_o3d.samples import sauropod

cloud = sauropod(8192, noise=0.002).points
skeleton = glsk.skeletonize(cloud)

# %%
# A gripper that opens 0.17. The trunk is thicker, and what is told about the places that were not taken says so; neck,
# tail, legs and handle are not. Each fork is drawn where the fingers would be; yellow ones are best. The quality
# prefers sure parts that leave room in the gripper and do not taper.


def show(grasps, axes):
    lines = grasps.to_line_set()
    ends, colours = np.asarray(lines.points)[np.asarray(lines.lines)], np.asarray(lines.colors)
    axes.add_collection(Line3DCollection(ends, colors=colours, linewidths=1, zorder=3, clip_on=False))


grasps = grasp_candidates(skeleton, max_opening=0.17, clearance=0.03, around=4, spacing=0.08)
print(grasps)
show(grasps, glsk.plot_skeleton(skeleton))
plt.show()

# %%
# What stands in the way is for a planner to find out, who knows the hand. For a simple hand it takes the cloud and a
# few lines: in the frame of the gripper (x closing, y along the part, z approach), no point may lie in the boxes of
# the fingers and in that of the hand behind them.

FINGER, HAND = 0.015, 0.25


def is_free(pose, opening):
    x, y, z = ((cloud - pose[:3, 3]) @ pose[:3, :3]).T
    near = (np.abs(y) < FINGER) & (np.abs(x) < opening / 2 + FINGER) & (z < opening / 4)
    fingers = (np.abs(x) > opening / 2) & (z > -opening)
    hand = (z < -opening) & (z > -opening - HAND)
    return not (near & (fingers | hand)).any()


free = grasps[[is_free(pose, opening) for pose, opening in zip(grasps.poses, grasps.opening, strict=True)]]
best = free[np.unique(free.branch, return_index=True)[1]]  # they come best first
print(f"{len(free)} of {len(grasps)} have a free way; the best on each branch:")
for row in best:
    print(f"  branch {row['branch']}: opening {row['opening']:.3f}, quality {row['quality']:.2f}")

# %%
# Between the legs, and from inside the handle, the hand has no room. Of what is left, the best on each branch:

axes = glsk.plot_skeleton(skeleton)
show(best, axes)
plt.show()

# %%
# For a robot: poses as JSON, or a table.

with TemporaryDirectory() as folder:
    best.to_json(Path(folder, "grasps.json"))
    best.to_csv(Path(folder, "grasps.csv"))
    print(Path(folder, "grasps.csv").read_text().splitlines()[0])
print(best.poses[0].round(3))
