"""Clouds from files; skeletons to files and back.

Every writer is a function from a skeleton to bytes and every reader one from bytes to a skeleton; `_FORMATS` maps the
file endings to them.
"""

from __future__ import annotations

import io
import json
import logging
import math
import os
from collections.abc import Callable
from contextlib import suppress
from itertools import islice, pairwise
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from ..errors import FileFormatError, MissingPackageError
from ..interop.packages import import_open3d, require
from ..interop.verbosity import following_open3d
from ..interop.writing import write_atomically
from ..report import Report
from ..skeleton import Skeleton

CLOUD_ENDINGS = (".ply", ".pcd", ".xyz", ".xyzn", ".xyzrgb", ".pts")
"""Files that `read_cloud` reads as clouds."""
MESH_ENDINGS = (".off", ".obj", ".stl", ".gltf", ".glb")
"""Files that `read_cloud` reads as meshes, to take their vertices."""

FORMAT, FORMAT_VERSION = "glsk-o3d skeleton", 1
_ARRAYS = ("vertices", "edges", "radii", "confidence", "vertex_of_point", "points", "normals")
_log = logging.getLogger(__name__)


# ---------------------------------------------------------------------------------------------------------- clouds


def read_cloud(path: str | os.PathLike) -> Any:
    """Read a point cloud, or the vertices of a mesh, with Open3D.

    Open3D returns an empty cloud for a file that it cannot read and uninitialised points for one that breaks off; here
    both are errors.

    Parameters
    ----------
    path : path-like
        PLY, PCD, XYZ, XYZN, XYZRGB or PTS (with the line that says how many points follow); or a mesh with triangles as
        OFF, OBJ, STL, glTF or GLB. In the XYZ family, lines that hold no point are skipped and logged.

    Returns
    -------
    open3d.geometry.PointCloud
        With the normals and colours that the file has. STL repeats a vertex for every triangle around it.

    Raises
    ------
    FileNotFoundError
    FileFormatError
        A folder, a skeleton, an unknown ending, or a file that is empty, damaged, broken off, or without points.
    MissingPackageError

    Notes
    -----
    Where the triangles of a mesh are large, its vertices say little about the surface: then there is a warning in the
    log.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder, "scan.xyz")
    ...     _ = path.write_text("0 0 0\\n0 0 1\\n0 1 1\\n")
    ...     len(read_cloud(path).points)
    3
    """
    cloud, _ = read_scan(path)
    return cloud


def read_scan(path: str | os.PathLike) -> tuple[Any, np.ndarray]:
    """Read a point cloud as `read_cloud` does, and the triangles between its points if it is a mesh.

    Parameters
    ----------
    path : path-like

    Returns
    -------
    cloud : open3d.geometry.PointCloud
    triangles : (T, 3) int array
    """
    path = check_scan(path)
    ending, rows = path.suffix.lower(), 0
    if _is_skeleton(path):
        raise FileFormatError(f"{path}: is a skeleton, not a scan")
    if ending not in CLOUD_ENDINGS + MESH_ENDINGS:
        raise _unknown(path, CLOUD_ENDINGS + MESH_ENDINGS)
    if ending.startswith(".xyz"):
        with path.open("rb") as stream:
            rows = sum(1 for line in stream if line.strip() and not line.lstrip().startswith(b"#"))
    o3d = import_open3d()
    try:
        with o3d.utility.VerbosityContextManager(o3d.utility.VerbosityLevel.Error):
            mesh = o3d.geometry.TriangleMesh()
            if ending in MESH_ENDINGS or (ending == ".ply" and "face" in ply_elements(path)):
                mesh = o3d.io.read_triangle_mesh(str(path))
            if ending in CLOUD_ENDINGS and not mesh.has_triangles():
                cloud = o3d.io.read_point_cloud(str(path), format=ending[1:])
            else:
                cloud = o3d.geometry.PointCloud(mesh.vertices)
                cloud.normals, cloud.colors = mesh.vertex_normals, mesh.vertex_colors
    except Exception as error:  # std::bad_alloc, undecodable text
        raise FileFormatError(f"{path}: Open3D cannot read it: {error}") from error
    if not cloud.has_points():
        raise FileFormatError(f"{path}: no points could be read: it is damaged, empty, or not a {ending} file")
    if rows > len(cloud.points):
        with following_open3d():
            _log.warning("%s: %d of %d lines hold no point and were skipped", path, rows - len(cloud.points), rows)
    triangles = np.asarray(mesh.triangles)
    if _coarse(np.asarray(mesh.vertices), triangles):
        with following_open3d():
            _log.warning(
                "%s: the %d vertices of this mesh are far apart, and only vertices count as points: sample its surface "
                "first, for example with Open3D's sample_points_uniformly",
                *(path, len(cloud.points)),
            )
    return cloud, triangles


