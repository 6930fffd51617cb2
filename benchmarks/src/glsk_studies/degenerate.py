"""Degenerate clouds, drawn from one generator, through the pipelines; and what a skeleton must be whatever it is of."""

from __future__ import annotations

import warnings
from dataclasses import fields
from typing import Any

import numpy as np

import glsk_o3d as glsk
from glsk_o3d import GlskError, Pipeline, Refiner, Sampler, Skeleton, SkeletonWarning, samples
from glsk_o3d.geometry.vectors import unit

PIPELINES = ("default", "tree", "cao2010", "wen2024")
FITTED_SLACK = 0.0501  # of the diagonal: what a fit to the axis may do, see FIT_BEYOND
CONTRACTED_SLACK = 0.1001  # of the longest side: what a contraction may do, see CLOUD_SLACK
SAME_CURVE = 1e-6  # of the diagonal: how far two skeletons of one cloud may be apart


def _plain(rng: np.random.Generator) -> np.ndarray:
    """A shape, or a heap of points."""
    n = int(rng.integers(20, 400))
    if rng.random() < 0.3:
        return rng.normal(size=(n, 3))
    shape = str(rng.choice(["tube", "torus", "y_junction", "helix", "sheet", "two_rings"]))
    return getattr(samples, shape)(n, seed=int(rng.integers(2**31))).points


def _dense(rng: np.random.Generator) -> np.ndarray:
    """So many points that some are merged before they are contracted."""
    return samples.torus(int(rng.integers(1000, 2500)), seed=int(rng.integers(2**31))).points


def _tiny(rng: np.random.Generator) -> np.ndarray:
    return rng.normal(size=(int(rng.integers(0, 21)), 3))


def _duplicates(rng: np.random.Generator) -> np.ndarray:
    """Each point a few times, or nearly all of them in one place."""
    points = _plain(rng)
    if rng.random() < 0.5:
        return points[rng.integers(0, len(points), int(rng.integers(1, 4)) * len(points))]
    return np.concatenate([np.repeat(points[:1], 2000, axis=0), points[:30]])


def _collinear(rng: np.random.Generator) -> np.ndarray:
    n = int(rng.integers(2, 200))
    along = np.arange(n) if rng.random() < 0.3 else rng.random(n)
    direction = np.eye(3)[rng.integers(3)] if rng.random() < 0.5 else rng.normal(size=3)
    return along[:, None] * direction + rng.choice([0, 0, 1, 1e4]) * rng.normal(size=3)


def _flat(rng: np.random.Generator) -> np.ndarray:
    """Squeezed along one axis or two, to nothing or nearly so."""
    thin = rng.choice([0, 0, 1e-15, 1e-12, 1e-9, 1e-6])
    return _plain(rng) * rng.permutation([1, rng.choice([1, 1, 10.0 ** rng.uniform(-16, 0)]), thin])


def _lattice(rng: np.random.Generator) -> np.ndarray:
    """Whole numbers along one, two or three axes, some of them missing."""
    sides = [rng.integers(1, most + 1, 3) for most in (7, 20)]
    sides = sides[0] if rng.random() < 0.7 else sides[1] * rng.permutation([1, 1, 0])
    points = np.stack(np.meshgrid(*(np.arange(max(side, 1)) for side in sides)), -1).reshape(-1, 3).astype(float)
    return points[rng.random(len(points)) < rng.choice([1, 1, 0.9, 0.5])]


def _surface_lattice(rng: np.random.Generator) -> np.ndarray:
    """The border of a box of whole numbers: equal distances on a surface that has an axis."""
    sides = rng.integers(3, 12, 3) + [0, 0, int(rng.integers(20))]
    points = np.stack(np.meshgrid(*map(np.arange, sides)), -1).reshape(-1, 3)
    return points[((points == 0) | (points == sides - 1)).any(axis=1)].astype(float)


def _rounded(rng: np.random.Generator) -> np.ndarray:
    return np.round(_plain(rng) * rng.integers(1, 12))


def _circle(rng: np.random.Generator) -> np.ndarray:
    """Equal spacing around, perhaps on a torus or a tube."""
    n, rows = int(rng.integers(3, 40)), int(rng.integers(1, 12))
    angle, row = np.meshgrid(2 * np.pi * np.arange(n) / n, np.arange(rows) * rng.choice([0.1, 1, 2 * np.pi / n]))
    return np.column_stack([np.cos(angle.ravel()), np.sin(angle.ravel()), row.ravel()])


def _outlier(rng: np.random.Generator) -> np.ndarray:
    """One point, a few or most of them once more, far away."""
    points = _plain(rng)
    few = points[: int(rng.choice([1, 3, len(points) - 1]))]
    return np.concatenate([points, few + 10.0 ** rng.uniform(1, 15) * rng.normal(size=3)])


