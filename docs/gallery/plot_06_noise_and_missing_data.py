"""
Noise and missing data
======================

One object in six states, with the axis it was made from to measure against. *Error* is the mean distance of the
skeleton from the axis in local radii; *complete* is the share of the axis that has skeleton within one radius.
"""

import warnings

import matplotlib.pyplot as plt
import numpy as np

import glsk_o3d as glsk
from glsk_o3d import samples
from glsk_o3d.analysis import Truth, compare

rng = np.random.default_rng(0)
whole = samples.sauropod(6000, cameras=None)
truth = Truth(whole.nodes, whole.edges, whole.radii)
low, high = whole.points.min(axis=0), whole.points.max(axis=0)
sparse_behind = rng.random(6000) < np.where(whole.points[:, 0] < 0, 0.1, 1)

clouds = {
    "whole": whole.points,
    "noise of 1 % of the diagonal": samples.sauropod(6000, cameras=None, noise=0.01).points,
    "2 % strays": np.concatenate([whole.points, rng.uniform(low, high, (120, 3))]),
    "ten times sparser behind": whole.points[sparse_behind],
    "two cameras": samples.sauropod(6000).points,
    "one camera": samples.sauropod(6000, cameras=samples.TWO_CAMERAS[:1]).points,
}

# %%
# Compare the titles. Outliers hardly matter, and noise moves the curve a little. With a tenth of the points the handle
# is too thin to differ from outliers, and its loop is gone. With one camera parts are missing or separate, and the
# curve may leave the middle; a second camera repairs most of that.

figure = plt.figure(figsize=(12, 6.5), layout="constrained")
for place, (name, cloud) in enumerate(clouds.items(), start=1):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        skeleton = glsk.skeletonize(cloud)
    found = compare(skeleton, truth)
    title = f"{name}\nerror {found.error:.2f}, complete {found.completeness:.0%}, loops {skeleton.n_loops}"
    axes = figure.add_subplot(2, 3, place, projection="3d")
    glsk.plot_skeleton(skeleton, axes, color="confidence").set_title(title, fontsize=10)
    for warning in caught:
        print(f"{name}: {warning.message}")
plt.show()

# %%
# Colours are the confidence, from dark blue (0) to yellow (1). It is low where the points hardly determine the axis.
