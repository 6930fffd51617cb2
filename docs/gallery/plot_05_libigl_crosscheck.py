"""
Cross-check with a mesh
=======================

The contraction depends on the Laplacian of the rings. A mesh with vertices of its own gives a second Laplacian, by
libigl, and a second skeleton. The check compares both. No truth is needed.
"""

# sphinx_gallery_thumbnail_number = 2

import matplotlib.pyplot as plt
import numpy as np

import glsk_o3d as glsk
from glsk_o3d.apps.crosscheck import cross_check
from glsk_o3d.samples import y_junction


def show(check):
    """The skeleton, and the points by their angle, pale where it is small; grey ones could not be compared."""
    colors = plt.colormaps["YlOrRd"].with_extremes(bad="lightgrey")(check.angle / 60)[:, :3]
    glsk.plot_skeleton(check.skeleton, cloud=check.points, point_colors=colors, color=(0, 0, 0))


# %%
# A clean cloud: the mean curvature vectors agree within a few degrees, nearly everywhere (pale), and so do the
# eigenvalues.

clean = y_junction(4096).points
check = cross_check(clean)
print(f"{check.verdict}: right with a probability of {check.probability:.2f}")
print(check.rows.angle, f"{check.rows.eigenvalue_ratio:.3f}")
show(check)
plt.show()

# %%
# The same with noise on one arm. The Laplacians notice it before the skeleton does: on that arm the vectors are
# turned, and both skeletons still have the same limbs.

noise = np.random.default_rng(0).normal(scale=0.008, size=clean.shape)
noisy = clean + noise * (clean[:, :1] < -0.1)
check = cross_check(noisy)
print(check.verdict)
on_arm, elsewhere = (
    np.nanmedian(check.angle[clean[:, 0] < -0.1]),
    np.nanmedian(check.angle[clean[:, 0] > 0]),
)
print(f"turned by {on_arm:.1f} degrees on the noisy arm, by {elsewhere:.1f} on the rest")
show(check)
plt.show()

# %%
# The parts and handles of the solid are the parts and loops that a skeleton must have. For comparisons of your own: the
# rows of the contraction are L = 2 igl.cotmatrix; they sum to zero, and L P points inwards. `check.ours` and
# `check.theirs` have the halves.

print(
    f"{check.solid.n_solids} part with {check.solid.genus} handles, watertight: {check.solid.is_watertight}"
)
