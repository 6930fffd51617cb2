"""Other people's clouds and axes as a benchmark: reads what you have downloaded, for `glsk benchmark run` and `score`.

The README of the benchmarks says what each command reads. Nothing is downloaded.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from fnmatch import fnmatch
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
import typer
from glsk_bench import add_shape
from glsk_bench.clouds import cloud, coverage
from glsk_bench.folders import begun
from glsk_bench.shapes import Shape
from glsk_bench.shapes.axis import FINE_STEP
from glsk_bench.shapes.axis import Axis as Cones
from glsk_bench.shapes.curves import generator
from glsk_bench.shapes.drawing import SURFACE_POINTS
from glsk_bench.shapes.surface import surface
from glsk_bench.versions import OWN, version
from scipy.spatial import cKDTree

from glsk_o3d import read_cloud, read_skeleton
from glsk_o3d.analysis.curves import check_graph, simple_edges
from glsk_o3d.errors import FileFormatError, GlskError, InvalidParameterError, MissingPackageError, brief
from glsk_o3d.io.formats.graphs import graph_skeleton, words_by_line
from glsk_o3d.io.skeletons import holds_skeleton

from .runs import application

LARGER = 2  # what cloud and axis of one shape may differ by at most, in the diagonals of their boxes
ENDING = ".graph.txt"  # of the graphs of plants
MOST_PIECES = 300_000  # of half a radius, of which an axis is made: more take minutes, and memory
SURFACE_SHARE = 12  # points of the whole surface for one of a cloud, as the shapes of the benchmark have
RADII = "MaximumInscribedSphereRadius"
# Lines that are nearer to each other than so many local radii are one. Those of one stretch, computed for each outlet
# anew, are hundredths of a radius apart; where a vessel forks they part by degrees. Half a radius is far from both
# noise and the two radii within which junctions are paired, so that it hardly matters where in between they part.
SAME_LINE = 0.5

Axis = tuple[np.ndarray, np.ndarray, np.ndarray | None]  # nodes (M, 3), edges (E, 2), radii (M,) where they are known


class Entry(NamedTuple):
    """A shape, read."""

    family: str
    clouds: dict[str, np.ndarray]
    axis: Axis
    left_out: tuple[str, ...] = ()
    """What was left out of its clouds, and why, in words."""


Source = tuple[str, Callable[[], Entry]]
"""The name of a shape, and what reads it."""


def plain(path: Path) -> str:
    """A path as a name that every system can write: what is not plain becomes a hyphen."""
    return re.sub(r"[^\w.+-]+", "-", path.as_posix()).lstrip(".+-") or "unnamed"


def welded(nodes: np.ndarray, edges: np.ndarray, radii: np.ndarray | None = None) -> Axis:
    """An axis whose nodes in one place are one node, with the largest of their radii; nodes without an edge go."""
    places, same = np.unique(nodes, axis=0, return_inverse=True)
    edges = simple_edges(same.reshape(-1)[edges])
    used, ends = np.unique(edges, return_inverse=True)
    if radii is not None:
        widest = np.full(len(places), -np.inf)
        np.maximum.at(widest, same.reshape(-1), radii)
        radii = widest[used]
    return places[used], ends.reshape(-1, 2), radii


def check_sizes(name: str, entry: Entry) -> None:
    """Raise FileFormatError for an axis that is not of the size of its clouds: files of different versions."""
    of_axis, *others = (np.linalg.norm(np.ptp(each, axis=0)) for each in (entry.axis[0], *entry.clouds.values()))
    for variant, size in zip(entry.clouds, others, strict=True):
        if not of_axis / LARGER <= size <= of_axis * LARGER:
            raise FileFormatError(
                f"{name}: cloud {variant} is {size:.3g} across and the axis {of_axis:.3g}: are they of one version?"
            )


def trees(folder: Path) -> list[Source]:
    """The trees of which there is an axis, ``scan_skel/tree_SIZE_N.obj``."""
    return [(path.stem, partial(tree, folder, path)) for path in sorted(folder.glob("scan_skel/tree_*.obj"))]


def tree(folder: Path, path: Path) -> Entry:
    """A tree; every branch of its file begins with the place that it grows from, once more."""
    if not holds_skeleton(path):
        raise FileFormatError(f"{path}: has no lines, as the first version of these files: take the latest")
    axis = read_skeleton(path)
    scans = sorted(folder.glob(f"scan_ply/{path.stem}_res_*.ply"), key=lambda scan: (len(scan.name), scan.name))
    if not scans:
        raise FileNotFoundError(f"{folder}/scan_ply/{path.stem}_res_*.ply: no such cloud")
    clouds = {f"res{scan.stem.rpartition('_')[2]}": np.asarray(read_cloud(scan).points) for scan in scans}
    return Entry(path.stem.split("_")[1], clouds, welded(axis.vertices, axis.edges))


def plants(folder: Path) -> list[Source]:
    """All ``NAME.graph.txt`` in the folder and those in it."""
    paths = sorted(path for path in folder.rglob(f"*{ENDING}") if not path.name.startswith("."))
    return [(plain(Path(path.parent.name, path.name.removesuffix(ENDING))), partial(plant, path)) for path in paths]


def plant(path: Path) -> Entry:
    """A plant and its scan beside it, ``NAME.ply`` or ``NAME.xyz``."""
    stem = path.with_name(path.name.removesuffix(ENDING))
    scans = [scan for ending in (".ply", ".xyz") if (scan := Path(f"{stem}{ending}")).is_file()]
    if not scans:
        raise FileNotFoundError(f"{stem}.ply or .xyz: no such cloud")
    return Entry(plain(Path(path.parent.name)), {"scan": np.asarray(read_cloud(scans[0]).points)}, read_graph(path))


def read_graph(path: Path) -> Axis:
    """The graph in a file of lines ``v x y z``, with a label or without, and ``e i j`` that count from 0."""
    lines = words_by_line(path.read_bytes())
    try:
        nodes = np.array([[float(word) for word in words[1:4]] for words in lines if words[0] == "v"])
        edges = np.array([[int(word) for word in words[1:3]] for words in lines if words[0] == "e"])
        if nodes.ndim != 2 or nodes.shape[1] != 3 or edges.ndim != 2:
            raise ValueError("it has no lines 'v x y z' and 'e i j'")
        return welded(nodes, check_graph(nodes, edges, "graph"))
    except (ValueError, InvalidParameterError) as error:
        raise FileFormatError(f"{path}: not a valid graph: {brief(error)}") from None


def vessels(folder: Path, variants: Sequence[str], points: int) -> list[Source]:
    """All ``.swc`` in the folder and those in it."""
    paths = sorted(path for path in folder.rglob("*") if path.suffix.lower() == ".swc")
    names = [plain(path.relative_to(folder).with_suffix("")) for path in paths]
    return [(name, partial(vessel, path, name, variants, points)) for name, path in zip(names, paths, strict=True)]


def vessel(path: Path, name: str, variants: Sequence[str], points: int) -> Entry:
    """The shape whose axis a file holds, its box made 1 across, and clouds of it that show enough of it."""
    nodes, edges, radii = read_axis(path)
    axis = Cones([*nodes], radii.tolist(), [(a, b) for a, b in edges.tolist()]).normalised()
    graph, n = (axis.nodes, axis.edges, axis.radii), max(SURFACE_SHARE * points, SURFACE_POINTS)
    whole, normals, area = surface(*graph, n, generator("external", name))
    shape = Shape(name, "vessels", 0, *graph, whole, normals, {"area": area})
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
    """An axis less branches that end in the ball of the junction where they begin, as of a neuron's body often do."""
    skeleton = graph_skeleton(nodes, edges, radii)
    kept = np.ones(len(nodes), bool)
    for path in skeleton.branches:
        first, last = path[[0, -1]] if skeleton.degree[path[-1]] == 1 else path[[-1, 0]]
        if skeleton.degree[last] == 1 and skeleton.degree[first] > 2:
            kept[path[path != first]] = np.linalg.norm(nodes[last] - nodes[first]) > 1.001 * radii[first]
    return welded(nodes, edges[kept[edges].all(axis=1)], radii)


