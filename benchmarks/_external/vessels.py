"""Axes with radii and no cloud, as SWC holds those of vessels and neurons: clouds are drawn from their round cones."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np
from glsk_bench.versions import version
from glsk_bench.clouds import cloud, coverage
from glsk_bench.shapes.curves import generator
from glsk_bench.shapes import Shape
from glsk_bench.shapes.axis import Axis as Cones
from glsk_bench.shapes.drawing import SURFACE_POINTS
from glsk_bench.shapes.paths import FINE_STEP
from glsk_bench.shapes.surface import surface

from glsk_o3d import read_skeleton
from glsk_o3d.errors import FileFormatError
from glsk_o3d.io.formats.graphs import graph_skeleton

from .entries import Axis, Entry, Source, plain, welded

MOST_PIECES = 300_000  # of half a radius, of which an axis is made: more take minutes, and memory
SURFACE_SHARE = 12  # points of the whole surface for one of a cloud, as the shapes of the benchmark have


def sources(folder: Path, variants: Sequence[str], points: int) -> list[Source]:
    """All ``.swc`` in the folder and those in it."""
    found = sorted(path for path in folder.rglob("*") if path.suffix.lower() == ".swc" and path.is_file())
    names = [plain(path.relative_to(folder).with_suffix("")) for path in found]
    return [(name, partial(vessels, path, name, variants, points)) for name, path in zip(names, found, strict=True)]


def vessels(path: Path, name: str, variants: Sequence[str], points: int) -> Entry:
    """The shape whose axis a file holds, its box made 1 across, and clouds of it that show enough of it."""
    shape = solid(name, *read_axis(path), n=max(SURFACE_SHARE * points, SURFACE_POINTS))
    asked, clouds, left_out = version("v1"), {}, []
    for variant in variants:
        drawn = cloud(shape, variant, points)
        shown = 1.0 if variant in asked.whole else coverage(shape, drawn)
        if shown >= asked.least_coverage:
            clouds[variant] = drawn
        else:
            left_out.append(f"{path}: {variant} shows {shown:.2f} of its axis, less than {asked.least_coverage}")
    return Entry("vessels", clouds, (shape.nodes, shape.edges, shape.radii), tuple(left_out))


def read_axis(path: Path) -> Axis:
    """The axis in an SWC file, less branches that end inside the ball that they begin in."""
    found = read_skeleton(path)
    thin = int((~(found.radii > 0)).sum())
    if thin:
        raise FileFormatError(
            f"{path}: {thin} of {len(found.radii)} nodes have no radius above 0: there is no surface to draw clouds of"
        )
    nodes, edges, radii = welded(found.vertices, found.edges, found.radii)
    if len(edges) == 0:
        raise FileFormatError(f"{path}: has no edges")
    length = np.linalg.norm(np.diff(nodes[edges], axis=1)[:, 0], axis=1)
    pieces = (length / (FINE_STEP * radii[edges].min(axis=1))).sum() + len(edges)
    if pieces > MOST_PIECES:
        raise FileFormatError(f"{path}: is {pieces:.3g} pieces of half a radius long, more than {MOST_PIECES}: cut it")
    return without_stubs(nodes, edges, radii)


def without_stubs(nodes: np.ndarray, edges: np.ndarray, radii: np.ndarray) -> Axis:
    """An axis less branches from a junction to a tip that is inside the junction's ball: no surface tells of them.

    Of a neuron's body three places are often told, two of them on its rim.
    """
    skeleton = graph_skeleton(nodes, edges, radii)
    kept = np.ones(len(nodes), bool)
    for path in skeleton.branches:
        first, last = path[[0, -1]] if skeleton.degree[path[-1]] == 1 else path[[-1, 0]]
        if skeleton.degree[last] == 1 and skeleton.degree[first] > 2:
            kept[path[path != first]] = np.linalg.norm(nodes[last] - nodes[first]) > 1.001 * radii[first]
    return welded(nodes, edges[kept[edges].all(axis=1)], radii)


def solid(name: str, nodes: np.ndarray, edges: np.ndarray, radii: np.ndarray, n: int) -> Shape:
    """The union of round cones as a shape of the benchmark, with n points of its surface."""
    axis = Cones([*nodes], radii.tolist(), [(a, b) for a, b in edges.tolist()]).normalised()
    graph = axis.nodes, axis.edges, axis.radii
    points, normals, area = surface(*graph, n, generator("external", name))
    return Shape(name, "vessels", 0, *graph, points, normals, {"area": area})
