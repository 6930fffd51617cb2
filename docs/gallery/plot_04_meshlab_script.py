"""
A MeshLab filter script
=======================

Filter scripts (``.mlx``) may mix MeshLab's filters with ours. This one removes duplicates and outliers with MeshLab's,
then makes the skeleton with ours. It needs the extra ``meshlab``.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import numpy as np

import glsk_o3d as glsk
from glsk_o3d.samples import helix

SCRIPT = """\
<!DOCTYPE FilterScript>
<FilterScript>
 <filter name="Remove Duplicate Vertices"/>
 <filter name="Select Outliers">
  <Param type="RichFloat" name="PropThreshold" value="0.9"/>
 </filter>
 <filter name="Delete Selected Vertices"/>
 <filter name="Generate Curve Skeleton (GLSkeleton)">
  <Param type="RichAbsPerc" name="connector_radius" value="2%"/>
 </filter>
</FilterScript>
"""

# %%
# The scan: a coil spring, 400 of its points twice, and 80 strays.

rng = np.random.default_rng(1)
spring = helix(6000).points
scan = np.concatenate(
    [spring, spring[:400], rng.uniform(spring.min(axis=0), spring.max(axis=0), (80, 3))]
)

# %%
# Script and session are MeshLab's own; everything is checked before anything runs. On the command line the same is
# ``glsk run clean_then_skeleton.mlx spring.ply -o skeleton.ply``.

meshes = glsk.MeshSet()
meshes.add_points(scan)
with TemporaryDirectory() as folder:
    path = Path(folder, "clean_then_skeleton.mlx")
    path.write_text(SCRIPT)
    meshes.load_filter_script(path)
meshes.apply_filter_script()
skeleton = meshes.current_skeleton()
cleaned = meshes.mesh(0).vertex_matrix()
print(f"{len(scan)} points, {len(cleaned)} after cleaning; layers: {meshes.mesh_number()}")
print(skeleton)

# %%
# The skeleton is one open curve with the coil's two turns. In the right picture no outlier is left; any that a filter
# misses would be set aside by :class:`glsk_o3d.OutlierRemover`.

figure = plt.figure(figsize=(9, 4.5), layout="constrained")
left, right = (figure.add_subplot(1, 2, place, projection="3d") for place in (1, 2))
glsk.plot_skeleton(None, left, cloud=scan).set_title("the scan")
glsk.plot_skeleton(skeleton, right, cloud=cleaned).set_title("after the script")
plt.show()
