"""Trees: clouds of them, the tools that are run on them, and what is measured."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from statistics import fmean

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components, dijkstra, minimum_spanning_tree
from scipy.spatial import cKDTree
from scipy.stats import qmc

from glsk_o3d import Skeleton, pipelines, read_cloud, samples
from glsk_o3d.analysis import cylinders, tree_measures
from glsk_o3d.analysis.curves import distances
from glsk_o3d.analysis.forestry import BREAST_HEIGHT
from glsk_o3d.geometry.vectors import dot, norm, unit
from glsk_o3d.recipes.catalogue import named_pipeline
from glsk_o3d.samples.capsules import visible

from .cylinder_models import read_cylinder_model
from .peers import PEERS, Graph, Peer, ours, separators_of_points, skeleton_of
from .stopwatch import once
from .tables import Tables, brief, good, grouped, number, pick, table

CONDITIONS = ("clean", "noise", "missing", "uneven")
SPARSE = dict(n=4096, forks=6)  # tips are 0.4 spacings thick
SOLID = dict(n=16384, forks=4)  # twigs are 3 spacings thick
GAPS = 12  # of a cloud with missing data
CAMERAS = np.array([[20.0, 2.0, 1.7], [-11.0, 17.0, 1.7], [-9.0, -18.0, 1.7]])  # a scanner's three places around a tree
NEIGHBOURS = (6, 10, 20, 30)  # with which PyGEL3D is tried, since its result hangs on them
HEIGHT = 10.0  # in metres, to which trees are scaled for PyTLidar, whose parameters are in metres
STEP = 0.002  # between the places at which curves are measured, as a share of the diagonal
CLOSE = 0.01  # places nearer to the other curve are right, as a share of the diagonal
TREE_MEASURES = ("volume", "stem_diameter", "height", "radius")
NOISE = 0.001  # share of the diagonal, 7 mm
MODEL_MEASURES = {
    "height": ("height", "height m"),
    "stem_diameter": ("stem_diameter", "stem m"),
    "length": ("length_with_traced", "length m"),
    "volume": ("volume_with_traced", "volume m3"),
}
"""What cylinder models and we measure: our name for it, and the head of the column."""
WITHOUT_TRACED = ("length", "volume")
PIPELINES = {"default, untraced": ("default", {"Tracer.surface": 0}), "default": ("default", {}), "tree": ("tree", {})}


def sparse_tree(name: str, condition: str, path: Path | None, up: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points (n, 3), nodes (M, 3) and edges (E, 2) of a tree, z up: of ``NAME.npz``, or the built-in one of a seed."""
    if path is None:
        return builtin(int(name), condition)
    turned = np.roll(np.arange(3), 2 - "xyz".index(up))
    with np.load(path) as archive:
        return archive[condition][:, turned].astype(float), archive["nodes"][:, turned], archive["edges"]


def sparse_trees(folder: Path | None, up: str, trees: int) -> list[tuple[str, str, Path | None, str]]:
    """What `sparse_tree` is given for the trees of a folder in all their conditions, or for so many built-in ones."""
    if folder is None:
        return [(str(seed), condition, None, up) for condition in CONDITIONS for seed in range(trees)]
    found = []
    for path in sorted(folder.glob("*.npz")):
        with np.load(path) as archive:
            found += [(path.stem, condition, path, up) for condition in CONDITIONS if condition in archive.files]
    return sorted(found, key=lambda tree: CONDITIONS.index(tree[1]))


