"""Clouds of trees: sparse ones with known axes, and ones with a surface whose volume is known."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from glsk_o3d import samples

CONDITIONS = ("clean", "noise", "missing", "uneven")
SPARSE = dict(n=4096, forks=6)  # tips are 0.4 spacings thick
SOLID = dict(n=16384, forks=4)  # twigs are 3 spacings thick
GAPS = 12  # of a cloud with missing data
CAMERAS = np.array([[20.0, 2.0, 1.7], [-11.0, 17.0, 1.7], [-9.0, -18.0, 1.7]])  # a scanner's three places around a tree


@dataclass(frozen=True)
class SparseTree:
    """A cloud in some condition and its axis, z up: of a file ``NAME.npz``, or the built-in tree of a seed."""

    name: str
    condition: str
    path: Path | None = None
    up: str = "z"

    @property
    def facts(self) -> dict[str, str]:
        """What a row says of it."""
        return dict(condition=self.condition, tree=self.name)

    def load(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Points (n, 3), nodes (M, 3) and edges (E, 2)."""
        if self.path is None:
            return builtin(int(self.name), self.condition)
        turn = upright(self.up)
        with np.load(self.path) as archive:
            return archive[self.condition][:, turn].astype(float), archive["nodes"][:, turn], archive["edges"]


def upright(up: str) -> np.ndarray:
    """The axes x, y and z, turned round so that the one that points up is the last: (3,) int array."""
    return np.roll(np.arange(3), 2 - "xyz".index(up))


def sparse_trees(folder: Path | None, up: str, trees: int) -> list[SparseTree]:
    """The trees of a folder in all their conditions, or so many built-in ones."""
    if folder is None:
        return [SparseTree(str(seed), condition) for condition in CONDITIONS for seed in range(trees)]
    found = []
    for path in sorted(folder.glob("*.npz")):
        with np.load(path) as archive:
            found += [SparseTree(path.stem, it, path, up) for it in CONDITIONS if it in archive.files]
    return sorted(found, key=lambda tree: CONDITIONS.index(tree.condition))


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


def volume(tree: samples.Sample, n: int = 1_000_000) -> float:
    """Of the union of its tapered capsules: of each the part that is inside no earlier one, by points in its box."""
    rng, total = np.random.default_rng(0), 0.0
    low = (tree.nodes - tree.radii[:, None])[tree.edges].min(axis=1)
    high = (tree.nodes + tree.radii[:, None])[tree.edges].max(axis=1)
    boxes = (high - low).prod(axis=1)
    for i, box in enumerate(boxes):
        points = rng.uniform(low[i], high[i], (max(round(n * box / boxes.sum()), 1000), 3))
        earlier = np.flatnonzero(((low[:i] < high[i]) & (high[:i] > low[i])).all(axis=1))
        total += box * (_inside(tree, [i], points) & ~_inside(tree, earlier, points)).mean()
    return total


def _inside(tree, rows, points):
    """Which points are inside one of these capsules."""
    nodes, edges = np.unique(tree.edges[rows], return_inverse=True)
    return samples.signed_distance(points, tree.nodes[nodes], edges.reshape(-1, 2), tree.radii[nodes]) < 0