def arteries(folder: Path, points: int) -> list[Source]:
    """All cases in the folder and those in it: ``CASE/morphology/centerlines.vtp``."""
    paths = sorted(folder.rglob("morphology/centerlines.vtp"))
    return [(plain(Path(path.parents[1].name)), partial(artery, path, points)) for path in paths]


def artery(path: Path, points: int) -> Entry:
    """An artery: points all over its surface, uniform by area, and its axis, in millimetres."""
    axis = read_lines(path)
    return Entry("arteries", {"surface": sampled(path.parents[1] / "surface" / "model.vtp", points)}, axis)


def read_lines(path: Path) -> Axis:
    """The centrelines in a file as one graph."""
    data = _polydata(path)
    from vtkmodules.util.numpy_support import vtk_to_numpy

    radii = data.GetPointData().GetArray(RADII)
    if radii is None or data.GetNumberOfLines() == 0:
        raise FileFormatError(f"{path}: has no lines with the point array {RADII}")
    nodes, radii = vtk_to_numpy(data.GetPoints().GetData()).astype(float), vtk_to_numpy(radii).astype(float)
    cells = data.GetLines()
    ids, ends = (vtk_to_numpy(each) for each in (cells.GetConnectivityArray(), cells.GetOffsetsArray()))
    used = radii[ids]
    if not (np.isfinite(used) & (used > 0)).all():
        raise FileFormatError(f"{path}: a radius on a line is not above 0")
    return welded(nodes, joined(nodes, radii, [line for line in np.split(ids, ends[1:-1]) if len(line) > 1]), radii)


