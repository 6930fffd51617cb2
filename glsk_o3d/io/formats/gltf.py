"""glTF 2.0: keeps trees, as an armature with a bone per edge, and a surface, or points, that it moves.

Blender and other programs for animation open it. Bones are called by their branch. Radii are in the surface only, and
numbers are float32, as glTF's are; of coordinates as on a map the large part is a shift of the whole.
"""

import json
import os
from collections.abc import Callable
from typing import Any

import numpy as np

from ...analysis.limb_names import axes_of_body, bone_names
from ...analysis.mirror import mirror_plane
from ...analysis.rigging import armature, bone_before
from ...analysis.segmentation import vertex_of_cloud
from ...analysis.skinning import skin_weights
from ...analysis.surface import Surface, without_loops
from ...curve.rooted import RootPlace
from ...data.report import warn
from ...data.skeleton import Skeleton
from ...errors import FileFormatError, InvalidCloudError, InvalidParameterError
from ...geometry.vectors import Floats, box
from ...interop.atomic import check_ending, write_atomically
from ...interop.clouds import surface_mesh
from ...parameters import check_number, resolve_point, shown
from ..geometry import to_tubes
from .gltf_looks import Texture, png, texture, vertex_looks
from .graphs import as_forest, global_shift, holding_all

MAGIC, JSON_CHUNK, BINARY_CHUNK = 0x46546C67, 0x4E4F534A, 0x004E4942  # published: glTF 2.0, 4.4
ARRAY_TYPES = {(): "SCALAR", (2,): "VEC2", (3,): "VEC3", (4,): "VEC4", (16,): "MAT4"}  # published: glTF 2.0, 3.6.2.2
COMPONENT_TYPES = {"f4": 5126, "u2": 5123, "u4": 5125}  # published: glTF 2.0, 3.6.2.2
POINTS_MODE, TRIANGLES_MODE = 0, 4  # published: glTF 2.0, 5.24
RIG_ENDING = ".glb"
MOST_JOINTS = 65535  # published: glTF 2.0, 3.7.3.3, in which joints are counted in 16 bits at most
# derived: float32 holds its parts, and they sum to 1 exactly: else far from the origin points move
WEIGHT_STEPS = 2**16
MOST_SCALE = 2.0  # derived: below that of an inch in centimetres, 2.54, of the size of a surface over the skeleton's
MOST_OFFSET = 0.5  # fitted: sizes between the middles of a surface and of the skeleton
UPRIGHT = {"z": [-(0.5**0.5), 0.0, 0.0, 0.5**0.5], "y": [0.0, 0.0, 0.0, 1.0]}  # derived: turns up into glTF's y


