"""
A cloud cut into its limbs
==========================

Every point belongs to a vertex, and every vertex to a branch, so a skeleton divides its cloud into parts.
"""

import matplotlib.pyplot as plt
import numpy as np

import glsk_o3d as glsk
from glsk_o3d.samples import sauropod

scan = sauropod(30_000, noise=0.001).points
thinned = scan[::5]
skeleton = glsk.skeletonize(thinned)

# %%
# ``segment`` labels the points with rows of the branch table. Any cloud in the same place will do: here the skeleton
# is that of 6000 points, and the labels are for all 30 000.

label = glsk.analysis.segment(skeleton, scan)
table = glsk.analysis.branch_table(skeleton)
for row in np.argsort(-table.points)[:5]:
    print(
        f"branch {row}: {table.kind[row]}, {(label == row).sum()} points, radius {table.mean_radius[row]:.3f}"
    )

# %%
# The colours of the parts are those of the branches. Around a junction a point goes to the branch whose curve is
# nearest: look at the shoulders, where that is a convention rather than anatomy.

colours = glsk.annotate(skeleton, scan, color="branch").point.colors.numpy() / 255
glsk.plot_skeleton(skeleton, cloud=scan, color=(0.1, 0.1, 0.1), point_colors=colours, line_width=1)
plt.show()

# %%
# A mask selects one part, which is a cloud like any other.

longest = scan[label == table.length.argmax()]
print(f"the longest branch: {len(longest)} points, {np.ptp(longest, axis=0).round(2)} large")