def joined(nodes: np.ndarray, radii: np.ndarray, lines: list[np.ndarray]) -> np.ndarray:
    """Edges, (E, 2) int array, of lines from one inlet to several outlets, each stretch once.

    A line that begins beside those before it, or ends there, follows them up to the place where it is half a radius
    away, and is joined to them there. It is not joined to what it comes near to later: vessels touch.
    """
    kept, edges = lines[0], [*pairwise(lines[0].tolist())]
    for line in lines[1:]:
        distance, nearest = cKDTree(nodes[kept]).query(nodes[line])
        near = distance < SAME_LINE * radii[kept[nearest]]
        if near[-1] and not near[0]:
            line, near, nearest = line[::-1], near[::-1], nearest[::-1]
        shared = len(line) if near.all() else int(near.argmin())
        new = line[shared:].tolist()
        if shared and new:
            edges.append((int(kept[nearest[shared - 1]]), new[0]))
        edges += pairwise(new)
        kept = np.concatenate([kept, line[shared:]])
    return np.array(edges, np.int64).reshape(-1, 2)


def sampled(path: Path, n: int) -> np.ndarray:
    """So many points of a surface, uniform by area."""
    polydata = _polydata(path)
    import open3d as o3d
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkFiltersCore import vtkTriangleFilter

    cut = vtkTriangleFilter()
    cut.SetInputData(polydata)
    cut.Update()
    data = cut.GetOutput()
    if data.GetNumberOfPolys() == 0:
        raise FileFormatError(f"{path}: has no surface")
    triangles = vtk_to_numpy(data.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    mesh = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(vtk_to_numpy(data.GetPoints().GetData()).astype(float)),
        o3d.utility.Vector3iVector(triangles.astype(np.int32)),
    )
    o3d.utility.random.seed(0)
    return np.asarray(mesh.sample_points_uniformly(n).points)


def _polydata(path: Path) -> Any:
    try:
        from vtkmodules.vtkCommonCore import vtkObject
        from vtkmodules.vtkIOXML import vtkXMLPolyDataReader
    except ImportError:
        raise MissingPackageError(f"{path}: needs vtk: pip install vtk") from None
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such file")
    vtkObject.GlobalWarningDisplayOff()  # it says on the console what is said here
    reader = vtkXMLPolyDataReader()
    reader.SetFileName(str(path))
    if reader.CanReadFile(str(path)):
        reader.Update()
    data = reader.GetOutput()
    if reader.GetErrorCode() or data.GetNumberOfPoints() == 0:
        raise FileFormatError(f"{path}: not a valid .vtp file, or empty")
    return data


app = application(__doc__)

Data = Annotated[Path, typer.Argument(metavar="DIR", help="What you have downloaded.", exists=True, file_okay=False)]
Bench = Annotated[Path, typer.Option("--output", "-o", metavar="BENCH", help="The benchmark; made, or added to.")]
Only = Annotated[str, typer.Option("--only", metavar="PATTERN", help="Shapes to take, such as 'tree_small_*'.")]


@app.command("trees")
def trees_(folder: Data, output: Bench, only: Only = "*") -> None:
    """TreePointCloud: drawn trees, scanned in three resolutions; y is up."""
    collect(trees(folder), f"no scan_skel/tree_*.obj in {folder}", output, only)


@app.command("plants")
def plants_(folder: Data, output: Bench, only: Only = "*") -> None:
    """4D plant registration: tomato and maize; the axes are good to a few percent."""
    collect(plants(folder), f"no NAME.graph.txt in {folder}", output, only)


@app.command("vessels")
def vessels_(
    folder: Data,
    output: Bench,
    only: Only = "*",
    variants: Annotated[
        str, typer.Option("--variants", metavar="NAMES", help="Of the clouds drawn for SWC, with commas.")
    ] = "clean,scan2",
    points: Annotated[int, typer.Option("--points", min=64, help="Of every cloud.")] = 4096,
) -> None:
    """SWC files, of vessels or neurons, of which clouds are drawn; and cases of Aneurisk."""
    names = list(dict.fromkeys(variants.split(",")))
    found = [*vessels(folder, names, points), *arteries(folder, points)]
    collect(found, f"no NAME.swc and no CASE/morphology/centerlines.vtp in {folder}", output, only)


def collect(sources: list[Source], nothing: str, bench: Path, only: str) -> None:
    """Add what can be read to a benchmark, and say what cannot, and why."""
    wanted = [(name, read) for name, read in sources if fnmatch(name, only)]
    if not wanted:
        raise typer.BadParameter(f"none of {len(sources)} shapes is called {only}" if sources else nothing)
    try:
        begun(bench, OWN)
    except (GlskError, OSError) as error:
        raise typer.BadParameter(str(error)) from None
    left_out, shapes, clouds = [], 0, 0
    for name, read in wanted:
        try:
            entry = read()
            left_out += entry.left_out
            if entry.clouds:
                check_sizes(name, entry)
                add_shape(bench, name, entry.clouds, *entry.axis, family=entry.family)
                shapes, clouds = shapes + 1, clouds + len(entry.clouds)
        except (GlskError, OSError, MemoryError) as error:
            left_out.append(str(error) if name in str(error) else f"{name}: {error}")
    typer.echo(f"{bench}: {shapes} shapes, {clouds} clouds")
    if left_out:
        typer.echo("\n  ".join([f"left out, {len(left_out)}:", *left_out]), err=True)
    if not shapes:
        raise typer.Exit(1)
