"""``glsk batch --tiles`` on one large scene of many objects: is each found once, and are the seams as good as the rest?

Everything is run as its users run it: the command ``glsk``, as a process; in a second run one of two workers is
killed in the midst.
"""

from __future__ import annotations

import os
import resource
import tempfile
from functools import partial
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import typer
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from glsk_o3d import Skeleton, read_skeleton, samples
from glsk_o3d.analysis.curves import along, pieces
from glsk_o3d.apps.batch.tiles import Grid
from glsk_o3d.io.formats import ply

from .batch import facts_table, glsk_batch, kill_one, ledger
from .runs import Output, application, writable
from .tables import BLUE, INK, present, save, save_figure, sheet

COLUMNS, ROWS, ROOM = 10, 5, 1.8  # objects along x and y, and their distance
ON_SEAMS = ((3, 6), (1, 3))  # columns that stand exactly on a seam, and rows: four objects stand on corners of tiles
SIZE = 3.0
NOISE = 0.002
STEP = 0.01  # between the places at which curves are compared
TIP = 5  # radii from the end of an axis up to which it may be missed: curve skeletons end early, in tiles or not
SHAPES = (
    partial(samples.tree, length=0.45, radius=0.045, forks=3),
    partial(samples.sauropod, cameras=None),
    samples.torus,
    samples.helix,
    samples.y_junction,
    samples.two_rings,
    partial(samples.tree, length=0.5, radius=0.05, forks=2),
)
app = application(None)


class Scene(NamedTuple):
    """Objects with known axes, and the grid of the tiles."""

    points: np.ndarray
    axes: list[Skeleton]
    grid: Grid


