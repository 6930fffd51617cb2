"""
Three pipelines in growing noise
================================

The pipelines of the page before under noise of 5, 10 and 20 %, in the spirit of figure 8 of Wen et al. (2024).

A percentage means nothing without what it is of. Here it is the standard deviation of the noise on every coordinate
over the median radius of the object's parts: at 20 % points stray by a fifth of a leg's radius. Elsewhere in this
documentation noise is a share of the diagonal, of which 20 % here are 0.6 %.
"""

import warnings

import matplotlib.pyplot as plt
import numpy as np

import glsk_o3d as glsk
from glsk_o3d import samples
from glsk_o3d.analysis import Truth, compare

sample = samples.sauropod(4096, cameras=None)
truth = Truth(sample.nodes, sample.edges, sample.radii)
noise = np.random.default_rng(0).normal(size=sample.points.shape) * np.median(sample.radii)
levels = (0.0, 0.05, 0.1, 0.2)

figure = plt.figure(figsize=(13, 8), layout="constrained")
for row, pipeline in enumerate(("cao2010", "wen2024", "default")):
    for column, level in enumerate(levels):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", glsk.SkeletonWarning)
            skeleton = glsk.skeletonize(sample.points + level * noise, pipeline)
        found = compare(skeleton, truth)
        axes = figure.add_subplot(3, 4, 4 * row + column + 1, projection="3d")
        glsk.plot_skeleton(skeleton, axes, line_width=1.5)
        counts = f"loops {skeleton.n_loops}, ends {len(skeleton.leaves)}"
        axes.set_title(f"{pipeline}, {level:.0%}\nerror {found.error:.2f}, {counts}", fontsize=9)
plt.show()

# %%
# The object has one loop and six ends.
