"""Answers of several tools to one cloud, side by side."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from _common.plots import BLUE, ORANGE, keep, sheet
from _peers import PEERS
from glsk_bench import BenchmarkFolder
from glsk_bench.scoring import answer_files

from glsk_o3d import plot_skeleton, read_cloud, read_skeleton
from glsk_o3d.interop.atomic import write_atomically
from glsk_o3d.interop.clouds import cloud_points

from .kept import Entry

COLUMNS = 3
VIEW = (14, -60)  # elevation and azimuth, in degrees


def board(rows: list[dict[str, Any]], folder: Path) -> Path:
    """The entries of a `Leaderboard`, with intervals: right topologies and perfect ones, and errors."""
    places = np.arange(len(rows))
    figure, (left, right) = sheet(1.1 + 0.27 * len(rows), columns=2, sharey=True, width=7.0)
    for axes, measures in ((left, ("topology", "perfect")), (right, ("error",))):
        axes.hlines(places, 0, 1, transform=axes.get_yaxis_transform(), color="#e4e4e4", linewidth=0.8, zorder=0)
        axes.tick_params(axis="y", length=0)
        for measure in measures:
            means, low, high = np.transpose([row["all"][measure] or [np.nan] * 3 for row in rows])
            style = dict(color=ORANGE if measure == "perfect" else BLUE)
            axes.hlines(places, low, high, linewidth=2, **style)
            axes.plot(means, places, "o", markersize=5, label=measure if axes is left else None, **style)
    left.set(xlabel="share of all clouds", xlim=(-0.02, 1), ylim=(len(rows) - 0.5, -0.5))
    left.set_yticks(places, [title(row["name"]) for row in rows])
    right.set(xlabel="mean error, local radii", xscale="log")
    ticks = [0.1, 0.2, 0.5, 1, 2, 5]
    right.set_xticks(ticks, map(str, ticks))
    right.minorticks_off()
    figure.legend(loc="outside upper center", ncols=3, frameon=False)
    return keep(figure, folder, "leaderboard")


def title(name: str) -> str:
    """A tool as pictures name it."""
    peer = PEERS[name]
    return peer.label.strip("`") if peer.takes == "points" else f"{peer.label}, {peer.takes.split()[-1]}"


def draw(bench: BenchmarkFolder, answers: Path, cloud: str, entries: list[Entry], path: Path) -> None:
    """The skeletons of a cloud, each with its error and what is wrong with its topology."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from PIL import Image

    (where,) = (each.path for each in bench.clouds if each.name == cloud)
    points = cloud_points(read_cloud(where))
    lines = -(-len(entries) // COLUMNS)
    figure = Figure((3.4 * COLUMNS, 2.7 * lines), dpi=150, layout="constrained")
    canvas = FigureCanvasAgg(figure)
    for i, entry in enumerate(entries):
        axes = figure.add_subplot(lines, COLUMNS, i + 1, projection="3d")
        found = answer_files(answers / entry.tool).get(cloud)
        plot_skeleton(read_skeleton(found[0]) if found else None, axes, cloud=points, view=VIEW)
        axes.set_title(caption(entry, cloud), fontsize=9)
    canvas.draw()
    pixels = np.asarray(canvas.buffer_rgba())[:, :, :3]
    image = Image.fromarray(pixels).quantize(32)  # a fifth of the size of a figure's
    write_atomically(path, lambda temporary: image.save(temporary, "PNG", optimize=True))


def caption(entry: Entry, cloud: str) -> str:
    """What stands above a skeleton."""
    (row,) = (row for row in entry.results.rows if f"{row['shape']}_{row['variant']}" == cloud)
    label = title(entry.tool)
    if row["failure"] is not None:
        return f"{label}\n{row['failure']}"
    off = ", ".join(f"{name} {row[name]:+d}" for name in ("components", "loops") if row[name])
    return f"{label}\nerror {row['error']:.2f}, {off or 'right topology'}"