def _clusters(rng: np.random.Generator) -> np.ndarray:
    """Some places, near or far, each as wide as some roundings or more, or not at all."""
    centres = 10.0 ** rng.choice([0, 0, rng.uniform(-3, 8)]) * rng.normal(size=(int(rng.integers(2, 12)), 3))
    points = centres[rng.integers(0, len(centres), int(rng.integers(2, 400)))]
    return points + rng.choice([0, 10.0 ** rng.uniform(-15, -1)]) * rng.normal(size=points.shape)


def _offset(rng: np.random.Generator) -> np.ndarray:
    return _plain(rng) + 10.0 ** rng.uniform(3, 16) * rng.normal(size=3)


def _extreme(rng: np.random.Generator) -> np.ndarray:
    """Of any size that a number can have, or at the limits of what is taken."""
    exponent = rng.uniform(-308, 308) if rng.random() < 0.5 else rng.choice([-1, 1]) * rng.uniform(100, 125)
    with np.errstate(over="ignore", under="ignore"):
        return _plain(rng) * 10.0**exponent


def _invalid(rng: np.random.Generator) -> np.ndarray:
    points = _plain(rng)
    points[rng.random(points.shape) < rng.choice([0.001, 0.1, 0.9])] = rng.choice([np.nan, np.inf, -np.inf, 1e308])
    return points


def _denormal(rng: np.random.Generator) -> np.ndarray:
    points = _plain(rng)
    small = rng.random(points.shape) < rng.choice([0.1, 0.5, 1])
    return np.where(small, points * 5e-324 * rng.choice([1, 10, 1e5]), points)


def _roundings(rng: np.random.Generator) -> np.ndarray:
    """Some roundings wide, far from the origin, or with some points so near to others."""
    points = _plain(rng)
    if rng.random() < 0.5:
        points = np.broadcast_to(points[0], points.shape)
    return points + np.spacing(np.abs(points)) * rng.integers(0, 10 ** int(rng.integers(1, 6)), points.shape)


def _sphere(rng: np.random.Generator) -> np.ndarray:
    return unit(rng.normal(size=(int(rng.integers(10, 400)), 3))) * rng.choice([1, 1e-9, 1e9])


def _spiral(rng: np.random.Generator) -> np.ndarray:
    """On a sphere, or flat; points in no order of space, with a spacing that changes."""
    t = np.linspace(0, 1, int(rng.integers(10, 400))) ** rng.choice([0.5, 1, 3])
    angle, flat = t * rng.uniform(1, 200), rng.random() < 0.5
    across, height = (t, 0 * t) if flat else (np.sqrt(np.maximum(1 - (2 * t - 1) ** 2, 0)), 2 * t - 1)
    return np.column_stack([across * np.cos(angle), across * np.sin(angle), height])


DRAWN_BY = (
    *(_plain, _dense, _tiny, _duplicates, _collinear, _flat, _lattice, _surface_lattice, _rounded, _circle, _outlier),
    *(_clusters, _offset, _extreme, _invalid, _denormal, _roundings, _sphere, _spiral),
)
KINDS = {draw.__name__.strip("_").replace("_", " "): draw for draw in DRAWN_BY}
"""What draws a cloud of a kind."""


def degenerate_cloud(rng: np.random.Generator) -> tuple[str, np.ndarray, np.ndarray, Pipeline]:
    """A kind from `KINDS`, a cloud of it, another order of its points, and a pipeline.

    Of every fourth cloud the coordinates went through float32.
    """
    kind = str(rng.choice([*KINDS]))
    points = KINDS[kind](rng)
    if rng.random() < 0.25:
        with np.errstate(over="ignore", under="ignore"):
            points = points.astype(np.float32).astype(float)
    name = str(rng.choice(PIPELINES))
    return kind, points, rng.permutation(len(points)), as_drawn(getattr(glsk.pipelines, name)(), rng)