def _coarse(vertices, triangles) -> bool:
    """Whether triangles with a side of more than a tenth of the diagonal make up half of the surface."""
    if len(triangles) == 0 or triangles.min() < 0 or triangles.max() >= len(vertices):
        return False
    with np.errstate(all="ignore"):  # vertices may be anything
        sides = vertices[triangles] - vertices[np.roll(triangles, 1, axis=1)]
        area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
        large = np.linalg.norm(sides, axis=2).max(axis=1) > np.linalg.norm(np.ptp(vertices, axis=0)) / 10
        return bool(area[large].sum() > area.sum() / 2)


def _is_skeleton(path: Path) -> bool:
    """Whether a file is a skeleton: for endings that scans do not have, whether it can be read as one."""
    if path.suffix.lower() in (".ply", ".obj"):
        return holds_skeleton(path)
    try:
        read_skeleton(path)
    except FileFormatError:
        return False
    return True


def check_scan(path: str | os.PathLike) -> Path:
    """Find out before reading a scan whether it is there and complete.

    Parameters
    ----------
    path : path-like

    Returns
    -------
    Path

    Raises
    ------
    FileNotFoundError
    FileFormatError
        A folder, or a file that is empty or breaks off.
    """
    path = _existing(path)
    with path.open("rb") as stream:  # where it may not be read, this says so
        if path.suffix.lower() in _PROMISES:
            _check_complete(path, stream)
    return path


def _check_complete(path: Path, stream: BinaryIO) -> None:
    """Check that a PLY, PCD or PTS file holds the points it promises.

    Where one breaks off, or has text for numbers, Open3D returns uninitialised memory for the rest.
    """
    try:
        promise = _PROMISES[path.suffix.lower()](stream)
        if promise is None:
            return
        promised, columns, skip, size = promise
        if size:
            found = (path.stat().st_size - stream.tell() - skip) // size
        else:
            lines = islice((line for line in stream if line.strip()), skip, skip + promised)
            found = sum(len([float(word) for word in line.split()[:columns]]) == columns for line in lines)
    except (ValueError, KeyError, IndexError) as error:
        raise FileFormatError(f"{path}: not a valid {path.suffix} file: {error}") from error
    if found < promised:
        raise FileFormatError(f"{path}: promises {promised} points and holds {max(found, 0)}: it breaks off")


# Each reads a header and says what it promises: the number of points, the numbers of each, what to skip ahead of them
# (lines or bytes), and the bytes of each, 0 for text. None where only Open3D can tell.


def _ply_promise(stream):
    order, elements = _ply_header(stream)
    here = [name for name, *_ in elements].index("vertex")
    *before, (_, promised, fields) = elements[: here + 1]
    if any(kind is None for _, _, properties in elements[: here + 1] for _, kind in properties):
        return None
    skip = sum(count * (_ply_dtype(properties, order).itemsize if order else 1) for _, count, properties in before)
    return promised, len(fields), skip, _ply_dtype(fields, order).itemsize if order else 0


def _pcd_promise(stream):
    header = {}
    while "DATA" not in header:
        line = stream.readline()
        if not line:
            raise ValueError("its header has no DATA")
        key, *values = line.decode("ascii", "replace").split() or ["#"]
        header[key] = values
    if header["DATA"] not in (["ascii"], ["binary"]):
        return None
    counts = [int(count) for count in header.get("COUNT", ["1"] * len(header["FIELDS"]))]
    size = sum(int(size) * count for size, count in zip(header["SIZE"], counts, strict=True))
    return int(header["POINTS"][0]), sum(counts), 0, size if header["DATA"] == ["binary"] else 0


