"""
A plant that grows
==================

The same leaves from day to day: their lengths over time, and the day on which a new one appears.
"""

import warnings

import matplotlib.pyplot as plt
import numpy as np

import glsk_o3d as glsk
from glsk_o3d import samples

warnings.simplefilter("ignore", glsk.SkeletonWarning)  # a leaf is a sheet

# %%
# A young maize plant in metres, scanned once a day with 0.7 mm of noise. Each of its leaves grows by a few per cent of
# its length a day, the upper ones faster. On the fourth day there is one more.

HEIGHTS, RATES = np.array([0.12, 0.24, 0.36, 0.48]), np.array([0.01, 0.03, 0.05, 0.08])
LENGTHS, DAYS, APPEARS = np.array([0.45, 0.4, 0.35, 0.3]), 7, 3


def leaf(height, length, turn, rng):
    """Points of a leaf, a strip that leaves the stem at 35 degrees and bends over."""
    t, side = rng.random(int(9000 * length)), rng.uniform(-0.02, 0.02, int(9000 * length))
    inside = np.abs(side) < 0.02 * np.sqrt((1 - t**3) * np.minimum(0.2 + 4 * t, 1))
    t, side = t[inside], side[inside]
    steps = np.linspace(0, 1, 200)
    tilt = np.deg2rad(35 + 60 * steps)
    out, up = (
        np.interp(t, steps, length * np.cumsum(way) / 200) for way in (np.sin(tilt), np.cos(tilt))
    )
    points = np.column_stack([0.012 + out, side, height + up + 0.25 * np.abs(side)])
    return points @ np.array(
        [[np.cos(turn), np.sin(turn), 0], [-np.sin(turn), np.cos(turn), 0], [0, 0, 1]]
    )


def scan(day):
    """The points of a day."""
    rng = np.random.default_rng(day)
    stem = samples.tube(5000, length=0.6, radius=0.012, seed=day).points[:, [1, 2, 0]]
    lengths, n = LENGTHS * (1 + RATES * day), 4 if day >= APPEARS else 3
    turns = np.pi * np.arange(4) + 0.3
    leaves = [leaf(*each, rng) for each in zip(HEIGHTS[:n], lengths, turns, strict=False)]
    cloud = np.concatenate([stem + [0, 0, 0.3], *leaves])
    return cloud + rng.normal(scale=0.0007, size=cloud.shape)


# %%
# A Tracker that believes every scan, as they are a day apart: it skeletonises all of them, and averages none.

tracker = glsk.Tracker(patience=1, check=1, average=1)
days = [tracker(scan(day)) for day in range(DAYS)]
for day, plant in enumerate(days):
    print(f"day {day}: {len(plant.length)} branches, new: {plant.new}, lost: {plant.lost}")

# %%
# The identity of a leaf is that of the branch nearest to its middle. Identities stay; numbers of branches do not.

print("leaf   identity   growth, true and found [m]")
last, turns = days[-1], np.pi * np.arange(4) + 0.3
for number, (height, turn) in enumerate(zip(HEIGHTS, turns, strict=True)):
    place = [0.12 * np.cos(turn), 0.12 * np.sin(turn), height + 0.14]
    name = last.identity[last.skeleton.nearest([place]).branch[0]]
    grown = LENGTHS[number] * RATES[number] * (DAYS - 1 - (APPEARS if number == 3 else 0))
    print(f"{number:4}{name:11}{grown:14.3f}{last.growth[name]:10.3f}")

# %%
# On the left the plant on the first and on the last day, a colour per identity; on the right the lengths.
# A new leaf divides the stem: both parts keep its identity.

figure = plt.figure(figsize=(11, 4.5), layout="constrained")
for column, (day, plant) in enumerate([(0, days[0]), (DAYS - 1, last)]):
    axes = figure.add_subplot(1, 3, column + 1, projection="3d")
    glsk.plot_skeleton(None, axes, cloud=plant.skeleton.points, view=(10, -60))
    axes.set_title(f"day {day}")
    for path, name in zip(plant.skeleton.branches, plant.identity, strict=True):
        axes.plot(
            *plant.skeleton.vertices[path].T, color=f"C{name}", lw=2, clip_on=False, in_layout=False
        )
axes = figure.add_subplot(1, 3, 3)
for name in last.length:
    seen = [day for day, plant in enumerate(days) if name in plant.length]
    axes.plot(
        seen, [days[day].length[name] for day in seen], "o-", color=f"C{name}", label=f"{name}"
    )
axes.set(xlabel="day", ylabel="length of the branch [m]")
axes.legend(title="identity", loc="center left", bbox_to_anchor=(1, 0.5))
plt.show()
