"""
A skeleton in one call
======================

A cloud in, a curve skeleton out. The cloud is a toy dinosaur with a handle on its back, scanned by two cameras: belly
and parts of the legs are missing.
"""

import matplotlib.pyplot as plt

import glsk_o3d as glsk
from glsk_o3d.samples import sample_object

cloud = sample_object().points  # or glsk.read_cloud("scan.ply"), or one of Open3D's
skeleton = glsk.skeletonize(cloud)
print(skeleton)

# %%
# It is a graph in space: vertices, edges, the local radius at each vertex, and for every point the vertex it belongs
# to. The loop is the handle. Leaves are nose, tail and feet.

glsk.plot_skeleton(skeleton, color="radius")
plt.show()

# %%
# The report says what was done and why it stopped. ``glsk.save_skeleton(skeleton, "toy.ply")``
# writes what Open3D and MeshLab read; other endings write other formats.

report = skeleton.report
print(report.stop_reason)
for record in report.iterations:
    print(f"solve {record.iteration}: {record.n_points} points, {record.n_merged} merged")
