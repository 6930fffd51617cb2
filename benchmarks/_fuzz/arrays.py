"""Degenerate clouds through the pipelines, and what a skeleton must be whatever it is of."""

from __future__ import annotations

import warnings
from dataclasses import fields
from typing import Any

import numpy as np

import glsk_o3d as glsk
from glsk_o3d import GlskError, Pipeline, Skeleton, SkeletonWarning

from .clouds import cloud

PIPELINES = ("default", "tree", "cao2010", "wen2024")
FITTED_SLACK = 0.0501  # of the diagonal: what a fit to the axis may do, see FIT_BEYOND
CONTRACTED_SLACK = 0.1001  # of the longest side: what a contraction may do, see CLOUD_SLACK
SAME_CURVE = 1e-6  # of the diagonal: how far two skeletons of one cloud may be apart


def array_case(rng: np.random.Generator) -> tuple[str, str, list[str]]:
    """Run one case.

    Parameters
    ----------
    rng : numpy.random.Generator

    Returns
    -------
    kind : str
        Of the cloud.
    told : str
        What came of it: ``"skeleton"`` or ``"refused"``; and what was run, to be read.
    findings : list of str
    """
    kind, points = cloud(rng)
    name = str(rng.choice(PIPELINES))
    pipeline = as_drawn(getattr(glsk.pipelines, name)(), rng)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", SkeletonWarning)
        try:
            skeleton = pipeline(points)
        except GlskError as error:
            return kind, "refused", wrong_words(error)
        again = rng.permutation(len(points))
        try:
            other = pipeline(points[again])
        except GlskError as error:
            return kind, "skeleton", [f"refused in another order: {error}"]
    findings = unsound(skeleton, points, slack_of(pipeline))
    if "index" not in repr(pipeline):  # order="index" is published: it visits points in the order of the input
        findings += unlike(skeleton, other, diagonal_of(points))
    return kind, "skeleton", findings


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


def wrong_words(error: GlskError) -> list[str]:
    """A refusal must be a sentence, and none about options: they are within their limits."""
    words = str(error)
    found = (
        [f"an error of {len(words)} characters: {words[:80]!r}"] if not 10 < len(words) < 400 or "\n" in words else []
    )
    return found


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
    rings, refiner = pipeline.stages[0], pipeline.stages[-1]
    if rings.frame == "box":
        return CONTRACTED_SLACK
    return FITTED_SLACK if refiner.recentre else np.inf


def diagonal_of(points: np.ndarray) -> float:
    """That of the box of the points that are finite."""
    return float(np.linalg.norm(np.ptp(points[np.isfinite(points).all(axis=1)], axis=0)))
