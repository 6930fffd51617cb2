"""
A handle and its loop
=====================

A loop in a skeleton is real only if something can pass through it: it opens wider than the tube that makes it. This is
how false loops are told from handles.
"""

import matplotlib.pyplot as plt
import networkx

import glsk_o3d as glsk
from glsk_o3d.analysis import assess
from glsk_o3d.samples import sauropod

cloud = sauropod(6000, noise=0.002).points
graph = (glsk.RingBuilder() | glsk.Contractor(reducer=glsk.LPRReducer()) | glsk.Connector())(cloud)

# %%
# The raw graph is full of small loops. Those of three edges are no loops but triangles, and the refinement closes
# them, as published. Larger ones are left: they open less than a part is thick.

published = glsk.Refiner(opening=0, spur=0, spacing=0, recentre=0, weak_loop_bonds=0, weak_loop_opening=0, bridge=0)(
    graph
)
skeleton = glsk.Refiner()(graph)
for name, each in (("raw graph", graph), ("without triangles", published), ("recommended", skeleton)):
    print(f"{name:17} {each.n_loops:4} loops")

# %%
# ``assess`` measures what remains: the radius of the largest circle inside the loop, and that of the tube around it.

for loop in assess(skeleton, cloud).loops:
    print(f"opening {loop.opening:.3f}, tube {loop.tube_radius:.3f}, wider: {loop.wider}")

# %%
# Which vertices lie on the loop, and how long it is, is a question for networkx.

network = skeleton.to_networkx()
(cycle,) = networkx.cycle_basis(network)
length = sum(network.edges[edge]["length"] for edge in zip(cycle, cycle[1:] + cycle[:1], strict=True))
print(f"{len(cycle)} vertices, {length:.2f} long")

# %%
# The loop is the handle: its two feet meet in the trunk.

figure = plt.figure(figsize=(12, 3), layout="constrained")
left, middle, right = (figure.add_subplot(1, 3, place, projection="3d") for place in (1, 2, 3))
glsk.plot_skeleton(graph, left, line_width=1).set_title(f"raw graph: {graph.n_loops} loops")
glsk.plot_skeleton(published, middle, line_width=1.5).set_title(f"without triangles: {published.n_loops}")
glsk.plot_skeleton(skeleton, right, color=(0.6, 0.6, 0.6)).set_title(f"recommended: {skeleton.n_loops}")
right.plot(*skeleton.vertices[[*cycle, cycle[0]]].T, color="crimson", linewidth=3, zorder=3, clip_on=False)
plt.show()