def make_scene(count: int) -> Scene:
    """Objects turned at random, some of them exactly on seams and corners of the tiles."""
    rng = np.random.default_rng(0)
    cells = np.stack(np.meshgrid(np.arange(COLUMNS), np.arange(ROWS), indexing="ij"), -1).reshape(-1, 2)
    places = np.column_stack([ROOM * cells, np.zeros(len(cells))])
    drawn = []
    for at in range(len(cells)):
        sample = SHAPES[at % len(SHAPES)](count // len(cells), noise=NOISE, seed=at)
        turn = Rotation.from_euler("z", rng.uniform(0, 2 * np.pi))
        low, high = sample.points.min(axis=0), sample.points.max(axis=0)
        middle = np.append((low + high)[:2] / 2, low[2])
        middle[:2] = sample.nodes[0, :2] if sample.name == "tree" else middle[:2]  # its trunk stands on the corner
        drawn.append((turn.apply(sample.points - middle), turn.apply(sample.nodes - middle), sample))
    low = np.min([points.min(axis=0) + at for (points, _, _), at in zip(drawn, places, strict=True)], axis=0)
    high = np.max([points.max(axis=0) + at for (points, _, _), at in zip(drawn, places, strict=True)], axis=0)
    grid = Grid.over(low, high, SIZE, SIZE / 8)
    for axis, on_seam in enumerate(ON_SEAMS):
        some = np.isin(cells[:, axis], on_seam)
        places[some, axis] = low[axis] + grid.cell[axis] * np.round((places[some, axis] - low[axis]) / grid.cell[axis])
    axes = [
        Skeleton(nodes + at, sample.edges, sample.radii, (), (), ())
        for (_, nodes, sample), at in zip(drawn, places, strict=True)
    ]
    points = np.concatenate([points + at for (points, _, _), at in zip(drawn, places, strict=True)])
    return Scene(points[rng.permutation(len(points))], axes, grid)


def checked(found: Skeleton, scene: Scene) -> dict:
    """What became of every object, how far the skeleton is from the axes, and whether a part is there twice."""
    cut = [(axis, *pieces(axis.vertices, axis.edges, STEP)) for axis in scene.axes]
    truth = np.concatenate([along(axis.edges, row, part, axis.vertices) for axis, row, part in cut])
    radius = np.concatenate([along(axis.edges, row, part, axis.radii) for axis, row, part in cut])
    owner = np.repeat(np.arange(len(cut)), [len(row) for _, row, _ in cut])
    tips = np.concatenate([axis.vertices[axis.leaves] for axis in scene.axes])
    row, part = pieces(found.vertices, found.edges, STEP)
    here = along(found.edges, row, part, found.vertices)
    distance, nearest = cKDTree(truth).query(here)
    missed = (cKDTree(here).query(truth)[0] > radius) & (cKDTree(tips).query(truth)[0] > TIP * radius)
    piece, wrong = found.component_of_vertex[found.edges[row, 0]], []
    owners = np.array([np.bincount(owner[nearest[piece == c]]).argmax() for c in range(found.n_components)])
    for at, axis in enumerate(scene.axes):
        vertices = np.isin(found.component_of_vertex, np.flatnonzero(owners == at))
        components = int((owners == at).sum())
        loops = int(vertices[found.edges[:, 0]].sum() - vertices.sum() + components)
        if (components, loops) != (axis.n_components, axis.n_loops) or missed[owner == at].any():
            wrong.append((at, components, loops, int(missed[owner == at].sum())))
    gaps = [np.abs(here[:, [axis]] - planes).min(axis=1) for axis, planes in _seams(scene.grid)]
    at_seam = np.min(gaps, axis=0) < scene.grid.overlap
    facts = {"objects": len(scene.axes), "right": len(scene.axes) - len(wrong), "wrong": wrong}
    facts |= {"components": found.n_components, "twice": _twice(found)}
    facts["length"] = found.length / sum(axis.length for axis in scene.axes)
    for where, which in (("at seams", at_seam), ("elsewhere", ~at_seam)):
        facts |= {f"median {where}": float(np.median(distance[which]))}
        facts |= {f"95 % {where}": float(np.quantile(distance[which], 0.95))}
        facts |= {f"most {where}": float(distance[which].max())}
        facts |= {f"most over radius {where}": float((distance / radius[nearest])[which].max())}
    return facts


def _seams(grid: Grid):
    for axis in range(3):
        if grid.counts[axis] > 1:
            yield axis, grid.low[axis] + grid.cell[axis] * np.arange(1, grid.counts[axis])


def _twice(found: Skeleton) -> int:
    """Vertices with another one nearer than half their radius, and farther than three radii along the curve."""
    n = len(found.vertices)
    pairs = cKDTree(found.vertices).query_pairs(found.radii.max() / 2, output_type="ndarray")
    apart = np.linalg.norm(found.vertices[pairs[:, 0]] - found.vertices[pairs[:, 1]], axis=1)
    pairs = pairs[apart < found.radii[pairs].min(axis=1) / 2]
    graph = coo_array((found.edge_lengths, found.edges.T), shape=(n, n)).tocsr()
    starts = np.unique(pairs[:, 0])
    reach = dijkstra(graph, directed=False, indices=starts, limit=3 * found.radii.max())
    along_curve = reach[np.searchsorted(starts, pairs[:, 0]), pairs[:, 1]]
    return int((along_curve > 3 * found.radii[pairs].min(axis=1)).sum())


def draw(found: Skeleton, scene: Scene, path: Path) -> None:
    """The skeleton and the axes from above, with the borders of the tiles."""
    figure, axes = sheet(9.5, width=18.0)
    for axis, planes in _seams(scene.grid):
        for plane in planes:
            (axes.axvline if axis == 0 else axes.axhline)(plane, color=BLUE, linewidth=0.8)
    for axis in scene.axes:
        for a, b in axis.vertices[axis.edges]:
            axes.plot(*np.stack([a, b])[:, :2].T, color="#bbbbbb", linewidth=3)
    for branch in found.branches:
        axes.plot(*found.vertices[branch, :2].T, linewidth=1)
    axes.plot(*found.vertices[found.leaves, :2].T, "o", color=INK, markersize=2)
    axes.set_aspect("equal")
    save_figure(figure, path)


@app.command()
def main(
    points: Annotated[int, typer.Option("--points", min=50_000, help="Of all fifty objects together.")] = 20_000_000,
    picture: Annotated[
        Path | None, typer.Option("--picture", metavar="PNG", help="Draw the skeleton from above.", callback=writable)
    ] = None,
    output: Output = None,
) -> None:
    """Skeletonise a large scene in tiles, and kill a worker in the midst of it."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        scene, path = make_scene(points), folder / "scene.ply"
        ply.save(path, {"positions": scene.points})
        undisturbed = glsk_batch(path, folder / "whole", "--tiles", str(SIZE), "--workers", "2")
        most = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 2**20
        rows = {row["name"]: row for row in ledger(folder / "whole")}
        killed = kill_one(path, folder / "killed", max(2, len(rows) // 3), "--tiles", str(SIZE))
        results = [folder / run / "scene.ply" for run in ("whole", "killed")]
        killed["bits as in the undisturbed run"] = results[0].read_bytes() == results[1].read_bytes()
        found, joined = read_skeleton(results[1]), rows.pop("scene")
    facts = {"points": points, "tiles": len(rows), "wall": undisturbed["wall"], "most memory of a process": most}
    facts |= {"seams": joined["seams"], "unmatched": joined["unmatched"], **checked(found, scene)}
    facts["seconds of a tile, most"] = max(row["seconds"] for row in rows.values())
    if picture is not None:
        draw(found, scene, picture)
    title = f"One scene of {points} points, 50 objects, tiles of {SIZE:g}, two workers, {os.cpu_count()} cores"
    present([facts_table(title, facts), facts_table("Again, one of two workers killed", killed)])
    save(output, [{"run": "undisturbed", **facts}, {"run": "one of two workers killed", **killed}])
