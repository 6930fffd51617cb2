"""Skeletons to files and back: the table of formats."""

import os
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from ..analysis.comparison import Truth
from ..curve.rooted import RootPlace
from ..data.skeleton import Skeleton
from ..errors import FileFormatError
from ..interop.atomic import existing_file, write_atomically
from .formats import fields, gltf, lines, ply, trees
from .formats.graphs import NoEdges, as_forest, holding_all
from .paths import SCAN_ENDINGS, refused_if_damaged, unknown_ending


class Format(NamedTuple):
    """How skeletons are written to a kind of file, and read from it: bytes from a skeleton and back. Any error of
    `read` means that the file is damaged. Where a format holds trees only `write` gets what `as_forest` makes.
    """

    write: Callable[[Skeleton], bytes]
    read: Callable[[bytes], Skeleton] | None = None
    trees: bool = False


FORMATS: dict[str, Format] = {
    ".ply": Format(ply.write, ply.read),
    ".obj": Format(lines.write_obj, lines.read_obj),
    ".json": Format(fields.write_json, fields.read_json),
    ".npz": Format(fields.write_npz, fields.read_npz),
    ".swc": Format(trees.write_swc, trees.read_swc, trees=True),
    ".vtp": Format(lines.write_vtp),
    ".dxf": Format(lines.write_dxf),
    ".graphml": Format(lines.write_graphml),
    ".glb": Format(gltf.write, trees=True),
    ".urdf": Format(trees.write_urdf, trees=True),
}
"""The formats of skeletons by the ending of the file."""
READABLE = tuple(ending for ending, format in FORMATS.items() if format.read is not None)
"""Endings of files that `read_skeleton` reads."""
_HOLDS_LINES = {".ply": ply.holds_lines, ".obj": lines.holds_lines}  # formats that scans have, too


def save_skeleton(
    skeleton: Skeleton, path: str | os.PathLike[str], *, cut_loops: bool = False, root: RootPlace | None = None
) -> None:
    """Write a skeleton to a file; the ending chooses the format.

    ============ =============================================== =======================================
    ending       holds                                           opens in
    ============ =============================================== =======================================
    .json, .npz  everything, to the last bit                     `read_skeleton`
    .ply         vertices, edges, radii, half axes               Open3D (``read_line_set``), MeshLab
    .obj         vertices, edges as ``l`` lines; no radii        MeshLab, Blender, CloudCompare
    .swc         trees, with radii                               neuron and plant tools
    .vtp         vertices, branches, radii, confidence           ParaView, Slicer, vmtk
    .dxf         branches as polylines; no radii                 CAD
    .graphml     vertices, edges, radii, confidence              Gephi, Cytoscape, yEd
    .glb         trees, as an armature with a skin of tubes      Blender
    .urdf        trees, as a robot of cylinders and balls        ROS, simulators
    ============ =============================================== =======================================

    Formats below SWC are only written, not read. Numbers keep their full precision, except in glTF, which has
    float32. The file appears complete or not at all; after an error an existing file is unchanged.

    Parameters
    ----------
    skeleton : Skeleton
    path : path-like
    cut_loops : bool
        For formats of trees: keep the spanning forest of least length, instead of refusing loops.
    root : str, int or (x, y, z), optional
        For the same formats: the root, as for `glsk_o3d.editing.reroot`. By default vertex 0 if the numbers go outwards
        from it, as from `pipelines.tree`; otherwise that of `glsk_o3d.analysis.branch_table`.

    Raises
    ------
    FileFormatError
        The ending is unknown, or the skeleton has loops or lacks data that the format needs.
    InvalidParameterError
        There is no such root.
    MissingPackageError
        GraphML needs networkx.
    OSError
        The folder does not exist, or the file cannot be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import torus
    >>> skeleton = skeletonize(torus(1000).points)
    >>> with TemporaryDirectory() as folder:
    ...     save_skeleton(skeleton, f"{folder}/ring.swc", cut_loops=True)
    ...     read_skeleton(f"{folder}/ring.swc").n_loops
    0
    """
    path = Path(path)
    chosen = FORMATS[skeleton_ending(path)]
    with holding_all(path):
        data = chosen.write(as_forest(skeleton, cut_loops, root) if chosen.trees else skeleton)
    write_atomically(path, lambda temporary: temporary.write_bytes(data))