def _pts_promise(stream):
    line = stream.readline(64)
    if not line.strip().isdigit():
        raise ValueError("its first line is not the number of points")
    return int(line), 3, 0, 0


_PROMISES = {".ply": _ply_promise, ".pcd": _pcd_promise, ".pts": _pts_promise}


# -------------------------------------------------------------------------------------------------------- skeletons


def save_skeleton(
    skeleton: Skeleton, path: str | os.PathLike, *, cut_loops: bool = False, format: str | None = None
) -> None:
    """Write a skeleton to a file; the ending chooses the format.

    ===================== =============================================== =======================================
    ending                holds                                           opens in
    ===================== =============================================== =======================================
    .json, .npz           everything, to the last bit                     `read_skeleton`
    .ply                  vertices, edges, the property ``radius``        Open3D (``read_line_set``), MeshLab
    .obj                  vertices, edges as ``l`` lines; no radii        MeshLab, Blender, CloudCompare
    .swc                  trees only, with radii; vertices renumbered     neuron and plant tools
    .graphml              x, y, z, radius of nodes, length of edges       networkx, Gephi, Cytoscape
    .cgal, .polylines.txt a line per branch: count, x y z, ...; no radii  CGAL
    ===================== =============================================== =======================================

    Numbers keep their full precision. The file appears complete or not at all; on an error an existing file stays as
    it was. Open3D's ``read_line_set`` gives an empty line set for a PLY file without edges.

    Parameters
    ----------
    skeleton : Skeleton
    path : path-like
    cut_loops : bool
        For SWC: drop one edge per loop, keeping the spanning forest of least length, instead of refusing.
    format : str, optional
        The ending of another format than that of `path`, with or without its dot.

    Raises
    ------
    FileFormatError
        The ending is unknown, or the skeleton has loops and the format is SWC.
    FileNotFoundError
        The folder does not exist.
    OSError
        The file cannot be written.

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
    write, _ = _FORMATS[skeleton_ending(path, format)]
    options = {"cut_loops": cut_loops} if write is _write_swc else {}
    data = write(skeleton, **options)
    write_atomically(path, lambda temporary: temporary.write_bytes(data))


def read_skeleton(path: str | os.PathLike, *, format: str | None = None) -> Skeleton:
    """Read a skeleton from a file that `save_skeleton` or another program wrote.

    Parameters
    ----------
    path : path-like
    format : str, optional
        The ending of another format than that of `path`, with or without its dot.

    Returns
    -------
    Skeleton
        From JSON and npz everything. From other formats the graph alone: `points`, `normals` and `vertex_of_point` are
        empty, and radii that the format has no place for are NaN. Edges are sorted; repeated edges and those from a
        vertex to itself are dropped. Polylines are joined where their ends have equal coordinates.

    Raises
    ------
    FileNotFoundError
    FileFormatError
        A folder, a cloud, an unknown ending, or a file that is damaged or from a newer release.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import torus
    >>> skeleton = skeletonize(torus(1000).points)
    >>> with TemporaryDirectory() as folder:
    ...     skeleton.save(f"{folder}/ring.json")
    ...     again = read_skeleton(f"{folder}/ring.json")
    >>> bool((again.vertices == skeleton.vertices).all())
    True
    """
    path = _existing(path)
    ending = skeleton_ending(path, format)
    data = path.read_bytes()
    try:
        return _FORMATS[ending][1](data)
    except MissingPackageError:
        raise
    except _NoEdges:
        raise FileFormatError(f"{path}: is a cloud, not a skeleton: make one with glsk_o3d.skeletonize") from None
    except Exception as error:  # whatever a parser raises on a hostile file
        raise FileFormatError(f"{path}: not a valid {ending} skeleton: {error}") from error


def holds_skeleton(path: str | os.PathLike) -> bool:
    """Whether a file holds a skeleton: PLY with edges or OBJ with lines, but no faces, or by the ending.

    Parameters
    ----------
    path : path-like

    Returns
    -------
    bool
        False also for what does not exist or is unknown: reading it as a cloud says so.
    """
    path = Path(path)
    ending = path.suffix.lower()
    if not path.is_file() or ending not in (".ply", ".obj"):
        return path.is_file() and ending not in CLOUD_ENDINGS + MESH_ENDINGS
    with path.open("rb") as stream:
        if ending == ".ply":
            with suppress(ValueError):
                counts = {name: count for name, count, _ in _ply_header(stream)[1]}
                return "edge" in counts and not counts.get("face")
            return False
        if stream.readline().startswith(_OBJ_MARK):
            return True
        keywords = {line.split(maxsplit=1)[0] for line in stream if line.strip()}
        return b"l" in keywords and b"f" not in keywords


class _NoEdges(Exception):
    """A file in a format that clouds have too holds no edges, and was not written as a skeleton."""


def _existing(path) -> Path:
    path = Path(path)
    if path.is_dir():
        raise FileFormatError(f"{path}: is a folder, not a file")
    if not path.exists():
        raise FileNotFoundError(f"{path}: no such file")
    if path.is_file() and path.stat().st_size == 0:
        raise FileFormatError(f"{path}: the file is empty")
    return path


def skeleton_ending(path: Path, format: str | None = None) -> str:
    """The ending in the table of formats that a file name has, or that `format` names.

    Parameters
    ----------
    path : Path
    format : str, optional
        An ending, with or without its dot.

    Returns
    -------
    str

    Raises
    ------
    FileFormatError
        If there is no such format; the message lists them.
    """
    name = path.name.lower() if format is None else "." + format.lower().lstrip(".")
    found = [e for e in _FORMATS if (name.endswith(e) if format is None else name == e)]
    if not found:
        raise _unknown(path if format is None else f"format {format!r}", _FORMATS)
    return found[0]


def _unknown(what, endings) -> FileFormatError:
    return FileFormatError(f"{what}: unknown ending; known are {', '.join(endings)}")


def graph_skeleton(vertices, edges, radii=None) -> Skeleton:
    """A skeleton without a cloud, its edges sorted and each once."""
    vertices = np.asarray(vertices, float).reshape(-1, 3)
    edges = np.sort(np.asarray(edges, np.int64).reshape(-1, 2), axis=1)
    edges = np.unique(edges[edges[:, 0] != edges[:, 1]], axis=0)
    radii = np.full(len(vertices), np.nan) if radii is None else radii
    none = np.empty(0)
    return _checked(Skeleton(vertices, edges, radii, vertex_of_point=none, points=none, normals=none))


def _checked(skeleton: Skeleton) -> Skeleton:
    m = len(skeleton.vertices)
    owners = skeleton.vertex_of_point
    if skeleton.edges.size and (skeleton.edges.min() < 0 or skeleton.edges.max() >= m):
        raise ValueError(f"an edge names a vertex that is not there: there are {m}")
    if owners.size and (owners.min() < -1 or owners.max() >= m):
        raise ValueError(f"vertex_of_point names a vertex that is not there: there are {m}")
    if len(skeleton.radii) != m:
        raise ValueError(f"{len(skeleton.radii)} radii for {m} vertices")
    if len({len(array) for array in (owners, skeleton.points, skeleton.normals)} - {0}) > 1:
        raise ValueError("points, normals and vertex_of_point differ in length")
    return skeleton


# -------------------------------------------------------------------------------------------- JSON and npz: everything


def _decode(values: dict) -> Skeleton:
    """The skeleton in what JSON or npz hold, once they are plain arrays."""
    if not isinstance(values, dict) or values.get("format") != FORMAT:
        raise ValueError(f"it is not marked as a {FORMAT!r}")
    if values.get("format_version") != FORMAT_VERSION:
        found = values.get("format_version")
        raise ValueError(f"it has format_version {found!r} and this release reads {FORMAT_VERSION}: update glsk-o3d")
    missing = [name for name in (*_ARRAYS, "report") if name not in values]
    if missing:
        raise ValueError(f"it lacks {', '.join(missing)}")
    arrays = {}
    for name in _ARRAYS:
        whole = name in ("edges", "vertex_of_point")
        columns = {"edges": (2,), "radii": (), "confidence": (), "vertex_of_point": ()}.get(name, (3,))
        array = np.asarray(values[name], None if whole else float)
        if array.size == 0:
            array = np.empty((0, *columns), np.int64 if whole else float)
        if array.shape[1:] != columns or array.dtype.kind not in ("iu" if whole else "f"):
            raise ValueError(f"{name} has shape {array.shape} and dtype {array.dtype}")
        arrays[name] = array
    if len(arrays["confidence"]) != len(arrays["vertices"]):
        raise ValueError(f"{len(arrays['confidence'])} confidences for {len(arrays['vertices'])} vertices")
    return _checked(Skeleton(**arrays, report=Report.from_dict(_with_nan(values["report"]))))


def _plain(value):
    """What JSON can hold: NaN becomes null and the infinities strings, in arrays, dicts and lists alike."""
    if isinstance(value, np.ndarray):
        cells = value.astype(object)
        if value.dtype.kind == "f":
            cells[np.isnan(value)] = None
            cells[np.isposinf(value)], cells[np.isneginf(value)] = "Infinity", "-Infinity"
        return cells.tolist()
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    value = value.item() if isinstance(value, np.generic) else value
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else "Infinity" if value > 0 else "-Infinity"
    return value


def _with_nan(value):
    """Inverse of `_plain` for the report; of arrays NumPy does it."""
    if isinstance(value, dict):
        return {key: _with_nan(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_with_nan(item) for item in value]
    return math.nan if value is None else float(value) if value in ("Infinity", "-Infinity") else value


def _dumps(value) -> str:
    return json.dumps(_plain(value), allow_nan=False)


def _write_json(skeleton: Skeleton) -> bytes:
    arrays = {name: getattr(skeleton, name) for name in _ARRAYS}
    report = skeleton.report.to_dict()
    return _dumps({"format": FORMAT, "format_version": FORMAT_VERSION, **arrays, "report": report}).encode()


def _read_json(data: bytes) -> Skeleton:
    return _decode(json.loads(data))


def _write_npz(skeleton: Skeleton) -> bytes:
    arrays = {name: getattr(skeleton, name) for name in _ARRAYS}
    stream = io.BytesIO()
    report = _dumps(skeleton.report.to_dict())
    np.savez_compressed(stream, format=FORMAT, format_version=FORMAT_VERSION, **arrays, report=report)
    return stream.getvalue()


def _read_npz(data: bytes) -> Skeleton:
    with np.load(io.BytesIO(data), allow_pickle=False) as archive:
        values = {name: archive[name] for name in archive.files}
    for name in ("format", "format_version", "report"):
        values[name] = values[name].item() if name in values and values[name].ndim == 0 else None
    return _decode({**values, "report": json.loads(values["report"] or "null")})


# ------------------------------------------------------------------------------------------------------------- PLY

_PLY_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_PLY_KINDS = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4", "float32": "f4"},
    **{"double": "f8", "float64": "f8"},
}


def _ply_header(stream: BinaryIO) -> tuple[str, list[tuple[str, int, list[tuple[str, str | None]]]]]:
    """Byte order ("" for text) and (element, count, [(property, dtype or None for a list)]); then come data."""
    if stream.readline(16).strip() != b"ply":
        raise ValueError("it does not start with 'ply'")
    order, elements = None, []
    for line in stream:
        match line.decode("ascii", "replace").split():
            case ["format", kind, _] if kind in _PLY_ORDERS:
                order = _PLY_ORDERS[kind]
            case ["element", name, count] if count.isdecimal():
                elements.append((name, int(count), []))
            case ["property", "list", _, _, name] if elements:
                elements[-1][2].append((name, None))
            case ["property", kind, name] if elements and kind in _PLY_KINDS:
                elements[-1][2].append((name, _PLY_KINDS[kind]))
            case ["comment" | "obj_info", *_] | []:
                pass
            case ["end_header"] if order is not None:
                return order, elements
            case _:
                raise ValueError(f"its header has the line {line[:80]!r}")
    raise ValueError("its header does not end")


def ply_elements(path: str | os.PathLike) -> dict[str, list[str]]:
    """The elements that a PLY file holds at least one of, with the names of their properties.

    Parameters
    ----------
    path : path-like

    Returns
    -------
    dict of str to list of str
    """
    with open(path, "rb") as stream:
        _, elements = _ply_header(stream)
    return {name: [key for key, _ in fields] for name, count, fields in elements if count}


def _ply_dtype(fields, order: str) -> np.dtype:
    return np.dtype([(name, order + kind) for name, kind in fields])


def _write_ply(skeleton: Skeleton) -> bytes:
    vertices = np.column_stack([skeleton.vertices, skeleton.radii]).astype("<f8")
    header = f"""ply
