"""A benchmark of somebody's own clouds and axes."""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from glsk_o3d.analysis.comparison import Truth
from glsk_o3d.analysis.curves import check_graph, simple_edges
from glsk_o3d.errors import InvalidParameterError
from glsk_o3d.interop.clouds import cloud_points

from .folders import BenchmarkFolder, begun, write_axis, write_points
from .radii import radii_from_points
from .versions import OWN, fingerprint

FLOAT_ROUNDING = 1e-6  # fitted: how far float32 may move a point, in the diagonal: less than scanners tell apart
OTHER_UNITS = 30.0  # fitted: ratio of the boxes' diagonals beyond which axis and cloud are not in one unit
PLAIN = re.compile(r"\w[\w.+-]*")  # on every system the name of a file, in the folder where it is written


def add_shape(
    folder: str | os.PathLike,
    shape: str,
    clouds: Mapping[str, Any],
    nodes: Any,
    edges: Any,
    radii: Any = None,
    *,
    family: str = "own",
) -> BenchmarkFolder:
    """Add clouds of your own, and their true axis, to a benchmark that `run` and `score_answers` take.

    Nothing is scaled: clouds and axis keep their units, and scores are in radii of the axis.

    Parameters
    ----------
    folder : path-like
        Created if missing.
    shape : str
        Its name: letters, digits and ``_.+-``.
    clouds : mapping of str to cloud
        Clouds by variant, such as ``{"scan": points}``: anything that `skeletonize` takes.
    nodes : (M, 3) array_like of float
        Of the true axis, in the units of the clouds.
    edges : (E, 2) array_like of int
        Nodes at the same place without an edge are not connected: weld them first.
    radii : (M,) array_like of float, optional
        Distance to the surface at each node. By default measured in the first cloud: at each node the median distance
        of the points whose nearest place on the axis belongs to it; with fewer than three points, the radius of the
        nearest node along the axis with enough.
    family : str
        Kind of the shape.

    Returns
    -------
    BenchmarkFolder

    Raises
    ------
    InvalidParameterError
        A name is not plain, or another cloud's; the axis is none, has no points near, or is in other units; the folder
        has a version of the benchmark, or this shape with another axis, or this cloud with other points.
    InvalidCloudError
        A cloud is none.
    FileFormatError
        The folder's ``benchmark.json`` is damaged.
    OSError
        A file cannot be written.

    Examples
    --------
    >>> from glsk_o3d.samples import y_junction
    >>> from tempfile import TemporaryDirectory
    >>> drawn = y_junction(1000)
    >>> with TemporaryDirectory() as place:
    ...     made = add_shape(place, "fork", {"clean": drawn.points}, drawn.nodes, drawn.edges)
    ...     bool(np.abs(made.truth("fork").radii / drawn.radii - 1).max() < 0.1)
    True
    """
    for word in (shape, family, *clouds):
        if not isinstance(word, str) or not PLAIN.fullmatch(word):
            raise InvalidParameterError(f"{word!r} is no plain name: use letters, digits and _.+-, no others first")
    if not clouds:
        raise InvalidParameterError(f"{shape}: no cloud is given")
    points = {variant: stored_points(f"{shape}_{variant}", cloud) for variant, cloud in clouds.items()}
    for variant, each in points.items():
        _check_units(f"{shape}_{variant}", each, nodes)
    made = begun(Path(folder), OWN)
    check_names(made, shape, points)
    axis, told = _axis(made, shape, points, nodes, edges, radii)
    for variant, each in points.items():
        before, now = told["clouds"].get(variant), fingerprint(each)
        if before is not None and before["fingerprint"] != now:
            raise InvalidParameterError(
                f"{made.path}: has other points for {shape}_{variant}: give another name or folder"
            )
        file = f"clouds/{shape}_{variant}.ply"
        cell = {"file": file, "scored": True, "coverage": None, "fingerprint": now, "sameness": None}
        told["clouds"][variant] = {**cell, "points": len(each)}
    write_axis(made.path / told["truth"], axis)
    for variant, each in points.items():
        write_points(made.path / told["clouds"][variant]["file"], each)
    made = replace(made, shapes={**made.shapes, shape: {**told, "family": family}}, complete=True)
    made.save()
    return made


