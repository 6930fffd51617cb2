"""
A tree from sparse points
=========================

A trunk that a scanner saw as a surface, and twigs that it saw as rows of points: one tree, and what foresters read.
"""

import warnings

import matplotlib.pyplot as plt

import glsk_o3d as glsk
from glsk_o3d import samples

# %%
# A tree in metres. The points are evenly spaced: many lie around the trunk, but twigs are thinner than the spacing.

cloud = samples.tree(4096, forks=6, seed=4).points
print(f"{len(cloud)} points, {2**6} tips")

# %%
# ``default`` and ``tree`` trace the twigs along shortest paths; without that they are drawn together.

with warnings.catch_warnings():
    warnings.simplefilter(
        "ignore", glsk.SkeletonWarning
    )  # it says that the crown is weakly supported, and which loops in it were close calls
    before = glsk.pipelines.default().with_options({"Tracer.surface": 0})(cloud)
    tree = glsk.pipelines.tree()(cloud)
print(before)
print(
    tree,
    f"{tree.report.n_traced} points traced, {len(tree.report.joined)} gaps joined",
    sep=chr(10),
)

# %%
# The measures for foresters. The radius of a traced twig is the scatter of its points. A warning says how much of the
# length has no surface.

with warnings.catch_warnings():
    warnings.simplefilter("ignore", glsk.SkeletonWarning)
    measures = glsk.analysis.tree_measures(tree)
print(measures.doubts[-1])
print(f"height {measures.height:.2f} m, diameter at 1.3 m {measures.stem_diameter:.3f} m")
print(f"the lowest branch leaves the stem at {measures.crown_base:.2f} m")
for order, volume in enumerate(measures.volume):
    print(f"order {order}: {measures.length[order]:6.2f} m, {1000 * volume:7.2f} litres")

figure = plt.figure(figsize=(10, 6), layout="constrained")
left, right = (figure.add_subplot(1, 2, place, projection="3d") for place in (1, 2))
glsk.plot_skeleton(before, left, color="confidence", view=(10, -50)).set_title("not traced")
glsk.plot_skeleton(tree, right, color="confidence", view=(10, -50)).set_title(
    "tree: colour is confidence"
)
plt.show()
