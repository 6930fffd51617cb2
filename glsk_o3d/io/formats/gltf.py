"""glTF 2.0: keeps trees, as an armature with a bone per edge, and a surface, or points, that it moves.

Blender and other programs for animation open it. Bones are called by their branch. Radii are in the surface only, and
numbers are float32, as glTF's are; of coordinates as on a map the large part is a shift of the whole.
"""

import json
import os
from typing import Any

import numpy as np

from ...analysis.rigging import armature, bone_before, bone_names, skin_weights
from ...analysis.segmentation import vertex_of_cloud
from ...curve.rooted import RootPlace
from ...data.skeleton import Skeleton
from ...errors import FileFormatError, InvalidCloudError, InvalidParameterError
from ...geometry.vectors import norm, unit
from ...interop.atomic import check_ending, write_atomically
from ...interop.clouds import cloud_points, open3d_class
from ..geometry import to_tubes
from .graphs import as_forest, global_shift, holding_all

MAGIC, JSON_CHUNK, BINARY_CHUNK = 0x46546C67, 0x4E4F534A, 0x004E4942  # published: glTF 2.0, 4.4
COMPONENT_TYPES = {"f4": 5126, "u2": 5123, "u4": 5125}  # published: glTF 2.0, 3.6.2.2
POINTS_MODE, TRIANGLES_MODE = 0, 4  # published: glTF 2.0, 5.24
RIG_ENDING = ".glb"
MOST_JOINTS = 65535  # published: glTF 2.0, 3.7.3.3, in which joints are counted in 16 bits at most
# derived: float32 holds its parts, and they sum to 1 exactly: else far from the origin points move
WEIGHT_STEPS = 2**16
SRGB_KNEE = 0.04045  # published: IEC 61966-2-1, where the curve of sRGB begins
UPRIGHT = {"z": [-(0.5**0.5), 0.0, 0.0, 0.5**0.5], "y": [0.0, 0.0, 0.0, 1.0]}  # derived: turns up into glTF's y


def save_rig(
    skeleton: Skeleton,
    path: str | os.PathLike[str],
    mesh: Any = None,
    *,
    cut_loops: bool = False,
    root: RootPlace | None = None,
    up: str = "z",
) -> Skeleton:
    """Write a mesh or a cloud with a skeleton's armature that moves it, as glTF.

    Joints are the junctions, the places where limbs leave a junction's ball, and vertices between that are a radius
    apart or more. Each edge between joints is a bone, which turns about the end nearer to the root.

    Parameters
    ----------
    skeleton : Skeleton
    path : path-like
        Ends in ``.glb``.
    mesh : triangle mesh or cloud, optional
        Of Open3D, or anything that carries points. By default the skeleton's tubes, or if it has no radii, its points.
    cut_loops : bool
        Cut loops of the skeleton open instead of refusing them; the surface stays whole.
    root : str, int or (x, y, z), optional
        Which joint moves all others; as for `glsk_o3d.editing.reroot`. By default that of `branch_table`.
    up : {"z", "y"}
        The vertical axis of the data. It is y in the file, and programs convert it.

    Returns
    -------
    Skeleton
        The armature: its edges are the bones.

    Raises
    ------
    FileFormatError
        The skeleton has loops, or no edges; or the ending is another.
    InvalidCloudError
    InvalidParameterError
        There is no such axis.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from glsk_o3d import skeletonize
    >>> from glsk_o3d.samples import sauropod
    >>> body = skeletonize(sauropod(4096).points)
    >>> with TemporaryDirectory() as folder:
    ...     bones = save_rig(body, f"{folder}/animal.glb", cut_loops=True)
    >>> len(bones.edges) < len(body.edges)
    True
    """
    check_ending(path, "rig is glTF", RIG_ENDING)
    if up not in UPRIGHT:
        raise InvalidParameterError(f"up = {up!r}: must be one of {', '.join(UPRIGHT)}")
    with holding_all(path):
        bones = armature(_with_edges(as_forest(skeleton, cut_loops, root)))
        data = _content(bones, _surface(skeleton) if mesh is None else mesh, up)
    write_atomically(path, lambda temporary: temporary.write_bytes(data))
    return bones


def write(forest: Skeleton) -> bytes:
    """The content of a GLB file: the tubes of a skeleton that is numbered from its roots outwards, and its armature."""
    return _content(_with_edges(forest), _surface(forest), "z")


def _with_edges(forest: Skeleton) -> Skeleton:
    if len(forest.edges) == 0:
        raise FileFormatError("the skeleton has no edges: there are no bones to make an armature of")
    return forest


def _surface(skeleton: Skeleton) -> Any:
    if np.isfinite(skeleton.radii).all():
        return to_tubes(skeleton, (1, 1, 1))
    if len(skeleton.points) == 0:
        raise FileFormatError("a rig needs radii or points: read the skeleton from a .json, .npz, .ply or .swc file")
    return skeleton.points[skeleton.vertex_of_point >= 0]


