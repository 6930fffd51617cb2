"""
A plot of trees, from LAZ
=========================

A forester's day: a scan with ground and numbered trees, on a map; the volume of one tree, its diameter at breast
height, and its cylinders for the programs that foresters have.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import laspy
import matplotlib.pyplot as plt
import numpy as np

import glsk_o3d as glsk
from glsk_o3d import samples

# %%
# The scan: two trees seen by a lidar from three places with 5 mm of noise, written by
# laspy in millimetres with the coordinates of a map. Class 2 is ground, 5 high vegetation; ``treeID`` is a
# segmentation's.

rng = np.random.default_rng(0)
places = np.array([[0.0, 0, 0.1], [6, 1, -0.05]])
lidar = np.array([[20, 2, 1.7], [-11, 17, 1.7], [-9, -18, 1.7]])  # its three places
trees = [
    samples.tree(20000, forks=4, length=1.8, radius=0.12, seed=seed, noise=0.001, cameras=lidar)
    for seed in (3, 8)
]
x, y = rng.uniform([-3, -3], [9, 4], (8000, 2)).T
ground = np.column_stack([x, y, 0.02 * np.sin(x) + rng.normal(scale=0.005, size=len(x))])
points = np.concatenate(
    [ground, *(tree.points + place for tree, place in zip(trees, places, strict=True))]
)
sizes = [len(ground), *(len(tree.points) for tree in trees)]

folder = TemporaryDirectory()
scan = Path(folder.name, "plot.laz")
header = laspy.LasHeader(point_format=6, version="1.4")
header.offsets, header.scales = [471000, 5612000, 100], [0.001] * 3
header.add_extra_dim(laspy.ExtraBytesParams("treeID", type="uint32"))
data = laspy.LasData(header)
data.x, data.y, data.z = (points + [471234.5, 5612345.5, 123.0]).T
data.classification, data.treeID = np.repeat([2, 5, 5], sizes), np.repeat([0, 17, 18], sizes)
data.write(scan)

# %%
# ``glsk info plot.laz`` lists the attributes. Here is one of the trees. The tensor cloud keeps class and number, and
# coordinates all their digits.

cloud = glsk.read_tensor_cloud(scan, where="classification == 5 and treeID == 17")
print(cloud)
tree = glsk.pipelines.tree(root="z")(cloud)
print(tree)

# %%
# Volume and stem diameter, against the true ones.

measures = glsk.analysis.tree_measures(tree)
truth = trees[0]
ends, radii = truth.nodes[truth.edges], truth.radii[truth.edges]
pieces = (
    np.pi
    / 3
    * np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    * ((radii**2).sum(axis=1) + radii.prod(axis=1))
)
trunk = np.argsort(truth.nodes[:, 2])[:8]
breast = 2 * np.interp(1.3, truth.nodes[trunk, 2], truth.radii[trunk])
print(f"volume {1000 * sum(measures.volume):.1f} litres ({1000 * pieces.sum():.1f})")
print(
    f"diameter at 1.3 m {100 * measures.stem_diameter:.1f} cm ({100 * breast:.1f}), height {measures.height:.2f} m"
)

# %%
# A table of cylinders, and the tree's points with class, number, branch and radius.

table = glsk.analysis.cylinders(tree)
table.to_csv(Path(folder.name, "tree.csv"))
print(f"{len(table)} cylinders;", Path(folder.name, "tree.csv").read_text().splitlines()[0])
marked = glsk.annotate(tree, cloud, color="branch")
print(*sorted(marked.point))

figure = plt.figure(figsize=(10, 5), layout="constrained")
left, right = (figure.add_subplot(1, 2, place, projection="3d") for place in (1, 2))
left.scatter(*points[::4].T, s=0.3, c=np.repeat(["0.7", "tab:green", "tab:brown"], sizes)[::4])
left.set(aspect="equal", title="the plot: ground, and two trees")
left.set_axis_off()
glsk.plot_skeleton(tree, right, color="radius", view=(10, -60)).set_title(
    "tree 17: colour is radius"
)
plt.show()
folder.cleanup()
