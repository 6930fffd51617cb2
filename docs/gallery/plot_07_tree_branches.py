"""
Every branch in numbers
=======================

Length, thickness, angle and order of every branch are measured on plants, vessels and cave systems.
"""

import matplotlib.pyplot as plt
import numpy as np

import glsk_o3d as glsk
from glsk_o3d import samples

# %%
# A tree with known numbers: each branch forks in two, at 35 degrees to either side, 0.75 as long and 0.7 as thick.
# Three orders of forks make 15 branches.

GROWTH, THINNING, FORK = 0.75, 0.7, np.deg2rad(35)
nodes, edges, radii = [np.zeros(3)], [], [0.1]


def grow(start, heading, across, length, radius, forks):
    """A branch, and what grows from its end; forks turn by a right angle from one order to the next."""
    end = len(nodes)
    nodes.append(nodes[start] + length * heading)
    edges.append((start, end))
    radii.append(radius)
    for turn in (FORK, -FORK) if forks else ():
        onward = np.cos(turn) * heading + np.sin(turn) * across
        grow(end, onward, np.cross(heading, across), GROWTH * length, THINNING * radius, forks - 1)


grow(0, np.array([0.0, 0, 1]), np.array([1.0, 0, 0]), 1.0, 0.1, 3)
nodes, edges, radii = np.array(nodes), np.array(edges), np.array(radii)

# %%
# The cloud: a tube of the samples for each branch, turned into its place, without points inside another branch.

parts = []
for number, (start, end) in enumerate(edges):
    way = nodes[end] - nodes[start]
    length = np.linalg.norm(way)
    points = samples.tube(
        int(25_000 * length * radii[end]), length=length, radius=radii[end], seed=number
    ).points
    frame = np.linalg.svd(way[None])[2]  # its rows: along the branch, and two directions across
    parts.append((nodes[start] + nodes[end]) / 2 + points @ frame)
cloud = np.concatenate(parts)
for (start, end), radius in zip(edges, radii[1:], strict=True):
    cloud = cloud[
        samples.signed_distance(cloud, nodes[[start, end]], np.array([[0, 1]]), np.full(2, radius))
        > -1e-9
    ]
print(f"{len(cloud)} points")

# %%
# The table has a row per branch. The root is given; by default it is the branch with the most volume.

skeleton = glsk.skeletonize(cloud)
table = glsk.analysis.branch_table(skeleton, root=(0, 0, 0))
print(" order  branches  length  (true)  radius  (true)  angle  (true)")
for order in range(table.level.max() + 1):
    of = table.level == order
    length, radius = table.length[of].mean(), table.mean_radius[of].mean()
    angle = table.angle[of].mean() if order else np.nan
    print(
        f"{order:6}{of.sum():10}{length:8.2f}{GROWTH**order:8.2f}"
        f"{radius:8.3f}{0.1 * THINNING**order:8.3f}{angle:7.0f}{np.rad2deg(FORK) if order else np.nan:8.0f}"
    )

# %%
# The first three orders are right within a few per cent. The tips are too short, and their angles are off: the points
# determine the end of a curve least, and near a fork the parts blend.

figure = plt.figure(figsize=(10, 6), layout="constrained")
left, right = (figure.add_subplot(1, 2, place, projection="3d") for place in (1, 2))
glsk.plot_skeleton(skeleton, left, color="branch", view=(10, -50)).set_title(
    f"{len(table)} branches"
)
glsk.plot_skeleton(skeleton, right, color="radius", view=(10, -50)).set_title("radius")
plt.show()