def save_rig(
    skeleton: Skeleton,
    path: str | os.PathLike[str],
    mesh: Any = None,
    *,
    joints: int | None = None,
    symmetric: bool = False,
    cut_loops: bool = False,
    root: RootPlace | None = None,
    up: str = "z",
) -> Skeleton:
    """Write a mesh or a cloud with a skeleton's armature that moves it, as glTF.

    Joints are the junctions, the places where limbs leave a junction's ball, and vertices between that are a radius
    apart or more. Each edge between joints is a bone, which turns about the end nearer to the root. Limbs of a biped or
    quadruped have names: head, neck, spine, tail, and arm_left, leg_left, front_leg_left, hind_leg_right and so on.

    Parameters
    ----------
    skeleton : Skeleton
    path : path-like
        Ends in ``.glb``.
    mesh : triangle mesh or cloud, optional
        Of Open3D, or anything that carries points. By default the skeleton's tubes, or if it has no radii, its points.
    joints : int, optional
        How many joints, each with its bone, the file has: bones from junction to junction and end first, which are then
        parted at the farthest bends and in the middle of long ones.
    symmetric : bool
        Joints of limbs that are mirror images of each other are, too, those in the plane of symmetry are exactly there,
        and names of mirrored bones end in ``_left`` and ``_right``. The plane is that of the points.
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
        The surface has another size or place than the skeleton.
    InvalidParameterError
        There is no such axis; the root is outside of the cloud; or more than `joints` bones between ends and junctions.

    Warns
    -----
    SkeletonWarning
        Limbs have names only if another axis points up.

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
    check_number("joints", joints, "int?", low=1)
    drawn = _surface(skeleton) if mesh is None else mesh
    points, triangles = surface_mesh(drawn)
    _check_fit(skeleton, points)
    surface = Surface(points, triangles) if mesh is not None and len(triangles) else None  # tubes meet at no junction
    with holding_all(path):
        forest = as_forest(without_loops(skeleton, points, surface, cut_loops), cut_loops, root)
        _check_root(root, skeleton)
        plane = mirror_plane(skeleton.points if len(skeleton.points) else skeleton.vertices)
        bones = armature(forest, joints, plane if symmetric else None)
        names = bone_names(bones, plane, up, symmetric)
        data = _content(bones, drawn, up, names, surface)
    write_atomically(path, lambda temporary: temporary.write_bytes(data))
    if not any(name.startswith("head") for name in names) and (others := axes_of_body(bones, plane)):
        warn([f"limbs have no names with {up} up, but with {' or '.join(others)} up: does {up} point up?"])
    return bones


def write(forest: Skeleton) -> bytes:
    """The content of a GLB file: the tubes of a skeleton that is numbered from its roots outwards, and its armature."""
    return _content(forest, _surface(forest), "z", bone_names(forest))


def _surface(skeleton: Skeleton) -> Any:
    if len(skeleton.edges) == 0:
        raise FileFormatError("the skeleton has no edges: there are no bones to make an armature of")
    if np.isfinite(skeleton.radii).all():
        return to_tubes(skeleton, (1, 1, 1))
    if len(skeleton.points) == 0:
        raise FileFormatError("a rig needs radii or points: read the skeleton from a .json, .npz, .ply or .swc file")
    return skeleton.points[skeleton.vertex_of_point >= 0]


def _content(forest: Skeleton, mesh: Any, up: str, names: list[str], surface: Surface | None = None) -> bytes:
    """The content of a GLB file."""
    if len(forest.edges) > MOST_JOINTS:
        raise FileFormatError(f"glTF counts at most {MOST_JOINTS} bones, not {len(forest.edges)}: simplify it first")
    points, triangles = surface_mesh(mesh)
    origin, arrays = global_shift(forest), list[np.ndarray]()

    def array(values: np.ndarray, kind: str) -> int:
        """The number by which an array of this type is known."""
        arrays.append(np.ascontiguousarray(values, kind))
        return len(arrays) - 1

    bones, weights = skin_weights(forest, points, vertex_of_cloud(forest, points)[1], surface)
    weights[:, 1:] = np.round(weights[:, 1:] * WEIGHT_STEPS) / WEIGHT_STEPS
    weights[:, 0] = 1 - weights[:, 1:].sum(axis=1)
    values = {"POSITION": points - origin, "JOINTS_0": bones * (weights > 0), "WEIGHTS_0": weights}
    values |= vertex_looks(mesh, len(points))
    image = texture(mesh, len(triangles))
    if image is not None:  # a vertex has one place in the texture
        corners = np.column_stack([triangles.reshape(-1), image.corners])
        corners, number = np.unique(corners, axis=0, return_inverse=True)
        values = {name: rows[corners[:, 0].astype(int)] for name, rows in values.items()}
        values["TEXCOORD_0"], triangles = corners[:, 1:], number.reshape(-1, 3)
    attributes = {name: array(rows, "<u2" if name == "JOINTS_0" else "<f4") for name, rows in values.items()}
    material = np.zeros(len(triangles), int) if image is None else image.material
    primitives: list[dict[str, Any]] = []
    for each in np.unique(material).tolist():
        part = {"indices": array(triangles[material == each].reshape(-1), "<u4"), "mode": TRIANGLES_MODE}
        primitives.append({"attributes": attributes} | part | ({} if image is None else {"material": each}))
    primitives = primitives or [{"attributes": attributes, "mode": POINTS_MODE}]
    joints, places = _joints(forest, origin, names)
    at_rest = np.tile(np.eye(4), (len(places), 1, 1))  # glTF has matrices by columns
    at_rest[:, 3, :3] = -places
    x, y, z = origin.tolist()
    armature = {
        "name": "armature",
        "children": np.flatnonzero(bone_before(forest) < 0).tolist(),
        "translation": [x, z, -y] if up == "z" else [x, y, z],
        "rotation": UPRIGHT[up],
    }
    n = len(joints)
    skin = {"joints": list(range(n)), "skeleton": n, "inverseBindMatrices": array(at_rest.reshape(-1, 16), "<f4")}
    scene = {
        "scene": 0,
        "scenes": [{"nodes": [n, n + 1]}],
        "nodes": [*joints, armature, {"name": "surface", "mesh": 0, "skin": 0}],
        "meshes": [{"primitives": primitives}],
        "skins": [skin],
    }
    return _glb(scene if image is None else scene | _materials(image, array), arrays)


def _materials(look: Texture, array: Callable[[np.ndarray, str], int]) -> dict[str, Any]:
    """Materials, and the images that they have, each one array of bytes."""
    materials, images = [], list[dict[str, Any]]()
    for image in look.images:
        surface: dict[str, Any] = {"metallicFactor": 0.0, **look.factors}
        if image is not None:
            surface["baseColorTexture"] = {"index": len(images)}
            images.append({"bufferView": array(png(image), "u1"), "mimeType": "image/png"})
        materials.append({"pbrMetallicRoughness": surface})
    textures = [{"source": number} for number in range(len(images))]
    return {"materials": materials} | ({"images": images, "textures": textures} if images else {})


def _check_fit(skeleton: Skeleton, points: np.ndarray) -> None:
    """InvalidCloudError unless the points of a surface are finite, and it has the size and place of the skeleton."""
    if not np.isfinite(points).all():
        raise InvalidCloudError("the surface has points that are not finite: drop them first")
    low, high = _box(skeleton)
    size, own = (float(np.linalg.norm(extent)) for extent in (high - low, np.ptp(points, axis=0)))
    sizes = f"the surface is {own:.4g} large, and the skeleton with its cloud {size:.4g}"
    if not size / MOST_SCALE <= own <= size * MOST_SCALE:
        raise InvalidCloudError(f"{sizes}: are they of the same object and in the same units?")
    middle = np.linalg.norm((points.min(axis=0) + points.max(axis=0) - low - high) / 2)
    if middle > MOST_OFFSET * max(size, own):
        raise InvalidCloudError(f"the surface is not where the skeleton is: {middle:.4g} away; {sizes}")


def _check_root(root: RootPlace | None, skeleton: Skeleton) -> None:
    """InvalidParameterError if a root is a point outside of the box around the cloud."""
    point = resolve_point(root if root is None or isinstance(root, str) else tuple(np.atleast_1d(root).tolist()))
    low, high = _box(skeleton)
    if point is not None and not ((low <= point) & (point <= high)).all():
        low_words, high_words = (", ".join(f"{number:.4g}" for number in corner) for corner in (low, high))
        raise InvalidParameterError(
            f"root = {shown(point)}: is outside of the cloud, from ({low_words}) to ({high_words})"
        )


def _box(skeleton: Skeleton) -> tuple[Floats, Floats]:
    """Around the cloud of a skeleton and its balls."""
    radii = np.nan_to_num(skeleton.radii)[:, None]
    known = skeleton.points[skeleton.vertex_of_point >= 0]
    return box(np.concatenate([skeleton.vertices - radii, skeleton.vertices + radii, known]))


def _joints(forest: Skeleton, origin: np.ndarray, names: list[str]) -> tuple[list[dict[str, Any]], np.ndarray]:
    """The joints, one per edge, each placed relative to the one before; and their places relative to the origin."""
    places, parent = forest.vertices[forest.edges[:, 0]] - origin, bone_before(forest)
    steps = np.where((parent >= 0)[:, None], places - places[parent], places)
    joints: list[dict[str, Any]] = [
        {"name": name, "translation": step} for name, step in zip(names, steps.tolist(), strict=True)
    ]
    for child, bone in enumerate(parent.tolist()):
        if bone >= 0:
            joints[bone].setdefault("children", []).append(child)
    return joints, places


def _glb(scene: dict[str, Any], arrays: list[np.ndarray]) -> bytes:
    """A binary file of a scene and the arrays that it names by their numbers."""
    body, views, accessors = b"", [], []
    for number, values in enumerate(arrays):
        views.append({"buffer": 0, "byteOffset": len(body), "byteLength": values.nbytes})
        if values.dtype == np.uint8:  # of an image, which is the last
            body += _padded(values.tobytes(), b"\0")
            continue
        limits = {
            name: np.atleast_1d(value).tolist() for name, value in (("min", values.min(0)), ("max", values.max(0)))
        }
        facts = {"bufferView": number, "componentType": COMPONENT_TYPES[values.dtype.str[1:]], "count": len(values)}
        accessors.append({**facts, "type": ARRAY_TYPES[values.shape[1:]], **limits})
        body += _padded(values.tobytes(), b"\0")
    scene |= {"accessors": accessors, "bufferViews": views, "buffers": [{"byteLength": len(body)}]}
    scene |= {"asset": {"version": "2.0", "generator": "glsk-o3d"}}
    text = _padded(json.dumps(scene, separators=(",", ":"), allow_nan=False).encode(), b" ")
    chunks = b"".join(_words(len(data), kind) + data for data, kind in ((text, JSON_CHUNK), (body, BINARY_CHUNK)))
    return _words(MAGIC, 2, 12 + len(chunks)) + chunks


def _padded(data: bytes, filler: bytes) -> bytes:
    """Up to a multiple of four bytes."""
    return data + filler * (-len(data) % 4)


def _words(*numbers: int) -> bytes:
    return np.array(numbers, "<u4").tobytes()
