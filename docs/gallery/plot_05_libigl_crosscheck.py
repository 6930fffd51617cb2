"""
Is the cloud good enough? A mesh says
=====================================

Everything starts with the rings. On a mesh they are known: so reconstruct one, let libigl compute the same Laplacian on
it, and see where the two disagree. No truth is needed.
"""

import matplotlib.pyplot as plt
import numpy as np

import glsk_o3d as glsk
from glsk_o3d.crosscheck import cross_check
from glsk_o3d.samples import y_junction


def show(check):
    """The skeleton, and the points by their angle, pale where it is small; grey ones could not be compared."""
    colors = plt.colormaps["YlOrRd"].with_extremes(bad="lightgrey")(check.angle / 60)[:, :3]
    glsk.plot_skeleton(check.skeleton, cloud=check.points, point_colors=colors, color=(0, 0, 0))


# %%
# A clean cloud: the directions of the Laplacian coordinates agree within a few degrees, nearly everywhere (pale).

clean = y_junction(4096).points
check = cross_check(clean)
print(check.verdict, check.rows.angle)
show(check)
plt.show()

# %%
# The same with noise on one arm. The rows notice it before the skeleton does: on that arm the mesh does not close
# around many points, which are grey, and both skeletons are still one.

noise = np.random.default_rng(0).normal(scale=0.003, size=clean.shape)
noisy = clean + noise * (clean[:, :1] < -0.1)
check = cross_check(noisy)
print(check.verdict)
print(
    f"doubtful: {check.doubtful[clean[:, 0] < -0.1].mean():.0%} of the noisy arm, "
    f"{check.doubtful[clean[:, 0] > 0].mean():.0%} of the rest"
)
show(check)
plt.show()

# %%
# One convention to know when you compare: ours is L = 2 igl.cotmatrix, rows sum to zero, L P points inwards.
