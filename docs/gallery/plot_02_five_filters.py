"""
What the filters do
===================

The one call is a pipeline of filters. Here each runs by itself, so that you can look at the results between them.
"""

import matplotlib.pyplot as plt
import numpy as np

import glsk_o3d as glsk
from glsk_o3d.samples import sauropod

cloud = sauropod(4096, noise=0.002).points

# %%
# **Preparation**: outliers, noise and surplus points of a scan are removed. **Rings**: the neighbours around each
# point. **Contraction**: the Laplacian of the rings draws the points inwards, while local point reduction (**LPR**)
# merges redundant points of a large cloud. **Connection**: clusters of contracted points become a graph.
# **Refinement**: the graph becomes a curve in the middle of the surface. **Tracing** is for twigs that show no surface;
# here it finds nothing to do.

prepared = (glsk.Sampler() | glsk.OutlierRemover() | glsk.Denoiser() | glsk.Thinner())(cloud)
rings = glsk.RingBuilder()(prepared)
contracted = glsk.Contractor(reducer=glsk.LPRReducer(least=8192))(rings)
graph = glsk.Connector()(contracted)
skeleton = glsk.Tracer()(glsk.Refiner()(graph))
for state in (rings, contracted, graph, skeleton):
    print(state)

# %%
# In the contracted cloud the thick trunk is not yet a line, and the raw graph shows it: many small triangles.
# Refinement closes them, and moves the curve to the middle of the surface.

figure = plt.figure(figsize=(10, 6), layout="constrained")
panels = {
    f"rings of {len(rings)} points": (None, rings.cloud),
    f"{len(contracted)} contracted points": (None, contracted.contracted),
    f"raw graph: {graph.n_loops} loops": (graph, cloud),
    f"refined: {skeleton.n_loops} loop": (skeleton, cloud),
}
for place, (title, (drawn, points)) in enumerate(panels.items(), start=1):
    axes = figure.add_subplot(2, 2, place, projection="3d")
    glsk.plot_skeleton(drawn, axes, cloud=points, line_width=1.5).set_title(title)
plt.show()

# %%
# LPR also runs alone. One pass after one solve leaves the points that are not redundant, at their old places:

once = glsk.Contractor(max_iterations=1)(rings)
reduced = glsk.LPRReducer()(once)
print(
    f"{len(once)} points before, {len(reduced)} after one pass; together they speak for {reduced.mass.sum():.0f}"
)

# %%
# Joined with ``|`` the filters are the recommended pipeline, and give the same to the last bit.

pipeline = (
    glsk.Sampler()
    | glsk.OutlierRemover()
    | glsk.Denoiser()
    | glsk.Thinner()
    | glsk.RingBuilder()
    | glsk.Contractor(reducer=glsk.LPRReducer(least=8192))
    | glsk.Connector()
    | glsk.Refiner()
    | glsk.Tracer()
)
assert pipeline == glsk.pipelines.default()
assert np.array_equal(pipeline(cloud).vertices, skeleton.vertices)
