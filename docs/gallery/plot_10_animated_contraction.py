"""
A film of the contraction
=========================

Watch a cloud contract onto its skeleton, solve by solve.
"""

import base64
from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
from matplotlib.animation import FuncAnimation

import glsk_o3d as glsk
from glsk_o3d.samples import sample_object

# %%
# ``on_state`` gets the place of each point after each solve; every second point is drawn here. A merged point has the
# place of its representative.

cloud = sample_object(8192).points
positions = [cloud[::2]]


def keep(state):
    positions.append(state.contracted[state.survivor_of_point[::2]])


skeleton = glsk.skeletonize(cloud, on_state=keep)
solves = len(positions) - 1
print(f"{solves} solves: {skeleton.report.stop_reason}")

# %%
# Thin parts are lines after a solve or two; later solves draw the trunk together. It is no line even in the end: the
# rule stops when another solve would hardly change the whole. The skeleton (red) lies in the middle of the surface, and
# need not run through the contracted points.

figure = plt.figure(figsize=(12, 6), layout="constrained")
columns = (solves + 3) // 2
for solve, points in enumerate([*positions, None]):
    axes = figure.add_subplot(2, columns, solve + 1, projection="3d")
    drawn = None if points is not None else skeleton
    glsk.plot_skeleton(drawn, axes, cloud=positions[-1] if points is None else points)
    title = "skeleton" if drawn else f"after solve {solve}" if solve else "the cloud"
    axes.set_title(title, fontsize=10)
plt.show()

# %%
# The same as a film: straight from one state to the next, with a rest at each.


class Film(bytes):
    """A GIF that shows itself in notebooks and on this page."""

    def _repr_html_(self):
        data = base64.b64encode(self).decode()
        return f'<img alt="the contraction" src="data:image/gif;base64,{data}">'


axes = glsk.plot_skeleton(None, cloud=positions[0])
dots = axes.collections[0]
steps = [solve + part for solve in range(solves) for part in (0, 0, 0, 0, 0.2, 0.4, 0.6, 0.8)] + [
    solves
] * 8


def draw(step):
    before = int(step)
    one, other = positions[before], positions[min(before + 1, solves)]
    dots._offsets3d = (one + step % 1 * (other - one)).T
    axes.set_title(f"solve {before}")


with TemporaryDirectory() as folder:
    FuncAnimation(axes.figure, draw, frames=steps).save(
        Path(folder, "film.gif"), writer="pillow", fps=10, dpi=70
    )
    film = Film(Path(folder, "film.gif").read_bytes())
plt.close(axes.figure)
film
