"""Aneurisk: surfaces of arteries with aneurysms, and their centrelines with radii, as vmtk has made them."""

from __future__ import annotations

from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from glsk_o3d.errors import FileFormatError, MissingPackageError

from .entries import Axis, Entry, Source, plain, welded

RADII = "MaximumInscribedSphereRadius"
# Lines that are nearer to each other than so many local radii are one. Those of one stretch, computed for each outlet
# anew, are hundredths of a radius apart; where a vessel forks they part by degrees. Half a radius is far from both
# noise and the two radii within which junctions are paired, so that it hardly matters where in between they part.
SAME_LINE = 0.5


def sources(folder: Path, points: int) -> list[Source]:
    """All cases in the folder and those in it: ``CASE/morphology/centerlines.vtp``."""
    found = sorted(folder.rglob("morphology/centerlines.vtp"))
    if found:
        try:
            import vtkmodules.vtkIOXML  # noqa: F401
        except ImportError:
            raise MissingPackageError(f"{found[0]}: needs vtk: pip install vtk") from None
    return [(plain(Path(path.parents[1].name)), partial(case, path, points)) for path in found]


def case(path: Path, points: int) -> Entry:
    """An artery: points all over its surface, uniform by area, and its axis, in millimetres."""
    axis = read_lines(path)
    return Entry("arteries", {"surface": sampled(path.parents[1] / "surface" / "model.vtp", points)}, axis)


def read_lines(path: Path) -> Axis:
    """The centrelines in a file as one graph."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    data = _polydata(path)
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
    import open3d as o3d
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkFiltersCore import vtkTriangleFilter

    cut = vtkTriangleFilter()
    cut.SetInputData(_polydata(path))
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
    from vtkmodules.vtkCommonCore import vtkObject
    from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

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