def read_skeleton(path: str | os.PathLike[str]) -> Skeleton:
    """Read a skeleton from a file that `save_skeleton` or another program wrote.

    Parameters
    ----------
    path : path-like

    Returns
    -------
    Skeleton
        JSON and npz give everything. Other formats give only the graph: `points`, `normals` and `vertex_of_point` are
        empty, and missing radii are NaN. Edges are sorted; repeated edges and those from a vertex to itself are
        dropped.

    Raises
    ------
    FileNotFoundError
    FileFormatError
        A folder, a cloud, an unknown ending, or a file that is damaged or from a newer release.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     _ = Path(folder, "s.obj").write_text("v 0 0 0\\nv 1 0 0\\nl 1 2\\n")
    ...     read_skeleton(f"{folder}/s.obj").length
    1.0
    """
    path = existing_file(path)
    if path.suffix.lower() in {*SCAN_ENDINGS} - FORMATS.keys():
        raise _is_cloud(path)
    ending = skeleton_ending(path)
    read = FORMATS[ending].read
    if read is None:
        raise FileFormatError(f"{path}: {ending} is only written; read are {', '.join(READABLE)}")
    data = path.read_bytes()
    with refused_if_damaged(path, "skeleton"):
        try:
            return read(data)
        except NoEdges:
            raise _is_cloud(path) from None


def _is_cloud(path: Path) -> FileFormatError:
    return FileFormatError(f"{path}: is a cloud, not a skeleton: make one with skeletonize")


def holds_skeleton(path: str | os.PathLike[str]) -> bool:
    """Whether a file is there and a skeleton: PLY with edges or OBJ with lines, but no faces, or by the ending."""
    path = Path(path)
    ending = path.suffix.lower()
    if not path.is_file():
        return False
    if ending in _HOLDS_LINES:
        with path.open("rb") as stream:
            return _HOLDS_LINES[ending](stream)
    return ending not in SCAN_ENDINGS


def skeleton_ending(path: Path) -> str:
    """The ending in the table of formats that a file name has; FileFormatError, which lists them, if it has none."""
    if path.suffix.lower() not in FORMATS:
        raise unknown_ending(path, FORMATS)
    return path.suffix.lower()


def read_truth(path: str | os.PathLike[str]) -> Truth:
    """Read a known axis.

    Parameters
    ----------
    path : path-like
        An npz archive with `nodes`, `edges` and `radii`, or any file with radii that `read_skeleton` reads.

    Returns
    -------
    Truth

    Raises
    ------
    FileNotFoundError
    FileFormatError
        It is neither, or it holds no axis.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     _ = Path(folder, "s.swc").write_text("1 0 0 0 0 0.1 -1\\n2 0 0 0 1 0.1 1\\n")
    ...     len(read_truth(f"{folder}/s.swc").edges)
    1
    """
    path, names = existing_file(path), ("nodes", "edges", "radii")
    try:
        if path.suffix.lower() == ".npz" and zipfile.is_zipfile(path):
            arrays = fields.npz_arrays(path.read_bytes(), names)
            if len(arrays) == len(names):
                return Truth(*(arrays[name] for name in names))
        skeleton = read_skeleton(path)
        return Truth(skeleton.vertices, skeleton.edges, skeleton.radii)
    except FileFormatError:
        raise
    except (ValueError, EOFError, zipfile.BadZipFile) as error:
        raise FileFormatError(f"{path}: not a valid truth: {error}") from None