format binary_little_endian 1.0
comment curve skeleton written by glsk-o3d
element vertex {len(vertices)}
property double x
property double y
property double z
property double radius
element edge {len(skeleton.edges)}
property int vertex1
property int vertex2
end_header
"""
    return header.encode() + vertices.tobytes() + skeleton.edges.astype("<i4").tobytes()


def _read_ply(data: bytes) -> Skeleton:
    stream = io.BytesIO(data)
    order, elements = _ply_header(stream)
    names = [name for name, _, _ in elements]
    if "vertex" not in names:
        raise ValueError("it has no element 'vertex'")
    if "edge" not in names:
        raise _NoEdges
    start, tables = stream.tell(), {}
    words = data[start:].split() if order == "" else []
    for name, count, fields in elements:
        if any(kind is None for _, kind in fields):
            if count and not {"vertex", "edge"} <= tables.keys():
                raise ValueError(f"element {name!r} has lists")
            continue
        keys, dtype = [key for key, _ in fields], _ply_dtype(fields, order)
        if order == "":
            size = count * len(keys)
            table = np.array(words[:size], dtype="S").astype(float).reshape(count, len(keys))
            tables[name], words = dict(zip(keys, table.T, strict=True)), words[size:]
        else:
            size = count * dtype.itemsize
            table = np.frombuffer(data[start : start + size], dtype)
            if len(table) < count:
                raise ValueError(f"it breaks off in element {name!r}")
            tables[name], start = {key: table[key] for key in keys}, start + size
    vertex, edge = tables["vertex"], tables["edge"]
    xyz = np.column_stack([vertex[axis] for axis in "xyz"]).astype(float)
    radii = np.array(vertex["radius"], float) if "radius" in vertex else None
    return graph_skeleton(xyz, np.column_stack([edge["vertex1"], edge["vertex2"]]), radii)


# ------------------------------------------------------------------------------------------------------------- text


def _line(*words) -> str:
    return " ".join(map(str, words))  # str of a float is its shortest exact form


def _text(lines) -> bytes:
    return ("\n".join(lines) + "\n").encode()


def _lines(data: bytes) -> list[list[str]]:
    """The words of every line that has some, comments left out."""
    lines = (line.partition("#")[0].split() for line in data.decode().splitlines())
    return [words for words in lines if words]


_OBJ_MARK = b"# curve skeleton written by glsk-o3d"


def _write_obj(skeleton: Skeleton) -> bytes:
    points = [_line("v", *vertex) for vertex in skeleton.vertices.tolist()]
    lines = [_line("l", *edge) for edge in (skeleton.edges + 1).tolist()]
    return _text([_OBJ_MARK.decode(), *points, *lines])


def _read_obj(data: bytes) -> Skeleton:
    vertices, edges = [], []
    for keyword, *words in _lines(data):
        if keyword == "v":
            vertices.append([float(word) for word in words[:3]])
        elif keyword == "l":
            ends = [int(word.partition("/")[0]) for word in words]
            if 0 in ends:
                raise ValueError("OBJ counts vertices from 1 and a line names vertex 0")
            ends = [end - 1 if end > 0 else end + len(vertices) for end in ends]
            edges += pairwise(ends)
    if not vertices:
        raise ValueError("it has no 'v' line")
    if not (edges or data.startswith(_OBJ_MARK)):
        raise _NoEdges
    return graph_skeleton(vertices, edges)


def _write_swc(skeleton: Skeleton, cut_loops: bool = False) -> bytes:
    if skeleton.n_loops and not cut_loops:
        raise FileFormatError(
            f"SWC holds trees only and the skeleton has {skeleton.n_loops} loop(s): "
            "pass cut_loops=True to drop an edge of each, or choose another format"
        )
    networkx = require("networkx")
    graph = networkx.Graph()
    graph.add_nodes_from(range(len(skeleton.vertices)))
    graph.add_weighted_edges_from(zip(*skeleton.edges.T.tolist(), skeleton.edge_lengths.tolist(), strict=True))
    forest = networkx.minimum_spanning_tree(graph)
    order = list(networkx.dfs_preorder_nodes(forest))
    number = {vertex: i for i, vertex in enumerate(order, 1)}
    parent = {child: number[vertex] for vertex, child in networkx.dfs_edges(forest)}
    table = np.column_stack([skeleton.vertices, skeleton.radii]).tolist()
    rows = [_line(number[vertex], 0, *table[vertex], parent.get(vertex, -1)) for vertex in order]
    return _text(["# curve skeleton written by glsk-o3d: id type x y z radius parent", *rows])


def _read_swc(data: bytes) -> Skeleton:
    table = np.array([[float(word) for word in words[:7]] for words in _lines(data)])
    if table.ndim != 2 or table.shape[1] != 7:
        raise ValueError("it has no rows of 7 numbers (id type x y z radius parent)")
    names, parents = table[:, 0], table[:, 6]
    order = np.argsort(names)
    child = np.flatnonzero(parents >= 0)
    place = np.searchsorted(names[order], parents[child]).clip(max=len(names) - 1)
    if (names[order][place] != parents[child]).any() or len(np.unique(names)) < len(names):
        raise ValueError("a parent is not there, or two rows have one id")
    return graph_skeleton(table[:, 2:5], np.column_stack([child, order[place]]), table[:, 5])


def _write_graphml(skeleton: Skeleton) -> bytes:
    networkx = require("networkx")
    graph = networkx.Graph()
    table = np.column_stack([skeleton.vertices, skeleton.radii]).tolist()
    graph.add_nodes_from((i, dict(zip(("x", "y", "z", "radius"), row, strict=True))) for i, row in enumerate(table))
    edges = zip(*skeleton.edges.T.tolist(), skeleton.edge_lengths.tolist(), strict=True)
    graph.add_weighted_edges_from(edges, weight="length")
    stream = io.BytesIO()
    networkx.write_graphml_xml(graph, stream)
    return stream.getvalue()


def _read_graphml(data: bytes) -> Skeleton:
    graph = require("networkx").read_graphml(io.BytesIO(data))
    lost = [node for node, facts in graph.nodes(data=True) if not {"x", "y", "z"} <= facts.keys()]
    if lost:
        raise ValueError(f"node {lost[0]!r} lacks x, y or z")
    index = {node: i for i, node in enumerate(graph)}
    table = [[facts.get(key, math.nan) for key in ("x", "y", "z", "radius")] for _, facts in graph.nodes(data=True)]
    table = np.array(table, float).reshape(-1, 4)
    return graph_skeleton(table[:, :3], [(index[a], index[b]) for a, b in graph.edges()], table[:, 3])


def _write_polylines(skeleton: Skeleton) -> bytes:
    paths = [*skeleton.branches, *np.flatnonzero(skeleton.degree == 0)[:, None]]
    return _text(_line(len(path), *skeleton.vertices[path].ravel().tolist()) for path in paths)


def _read_polylines(data: bytes) -> Skeleton:
    lines = [[float(word) for word in words] for words in _lines(data)]
    if not lines or any(len(line) != 1 + 3 * line[0] or line[0] < 1 for line in lines):
        raise ValueError("a line must hold the number of its points and then x y z of each")
    points = np.concatenate([line[1:] for line in lines]).reshape(-1, 3)
    stop = np.cumsum([int(line[0]) for line in lines])
    start = np.r_[0, stop[:-1]]
    inner = np.setdiff1d(np.arange(len(points)), stop - 1)  # those with a next point on their line
    ends = np.concatenate([start, stop - 1])[np.tile(stop - start > 1, 2)]
    _, first, which = np.unique(points[ends], axis=0, return_index=True, return_inverse=True)
    label = np.arange(len(points))
    label[ends] = ends[first][which.ravel()]
    kept, index = np.unique(label, return_inverse=True)
    return graph_skeleton(points[kept], index[np.column_stack([inner, inner + 1])])


_FORMATS: dict[str, tuple[Callable[..., bytes], Callable[[bytes], Skeleton]]] = {
    ".ply": (_write_ply, _read_ply),
    ".obj": (_write_obj, _read_obj),
    ".json": (_write_json, _read_json),
    ".npz": (_write_npz, _read_npz),
    ".swc": (_write_swc, _read_swc),
    ".graphml": (_write_graphml, _read_graphml),
    ".cgal": (_write_polylines, _read_polylines),
    ".polylines.txt": (_write_polylines, _read_polylines),
}