def builtin(seed: int, condition: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A tree of `samples.tree` whose twigs are thinner than its points are apart, damaged by seeded code."""
    drawn = samples.tree(seed=seed, noise=0.004 if condition == "noise" else 0.0, **SPARSE)
    points, rng = drawn.points, np.random.default_rng(seed)
    if condition == "noise":  # half of the points, 0.4 % of the diagonal
        points = points[::2]
    elif condition == "missing":  # half of the points, and gaps
        centres = points[rng.choice(len(points), GAPS, replace=False)]
        points = points[(np.linalg.norm(points[:, None] - centres, axis=2) > 0.12).all(axis=1)][::2]
    elif condition == "uneven":  # a tenth as dense at the top as at the foot
        height = points[:, 2] / points[:, 2].max()
        points = points[rng.random(len(points)) < 10.0**-height]
    return points, drawn.nodes, drawn.edges


def solid(seed: int, condition: str) -> samples.Sample:
    """A tree with a surface everywhere: whole, or as a lidar saw it from three places, with 5 mm of noise."""
    if condition == "clean":
        return samples.tree(seed=seed, **SOLID)
    seen = samples.tree(seed=seed, cameras=CAMERAS, **SOLID)
    noise = np.random.default_rng(seed).normal(scale=0.005, size=seen.points.shape)
    return samples.Sample(seen.points + noise, seen.nodes, seen.edges, seen.radii, seen.name)


def scan(seed: int) -> tuple[samples.Sample, np.ndarray, int]:
    """A tree of 8 to 15 m and 15 to 50 cm, what scanners 8 to 20 m away see of it, and how many: one to three.

    A point is as probable as the surface faces the scanner. Its range has 2 to 5 mm of noise and its ray that of a beam
    3 mm wide that widens by 0.3 mrad. Of grazing ones a tenth fly up to 20 cm behind the edge, and a hundred points of
    undergrowth are around the foot.
    """
    rng = np.random.default_rng([seed, 7])
    height, radius, density = rng.uniform(8, 15), rng.uniform(0.08, 0.26), rng.uniform(1000, 4000)
    shape = dict(forks=3, length=height / 2.45, radius=radius, seed=seed)
    outline = samples.tree(1, **shape)
    ends, radii = outline.nodes[outline.edges], outline.radii[outline.edges]
    area = np.pi * (radii.sum(axis=1) * norm(ends[:, 1] - ends[:, 0])).sum()
    tree = samples.tree(round(density * area), **shape)
    axes = tree.nodes, tree.edges, tree.radii
    at = samples.signed_distance(tree.points, *axes)
    normals = np.stack([samples.signed_distance(tree.points + 1e-5 * way, *axes) - at for way in np.eye(3)], axis=1)
    normals = unit(normals)
    scanners, noise = int(rng.integers(1, 4)), rng.uniform(0.002, 0.005)
    around = rng.uniform(0, 2 * np.pi) + 2 * np.pi * np.arange(scanners) / scanners + rng.uniform(-0.5, 0.5, scanners)
    far = rng.uniform(8, 20, scanners)
    found = [np.column_stack([rng.uniform(-1, 1, (100, 2)), rng.uniform(0, 2, 100)])]
    for place in np.column_stack([far * np.cos(around), far * np.sin(around), np.full(scanners, 1.7)]):
        faces = -dot(unit(tree.points - place), normals)
        seen = np.flatnonzero((rng.random(len(faces)) < faces) & (tree.points[:, 2] > 0))
        seen = seen[visible(tree.points[seen], place, *axes)]
        away = norm(tree.points[seen] - place)
        beam = (0.003 + 0.0003 * away) / 4  # four standard deviations are its width
        rays = tree.points[seen] - place + beam[:, None] * rng.normal(size=(len(seen), 3))
        fly = (faces[seen] < 0.15) & (rng.random(len(seen)) < 0.1)
        ranges = away + noise * rng.normal(size=len(seen)) + fly * rng.uniform(0, 0.2, len(seen))
        found.append(place + ranges[:, None] * unit(rays))
    return tree, np.concatenate(found), scanners


def leafy(seed: int) -> tuple[np.ndarray, float]:
    """A tree of 4 to 14 m, of every second seed with leaves, and the share of the points that these have.

    Leaves are discs of 1 to 5 cm, at most 5 to 25 cm from limbs of the thinner half. Their surface is 0.1 to 6 times
    that of the wood, and as dense in points, of which there are 500 to 5000 per square metre with 0.5 to 4 mm of noise.
    Three scanners see the wood of every third tree.
    """
    rng = np.random.default_rng([seed, 8])
    height = rng.uniform(4, 14)
    shape = dict(
        forks=int(rng.integers(3, 7)), length=height / 2.45, radius=height * rng.uniform(0.008, 0.02), seed=seed
    )
    outline = samples.tree(1, **shape)
    ends, radii = outline.nodes[outline.edges], outline.radii[outline.edges]
    length = norm(ends[:, 1] - ends[:, 0])
    area = np.pi * (radii.sum(axis=1) * length).sum()
    density = min(500 * 10 ** rng.random(), 25_000 / area)
    cameras = None if seed % 3 else CAMERAS
    points = samples.tree(int(density * area), cameras=cameras, **shape).points
    more, size, reach = 0.1 * 60 ** rng.random(), rng.uniform(0.01, 0.05), rng.uniform(0.05, 0.25)
    found = [points]
    if seed % 2:
        thin = np.flatnonzero(radii.mean(axis=1) < np.median(radii))
        limb = rng.choice(thin, int(more * area / (np.pi * size**2)), p=length[thin] / length[thin].sum())
        far = radii[limb].max(axis=1) + size + reach * rng.random(len(limb))
        middle = ends[limb, 0] + rng.random((len(limb), 1)) * (ends[limb, 1] - ends[limb, 0])
        middle += far[:, None] * unit(rng.normal(size=middle.shape))
        axes = np.linalg.qr(rng.normal(size=(len(limb), 3, 3)))[0][:, :2]
        leaf = rng.integers(len(limb), size=int(min(density * more * area, 40_000)))
        turn, out = rng.uniform(0, 2 * np.pi, len(leaf)), size * np.sqrt(rng.random(len(leaf)))
        on_leaf = out[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])
        found.append(middle[leaf] + (on_leaf[:, :, None] * axes[leaf]).sum(axis=1))
    cloud = np.concatenate(found)
    return cloud + rng.uniform(0.0005, 0.004) * rng.normal(size=cloud.shape), 1 - len(points) / len(cloud)


def volume(tree: samples.Sample, n: int = 4_000_000) -> float:
    """Of the union of its tapered capsules: of each the part that is inside no earlier one, by points in its box.

    Points of a Halton sequence: a million random ones were 0.2 % too high, the same way for all trees.
    """
    total = 0.0
    low = (tree.nodes - tree.radii[:, None])[tree.edges].min(axis=1)
    high = (tree.nodes + tree.radii[:, None])[tree.edges].max(axis=1)
    boxes = (high - low).prod(axis=1)
    counts = np.maximum(np.round(n * boxes / boxes.sum()).astype(int), 1000)
    spread = qmc.Halton(3, seed=0).random(counts.max())
    for i, box in enumerate(boxes):
        points = low[i] + (high[i] - low[i]) * spread[: counts[i]]
        earlier = np.flatnonzero(((low[:i] < high[i]) & (high[:i] > low[i])).all(axis=1))
        total += box * (_inside(tree, [i], points) & ~_inside(tree, earlier, points)).mean()
    return total


def _inside(tree, rows, points):
    """Which points are inside one of these capsules."""
    nodes, edges = np.unique(tree.edges[rows], return_inverse=True)
    return samples.signed_distance(points, tree.nodes[nodes], edges.reshape(-1, 2), tree.radii[nodes]) < 0


def level_sets(points: np.ndarray, k: int = 10) -> Graph:
    """Points in bands of equal geodesic distance from the lowest one; each connected piece of a band is a vertex."""
    n, (distance, neighbour) = len(points), cKDTree(points).query(points, k + 1)
    near = coo_matrix((distance[:, 1:].ravel(), (np.repeat(np.arange(n), k), neighbour[:, 1:].ravel())), (n, n)).tocsr()
    graph = near.maximum(near.T)
    while (pieces := connected_components(graph)[1]).any():  # join what is apart where it is nearest, piece by piece
        apart = pieces != pieces[0]
        gap, other = cKDTree(points[apart]).query(points[~apart])
        link = np.flatnonzero(~apart)[gap.argmin()], np.flatnonzero(apart)[other[gap.argmin()]]
        graph = graph.maximum(coo_matrix((np.full(2, gap.min()), (link, link[::-1])), (n, n)).tocsr())
    from_root = dijkstra(graph, indices=points[:, 2].argmin())
    band = (from_root / (1.5 * np.median(distance[:, 1:4]))).astype(int)
    a, b = graph.nonzero()
    same = band[a] == band[b]
    count, vertex = connected_components(coo_matrix((np.ones(same.sum()), (a[same], b[same])), (n, n)))
    places = np.stack([np.bincount(vertex, axis) for axis in points.T], axis=1) / np.bincount(vertex)[:, None]
    ends = np.unique(np.stack([vertex[a[~same]], vertex[b[~same]]], axis=1), axis=0)
    lengths = np.linalg.norm(np.diff(places[ends], axis=1)[:, 0], axis=1)
    tree = minimum_spanning_tree(coo_matrix((lengths + 1e-12, ends.T), (count, count)))
    return places, np.column_stack(tree.nonzero())


def pytlidar(points: np.ndarray) -> Graph:
    """PyTLidar's TreeQSM with the inputs that it estimates; the axes of its cylinders, each joined to its parent."""
    from PyTLidar.treeqsm import treeqsm
    from PyTLidar.Utils.define_input import define_input

    scale, foot = HEIGHT / np.ptp(points[:, 2]), points.min(axis=0)
    cloud = (points - foot) * scale
    silent = dict.fromkeys(("plot", "savetxt", "savemat", "savepdf", "disp"), 0)
    models, _ = treeqsm(cloud, define_input(cloud, 1, 1, 1)[0] | silent)
    found = models[0]["cylinder"]
    n, parent = len(found["start"]), np.asarray(found["parent"], int)
    start = np.asarray(found["start"], float)
    end = start + np.asarray(found["axis"], float) * np.asarray(found["length"], float)[:, None]
    child = np.flatnonzero(parent >= 0)
    further = np.linalg.norm(end[parent[child]] - start[child], axis=1)
    nearer_end = np.where(further < np.linalg.norm(start[parent[child]] - start[child], axis=1), n, 0) + parent[child]
    cylinders = np.column_stack([np.arange(n), n + np.arange(n)])
    return np.concatenate([start, end]) / scale + foot, np.concatenate(
        [cylinders, np.stack([nearer_end, child], axis=1)]
    )


TOOLS: dict[str, Peer] = {
    "tree": Peer("`tree`", (), "points", partial(ours, "tree")),
    "default": PEERS["default"],
    "untraced": Peer(
        "`default`, `Tracer.surface=0`", (), "points", partial(ours, "default", options={"Tracer.surface": 0})
    ),
    "cao2010": PEERS["cao2010"],
    "levels": Peer("geodesic level sets", (), "points", level_sets),
    "pytlidar": Peer("PyTLidar, TreeQSM", ("PyTLidar",), "points", pytlidar),
    **{
        f"pygel-{k}": Peer(
            f"PyGEL3D, {k} neighbours", ("PyGEL3D",), "points", partial(separators_of_points, neighbours=k)
        )
        for k in NEIGHBOURS
    },
    "pc-skeletor": PEERS["pc-skeletor"],
    "cgal": PEERS["cgal"],
}
"""By name; each is given points with z up."""


def score(points: np.ndarray, axis: Skeleton, found: Skeleton) -> dict[str, float]:
    """Shares of both curves that are close to the other, mean distances in percent of the diagonal, and topology."""
    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    there, back = (distances(*pair, STEP * diagonal)[0] / diagonal for pair in ((found, axis), (axis, found)))
    precision, recall = (float((way < CLOSE).mean()) for way in (there, back))
    return dict(
        f1=2 * precision * recall / max(precision + recall, 1e-9),
        precision=precision,
        recall=recall,
        accuracy=100 * float(there.mean()),
        completeness=100 * float(back.mean()),
        tips=len(found.leaves) / len(axis.leaves),
        components=found.n_components,
        loops=found.n_loops,
    )


def measure_curve(tree: tuple[str, str, Path | None, str], tool: Peer) -> dict:
    """One skeleton against its axis."""
    points, nodes, edges = sparse_tree(*tree)
    found, cpu = tool.timed(points)
    return dict(cpu=cpu, points=len(points)) | score(points, skeleton_of(nodes, edges), found)


def curve_tables(rows: list[dict]) -> Tables:
    """F1 in every condition at a glance, and more of the first one."""
    conditions, lines = list(grouped(rows, "condition")), []
    for tool, here in grouped(rows, "tool").items():
        f1 = [number(mean(pick(here, condition=it), "f1"), 2) for it in conditions]
        whole = sum(row["components"] == 1 and row["loops"] == 0 for row in good(here))
        first = pick(here, condition=conditions[0])
        more = [number(mean(first, key), 2) for key in ("accuracy", "completeness", "tips", "cpu")]
        failed = [f"{row['tree']} {row['condition']} ({row['failure']})" for row in here if "failure" in row]
        lines.append([TOOLS[tool].label, *f1, f"{whole}/{len(here)}", *more, ", ".join(failed)])
    header = ["", *conditions, "one tree", "accuracy %", "completeness %", "tips", "CPU s", "failed"]
    return [(f"F1 of {len(grouped(rows, 'tree'))} sparse trees, and more of the {conditions[0]} ones", header, lines)]


def mean(rows: list[dict], key: str) -> float:
    """Over the trees that gave a skeleton."""
    known = [row[key] for row in good(rows)]
    return fmean(known) if known else float("nan")


def measure_tree(seed: int, condition: str) -> dict[str, float]:
    """Errors of one tree, as shares of what is true."""
    drawn = solid(seed, condition)
    skeleton = pipelines.tree()(drawn.points)
    found = tree_measures(skeleton)
    stem = diameter_at(drawn, BREAST_HEIGHT + drawn.points[:, 2].min())
    nearest = cKDTree(drawn.nodes).query(skeleton.vertices)[1]
    true = dict(
        volume=(cylinders(skeleton).volume.sum(), volume(drawn)),
        stem_diameter=(found.stem_diameter, stem),
        height=(found.height, (drawn.nodes[:, 2] + drawn.radii).max() - (drawn.nodes[:, 2] - drawn.radii).min()),
        radius=(np.median(skeleton.radii / drawn.radii[nearest]), 1.0),
    )
    return {name: float(mine / known - 1) for name, (mine, known) in true.items()}


def measure_stem(seed: int) -> dict[str, float]:
    """Diameter and volume of a scanned tree, as found and as they are above the ground, which is z = 0."""
    tree, points, scanners = scan(seed)
    found = tree_measures(pipelines.tree()(points))
    return dict(
        scanners=scanners,
        stem_diameter=found.stem_diameter,
        true_diameter=diameter_at(tree, BREAST_HEIGHT),
        volume=sum(found.volume),
        true_volume=volume(tree) - 2 / 3 * np.pi * float(tree.radii[0]) ** 3,
    )


def measure_leaves(seed: int) -> dict:
    """What the doubts of a tree with leaves, or without, ask for."""
    cloud, share = leafy(seed)
    asked = [
        word for word in ("leaf-off", "more points") if word in " ".join(tree_measures(pipelines.tree()(cloud)).doubts)
    ]
    return dict(leaves=share, asked=" or ".join(asked) or "nothing")


def leaf_tables(rows: list[dict]) -> Tables:
    """How many trees without and with leaves are asked for what."""
    answers = ("nothing", "more points", "leaf-off or more points", "leaf-off")
    kinds = {"bare": (0, 0), "leaves have up to 30 % of the points": (1e-9, 0.3), "leaves have more": (0.3, 1)}
    lines = []
    for kind, (low, high) in kinds.items():
        here = [row["asked"] for row in good(rows) if low <= row["leaves"] <= high]
        lines.append([kind, f"{len(here)}", *(f"{here.count(answer)}" for answer in answers)])
    return [("What is asked for, of trees with leaves and without", ["", "trees", *answers], lines)]


def diameter_at(tree: samples.Sample, height: float) -> float:
    """That of the true stem, whose nodes are the first."""
    return float(np.interp(height, tree.nodes[:7, 2], 2 * tree.radii[:7]))


def measure_model(cloud: Path, model: Path, unit: float, names: tuple[str, ...] = ()) -> dict:
    """What we and a cylinder model say of a scanned tree."""
    found, theirs = tree_measures(pipelines.tree()(read_cloud(cloud)), unit=unit), read_cylinder_model(model, names)
    said = {name: (getattr(found, ours), getattr(theirs, name)) for name, (ours, _) in MODEL_MEASURES.items()}
    without = dict(length_without=found.length_without_traced, volume_without=found.volume_without_traced)
    return said | without | dict(doubts=found.doubts)


def model_tables(rows: list[dict]) -> Tables:
    """A line for each tree: ours, of some without traced parts too, and theirs."""
    lines = []
    for row in rows:
        values = []
        for name in MODEL_MEASURES:
            ours, theirs = row.get(name, ("-", "-"))
            values += [ours, *([row.get(f"{name}_without", "-")] if name in WITHOUT_TRACED else []), theirs]
        cells = [it if isinstance(it, str) else f"{it:.3g}" for it in values]
        lines.append([row["tree"], *cells, row.get("failure") or "; ".join(row["doubts"])])
    header = [""]
    for name, (_, label) in MODEL_MEASURES.items():
        header += [label, *(["without traced"] if name in WITHOUT_TRACED else []), "theirs"]
    return [("Scanned trees, and cylinder models of them", [*header, "note"], lines)]


def stem_tables(rows: list[dict]) -> Tables:
    """Good diameters and volumes by seeds and scanners."""
    lines = []
    for seeds, here in grouped(good(rows), "seeds").items():
        for n in (1, 2, 3):
            if some := pick(here, scanners=n):
                lines.append([f"{seeds} seeds, {n} scanner{'s' * (n > 1)}", *stem_cells(some)])
        lines.append([f"{seeds} seeds, all", *stem_cells(here)])
    header = ["", "trees", "within 3 %", "median error %", "volume: median error %"]
    return [("Stem diameters at 1.3 m, and volumes, of scanned trees", header, lines)]


def stem_cells(rows: list[dict]) -> list[str]:
    """How good the diameters and volumes of some trees are."""
    stem = np.abs([row["stem_diameter"] / row["true_diameter"] - 1 for row in rows])
    wood = np.abs([row["volume"] / row["true_volume"] - 1 for row in rows])
    return [f"{len(rows)}", f"{(stem < 0.03).sum()}", f"{100 * np.nanmedian(stem):.2f}", f"{100 * np.median(wood):.1f}"]


def measure_tables(rows: list[dict]) -> Tables:
    """The median error of each measure, its quartiles, and the worst."""
    lines = []
    for condition, here in grouped(rows, "condition").items():
        known = good(here)
        for name in TREE_MEASURES if known else ():
            errors = 100 * np.array([row[name] for row in known])
            low, median, high = np.quantile(errors, [0.25, 0.5, 0.75])
            size = np.abs(errors)
            cells = [f"{np.median(size):.1f}", f"{median:+.1f} ({low:+.1f} to {high:+.1f})", f"{size.max():.1f}"]
            lines.append([f"{condition}: {name.replace('_', ' ')}", *cells, f"{len(here) - len(known)}"])
    header = ["", "median size", "median (quartiles)", "largest", "failures"]
    return [(f"Errors of {len(grouped(rows, 'tree'))} trees, in percent", header, lines)]


def measure_scan(path: Path, pipeline: str) -> dict:
    """One run on a saved scan, to be made in a fresh process."""
    name, options = PIPELINES[pipeline]
    skeleton, costs = once(named_pipeline(name).with_options(options), np.load(path))
    counts = dict(components=skeleton.n_components, loops=skeleton.n_loops, tips=len(skeleton.leaves))
    return costs | counts | dict(traced=skeleton.report.n_traced)


def large_tables(rows: list[dict]) -> Tables:
    """A line for each size and pipeline."""
    columns = {"": "pipeline", "points": "n", "CPU s": brief("cpu"), "wall s": brief("wall"), "MB": brief("peak")}
    columns |= {name: name for name in ("components", "loops", "tips", "traced")}
    return [table("Lidar scans of one tree", rows, columns)]
