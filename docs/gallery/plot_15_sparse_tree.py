"""
A sparse tree
=============

A trunk that a scanner saw as a surface, and twigs that it saw as rows of points: one tree, and what foresters read.
"""

import warnings

import matplotlib.pyplot as plt
import numpy as np

import glsk_o3d as glsk

# %%
# A tree in metres. Each limb forks into three thinner ones; points lie evenly on the surface of the trunk, and
# along twigs there are thirty a metre.

rng = np.random.default_rng(4)
limbs = []


def grow(start, heading, length, radius, forks):
    """A limb, and what grows from its end."""
    end = start + length * heading
    limbs.append((start, end, radius))
    for _ in range(forks and 3):
        onward = heading + rng.normal(size=3) * 0.45 + [0, 0, 0.1]
        grow(end, onward / np.linalg.norm(onward), 0.72 * length, 0.5 * radius, forks - 1)


grow(np.zeros(3), np.array([0, 0, 1.0]), 2.0, 0.15, 4)
parts = []
for start, end, radius in limbs:
    length = np.linalg.norm(end - start)
    n = int(np.clip(9000 * length * radius, 30 * length, None))
    along = (end - start) / length
    across = np.linalg.svd(along[None])[2][1:]
    t, turn = length * rng.random((n, 1)), 2 * np.pi * rng.random((n, 1))
    parts.append(start + t * along + radius * (np.cos(turn) * across[0] + np.sin(turn) * across[1]))
cloud = np.concatenate(parts)
print(f"{len(cloud)} points, {len(limbs)} limbs")

# %%
# ``default`` and ``tree`` trace the twigs along shortest paths; without that they are drawn together.

with warnings.catch_warnings():
    warnings.simplefilter("ignore", glsk.SkeletonWarning)  # it says that the crown is weakly supported
    before = glsk.pipelines.default().with_options({"Refiner.surface": 0})(cloud)
tree = glsk.pipelines.tree()(cloud)
print(before)
print(tree, f"{tree.report.n_traced} points traced, {len(tree.report.joined)} gaps joined", sep=chr(10))

# %%
# What foresters read. The radius of a traced twig is the scatter of its points: it knows no better.

measures = glsk.analysis.tree_measures(tree)
print(f"height {measures.height:.2f} m, diameter at 1.3 m {measures.stem_diameter:.3f} m")
print(f"crown {measures.crown_width:.2f} m wide, {measures.crown_area:.1f} m2 from above")
for order, volume in enumerate(measures.volume):
    print(f"order {order}: {measures.length[order]:6.2f} m, {1000 * volume:7.2f} litres")

figure = plt.figure(figsize=(10, 6), layout="constrained")
left, right = (figure.add_subplot(1, 2, place, projection="3d") for place in (1, 2))
glsk.plot_skeleton(before, left, color="confidence", view=(10, -50)).set_title("not traced")
glsk.plot_skeleton(tree, right, color="confidence", view=(10, -50)).set_title("tree: colour is confidence")
plt.show()