def skeletonised(points: np.ndarray, order: np.ndarray, pipeline: Pipeline) -> tuple[str, list[str]]:
    """Whether there is a ``"skeleton"`` or it was ``"refused"``, and findings."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", SkeletonWarning)
        try:
            skeleton = pipeline(points)
        except GlskError as error:
            words = str(error)
            plain = 10 < len(words) < 400 and "\n" not in words
            return "refused", [] if plain else [f"an error of {len(words)} characters: {words[:80]!r}"]
        try:
            other = pipeline(points[order])
        except GlskError as error:
            return "skeleton", [f"refused in another order: {error}"]
    findings = unsound(skeleton, points, slack_of(pipeline))
    if "index" not in repr(pipeline):  # order="index" is published: it visits points in the order of the input
        findings += unlike(skeleton, other, diagonal_of(points))
    return "skeleton", findings


def as_drawn(pipeline: Pipeline, rng: np.random.Generator) -> Pipeline:
    """A pipeline with some options at an end of what they may be; half of the time as it is."""
    pipeline = pipeline.with_options({"drop_invalid": bool(rng.random() < 0.5)})
    if rng.random() < 0.5:
        return pipeline
    for _ in range(int(rng.integers(1, 4))):
        stage = pipeline.stages[rng.integers(len(pipeline.stages))]
        field = rng.choice(np.array(fields(stage), dtype=object))
        value = _extreme_value(field.metadata, rng)
        if value is not None:
            pipeline = pipeline.with_options({f"{type(stage).__name__}.{field.name}": value})
    return pipeline


def _extreme_value(facts: Any, rng: np.random.Generator) -> Any:
    kind = facts["type"].rstrip("?")
    low, high = facts["low"], facts["high"]
    if facts["choices"] and rng.random() < 0.5:
        return str(rng.choice(facts["choices"]))
    if kind == "bool":
        return bool(rng.random() < 0.5)
    if kind == "length":
        return str(rng.choice(["0.001%", "1%", "100%"])) if rng.random() < 0.7 else 10.0 ** rng.uniform(-20, 20)
    if kind not in ("int", "float"):
        return None
    least = -1e3 if low is None else low
    most = min(1e3 if high is None else high, 1e3)
    value = rng.choice([least, np.nextafter(least, np.inf), most, most / 2])
    if kind == "int":
        return int(min(value, 64))
    return float(np.nextafter(value, np.inf)) if facts["open_low"] and value == least else float(value)


def unsound(skeleton: Skeleton, points: np.ndarray, slack: float) -> list[str]:
    """What is wrong with a skeleton by itself; out of the box of its points it may be by `slack` diagonals."""
    vertices, edges, owner = skeleton.vertices, skeleton.edges, skeleton.vertex_of_point
    m, finite = len(vertices), np.isfinite(points).all(axis=1)
    found = []
    if not (np.isfinite(vertices).all() and np.isfinite(skeleton.radii).all() and (skeleton.radii >= 0).all()):
        found.append("vertices or radii that are no numbers")
    if m == 0 or owner.shape != (len(points),) or owner.min() < -1 or owner.max() >= m or (owner[~finite] != -1).any():
        found.append("vertex_of_point out of range")
    if edges.size and not (edges.min() >= 0 and edges.max() < m and (edges[:, 0] < edges[:, 1]).all()):
        found.append("edges out of range")
    low, high, diagonal = points[finite].min(axis=0), points[finite].max(axis=0), diagonal_of(points)
    beyond = np.maximum(low - vertices, vertices - high).max(initial=0)
    if not found and beyond > slack * diagonal:
        found.append(f"vertices outside of the box by {beyond / diagonal:.2g} diagonals")
    return found


def unlike(one: Skeleton, other: Skeleton, diagonal: float) -> list[str]:
    """How the skeleton of the points in another order differs."""
    counts = [(name, getattr(one, name), getattr(other, name)) for name in ("n_components", "n_loops")]
    counts.append(("leaves", *(int((skeleton.degree == 1).sum()) for skeleton in (one, other))))
    found = [f"{name} depends on the order of the points: {a}, {b}" for name, a, b in counts if a != b]
    if not found and one.vertices.shape != other.vertices.shape:
        found.append(f"the order of the points changes vertices: {len(one.vertices)}, {len(other.vertices)}")
    if not found:
        apart = np.abs(one.vertices - other.vertices).max()
        if apart > SAME_CURVE * diagonal:
            found.append(f"the order of the points moves vertices by {apart / diagonal:.2g} diagonals")
    return found


def slack_of(pipeline: Pipeline) -> float:
    """How far a skeleton may be out of the box of its points, over the diagonal.

    An axis is no farther out than that of a strip of a tube. What nobody has centred is where the contraction left it:
    in a box that is larger by a fifth, as published, or in a ball around it.
    """
    (sampler,), (refiner,) = ([it for it in pipeline.stages if isinstance(it, kind)] for kind in (Sampler, Refiner))
    if sampler.frame == "box":
        return CONTRACTED_SLACK
    return FITTED_SLACK if refiner.recentre else np.inf


def diagonal_of(points: np.ndarray) -> float:
    """That of the box of the points that are finite."""
    return float(np.linalg.norm(np.ptp(points[np.isfinite(points).all(axis=1)], axis=0)))