def _content(forest: Skeleton, mesh: Any, up: str) -> bytes:
    """The content of a GLB file."""
    if len(forest.edges) > MOST_JOINTS:
        raise FileFormatError(f"glTF counts at most {MOST_JOINTS} bones, not {len(forest.edges)}: simplify it first")
    mesh = mesh.to_legacy() if open3d_class(mesh) in (("PointCloud", True), ("TriangleMesh", True)) else mesh
    points = cloud_points(mesh)
    if not np.isfinite(points).all():
        raise InvalidCloudError("the surface has points that are not finite: drop them first")
    (low, high), (least, most) = ((each.min(axis=0), each.max(axis=0)) for each in (forest.vertices, points))
    if max((least - high).max(), (low - most).max()) > np.linalg.norm(high - low):  # its own size away
        raise InvalidCloudError("the surface is not where the skeleton is: are they in the same units and place?")
    origin, buffer = global_shift(forest), _Buffer()
    nodes, heads = _bones(forest, origin)
    bones, weights = skin_weights(forest, points, vertex_of_cloud(forest, points)[1])
    weights[:, 1:] = np.round(weights[:, 1:] * WEIGHT_STEPS) / WEIGHT_STEPS
    weights[:, 0] = 1 - weights[:, 1:].sum(axis=1)
    inverse = np.tile(np.eye(4), (len(heads), 1, 1))
    inverse[:, :3, 3] = -heads
    attributes = {
        "POSITION": buffer.add(points - origin, "f4", "VEC3", bounds=True),
        "JOINTS_0": buffer.add(bones * (weights > 0), "u2", "VEC4"),
        "WEIGHTS_0": buffer.add(weights, "f4", "VEC4"),
        **{name: buffer.add(values, "f4", "VEC3") for name, values in _looks(mesh, len(points)).items()},
    }
    primitive: dict[str, Any] = {"attributes": attributes, "mode": POINTS_MODE}
    triangles = np.asarray(mesh.triangles) if open3d_class(mesh)[0] == "TriangleMesh" else np.empty((0, 3))
    if len(triangles):
        primitive |= {"indices": buffer.add(triangles.reshape(-1), "u4", "SCALAR"), "mode": TRIANGLES_MODE}
    x, y, z = origin.tolist()
    armature = {
        "name": "armature",
        "children": np.flatnonzero(bone_before(forest) < 0).tolist(),
        "translation": [x, z, -y] if up == "z" else [x, y, z],
        "rotation": UPRIGHT[up],
    }
    n, at_rest = len(nodes), buffer.add(inverse.transpose(0, 2, 1).reshape(-1, 16), "f4", "MAT4")
    return buffer.file(
        {
            "scene": 0,
            "scenes": [{"nodes": [n, n + 1]}],
            "nodes": [*nodes, armature, {"name": "surface", "mesh": 0, "skin": 0}],
            "meshes": [{"primitives": [primitive]}],
            "skins": [{"joints": list(range(n)), "skeleton": n, "inverseBindMatrices": at_rest}],
        }
    )


def _looks(mesh: Any, n: int) -> dict[str, np.ndarray]:
    """Normals and colours, where there is one of each vertex; colours are linear in glTF."""
    kind, found = open3d_class(mesh)[0], {}
    if kind in ("PointCloud", "TriangleMesh"):
        of_vertices = "" if kind == "PointCloud" else "vertex_"
        normals, shades = (np.asarray(getattr(mesh, f"{of_vertices}{name}")) for name in ("normals", "colors"))
        if len(normals) == n and (norm(normals) > 0).all():
            found["NORMAL"] = unit(normals)
        if len(shades) == n:
            found["COLOR_0"] = np.where(shades <= SRGB_KNEE, shades / 12.92, ((shades + 0.055) / 1.055) ** 2.4)
    return found


def _bones(forest: Skeleton, origin: np.ndarray) -> tuple[list[dict[str, Any]], np.ndarray]:
    """The joints, one per edge, each placed from the one before it; and where they are from the origin."""
    heads, parent = forest.vertices[forest.edges[:, 0]] - origin, bone_before(forest)
    moved = np.where((parent >= 0)[:, None], heads - heads[parent], heads)
    nodes: list[dict[str, Any]] = [
        {"name": name, "translation": place} for name, place in zip(bone_names(forest), moved.tolist(), strict=True)
    ]
    for child, bone in enumerate(parent.tolist()):
        if bone >= 0:
            nodes[bone].setdefault("children", []).append(child)
    return nodes, heads


class _Buffer:
    """Arrays one after another, and what glTF says of each."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []

    def add(self, values: np.ndarray, kind: str, shape: str, *, bounds: bool = False) -> int:
        """The number by which an array is known."""
        array = np.ascontiguousarray(values, f"<{kind}")
        self.data += bytes(-len(self.data) % 4)
        self.views.append({"buffer": 0, "byteOffset": len(self.data), "byteLength": array.nbytes})
        facts = {"bufferView": len(self.views) - 1, "componentType": COMPONENT_TYPES[kind], "count": len(array)}
        limits = {"min": array.min(axis=0).tolist(), "max": array.max(axis=0).tolist()} if bounds else {}
        self.accessors.append({**facts, "type": shape, **limits})
        self.data += array.tobytes()
        return len(self.accessors) - 1

    def file(self, tree: dict[str, Any]) -> bytes:
        """A binary file of what a tree says beside the arrays."""
        tree |= {"accessors": self.accessors, "bufferViews": self.views, "buffers": [{"byteLength": len(self.data)}]}
        tree |= {"asset": {"version": "2.0", "generator": "glsk-o3d"}}
        text = json.dumps(tree, separators=(",", ":"), allow_nan=False).encode()
        text += b" " * (-len(text) % 4)
        body = bytes(self.data) + bytes(-len(self.data) % 4)
        chunks = b"".join(
            len(chunk).to_bytes(4, "little") + kind.to_bytes(4, "little") + chunk
            for kind, chunk in ((JSON_CHUNK, text), (BINARY_CHUNK, body))
        )
        return b"".join(n.to_bytes(4, "little") for n in (MAGIC, 2, 12 + len(chunks))) + chunks
