"""
Which loops are handles
=======================

A loop in a skeleton is real only if something can pass through it: no disc that spans it stays inside the object. This
is how false loops are told from handles.
"""

import matplotlib.pyplot as plt
import networkx as nx

import glsk_o3d as glsk
from glsk_o3d.samples import sauropod

cloud = sauropod(6000, noise=0.002).points
rings = glsk.pipelines.rings()(cloud)
graph = (glsk.Contractor() | glsk.Connector())(rings)

# %%
# The raw graph is full of small loops. Those of three edges are triangles, and the published refinement collapses only
# these. The recommended refinement computes for each larger loop the probability that it is a handle, and closes the
# others.

published = glsk.Refiner(handle=0, air=0, bridge=0, limb=0, spacing=0, recentre=0)(graph)
skeleton = glsk.Refiner()(graph)
for name, each in (
    ("raw graph", graph),
    ("without triangles", published),
    ("recommended", skeleton),
):
    print(f"{name:17} {each.n_loops:4} loops")

# %%
# The report has all questions and answers; these are the loops.

for it in skeleton.report.decisions:
    if it.about == "loop":
        print(it)

# %%
# The loop that remains is the handle: its two feet meet in the trunk.

(loop,) = nx.cycle_basis(skeleton.to_networkx())
figure = plt.figure(figsize=(12, 3), layout="constrained")
left, middle, right = (figure.add_subplot(1, 3, place, projection="3d") for place in (1, 2, 3))
glsk.plot_skeleton(graph, left, line_width=1).set_title(f"raw graph: {graph.n_loops} loops")
glsk.plot_skeleton(published, middle, line_width=1.5).set_title(
    f"without triangles: {published.n_loops}"
)
glsk.plot_skeleton(skeleton, right, color=(0.6, 0.6, 0.6)).set_title(
    f"recommended: {skeleton.n_loops}"
)
right.plot(
    *skeleton.vertices[[*loop, loop[0]]].T,
    color="crimson",
    linewidth=3,
    zorder=3,
    clip_on=False,
)
plt.show()