def stored_points(name: str, cloud: Any) -> np.ndarray:
    """The points of a cloud as they are written: float32, or float64 where that would move them too far."""
    points = cloud_points(cloud)
    with np.errstate(over="ignore"):
        short = points.astype(np.float32)
    if not np.isfinite(short).all():
        raise InvalidParameterError(f"{name}: has coordinates that are not finite, or beyond those of float32")
    moved = np.abs(short - points).max()
    return short if moved <= FLOAT_ROUNDING * np.linalg.norm(np.ptp(points, axis=0)) else points


def _check_units(name: str, points: np.ndarray, nodes: Any) -> None:
    """Raise InvalidParameterError where axis and cloud cannot be in the same units."""
    try:
        wide = np.linalg.norm(np.ptp(np.asarray(nodes, float).reshape(-1, 3), axis=0))
    except ValueError:  # no nodes, or none in space, which is said later
        return
    around = np.linalg.norm(np.ptp(points, axis=0))
    if wide > 0 and not 1 / OTHER_UNITS < around / wide < OTHER_UNITS:
        raise InvalidParameterError(
            f"{name}: the cloud is {around:.3g} wide and the axis {wide:.3g}: are they in the same units?"
        )


def check_names(made: BenchmarkFolder, shape: str, variants: Mapping[str, Any]) -> None:
    """Raise InvalidParameterError for names that another shape or cloud has, on systems without capitals too."""
    taken = {name.lower(): name for name in made.shapes}
    if taken.get(shape.lower(), shape) != shape:
        raise InvalidParameterError(f"{made.path}: {taken[shape.lower()]} and {shape} are one file on some systems")
    files = {cloud.name.lower(): (cloud.shape, cloud.variant) for cloud in made.clouds}
    for variant in variants:
        name = f"{shape}_{variant}"
        if files.setdefault(name.lower(), (shape, variant)) != (shape, variant):
            raise InvalidParameterError(f"{made.path}: {name} would be the name of two clouds: call one otherwise")


def _axis(
    made: BenchmarkFolder, shape: str, points: Mapping[str, np.ndarray], nodes: Any, edges: Any, radii: Any
) -> tuple[Truth, dict[str, Any]]:
    """The axis to write, and what ``benchmark.json`` says of the shape so far."""
    try:
        places = np.asarray(nodes, float).reshape(-1, 3)
        links = simple_edges(check_graph(places, edges, "axis"))
    except (TypeError, ValueError) as error:
        raise InvalidParameterError(f"{shape}: the axis has invalid nodes or edges: {error}") from None
    before = made.shapes.get(shape)
    variant, first = next(iter(points.items()))
    source = variant if radii is None else "given"
    if radii is None and before is not None:
        old = made.truth(shape)
        same = np.array_equal(old.nodes, places) and np.array_equal(old.edges, links)
        radii = old.radii if same else None
    try:
        found = radii_from_points(places, links, first.astype(float)) if radii is None else radii
        axis = Truth(places, links, found)
    except InvalidParameterError as error:
        raise InvalidParameterError(f"{shape}: {error}") from None
    digits = hashlib.sha256(b"".join(part.tobytes() for part in (axis.nodes, axis.edges, axis.radii))).hexdigest()[:8]
    if before is None:
        return axis, {"truth": f"truth/{shape}.npz", "fingerprint": digits, "radii": source, "clouds": {}}
    if before["fingerprint"] != digits:
        raise InvalidParameterError(f"{made.path}: has {shape} with another axis: give another name or folder")
    return axis, {**before, "clouds": {**before["clouds"]}}
