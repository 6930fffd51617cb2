"""What a mesh looks like in glTF: normals, colours, and textures with their places and materials."""

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np

from ...geometry.vectors import norm, unit
from ...interop.clouds import open3d_class
from ...interop.packages import import_open3d

SRGB_KNEE = 0.04045  # published: IEC 61966-2-1, where the curve of sRGB begins
FACTORS = {"metallicFactor": "metallic", "roughnessFactor": "roughness"}
"""What glTF 2.0, 5.22, and Open3D call the numbers of a material."""


class Texture(NamedTuple):
    """Places in the image of every corner of the triangles, the material of every triangle, and the materials."""

    corners: np.ndarray  # (3 T, 2), from the upper left of the image
    material: np.ndarray  # (T,) int
    images: list[np.ndarray | None]  # (height, width, channels) uint8, by material
    factors: dict[str, Any]


def vertex_looks(mesh: Any, n: int) -> dict[str, np.ndarray]:
    """Normals and colours, where each of n vertices has one; colours are linear in glTF."""
    name, tensor = open3d_class(mesh)
    prefix = {"PointCloud": "", "TriangleMesh": "vertex_"}.get(name)
    if prefix is None:
        return {}
    mesh, looks = mesh.to_legacy() if tensor else mesh, {}
    normals, colors = (np.asarray(getattr(mesh, prefix + name)) for name in ("normals", "colors"))
    if len(normals) == n and (norm(normals) > 0).all():
        looks["NORMAL"] = unit(normals)
    if len(colors) == n:
        looks["COLOR_0"] = np.where(colors <= SRGB_KNEE, colors / 12.92, ((colors + 0.055) / 1.055) ** 2.4)
    return looks


def texture(mesh: Any, n: int) -> Texture | None:
    """The texture of a mesh of n triangles, None without places in it."""
    name, tensor = open3d_class(mesh)
    if name != "TriangleMesh" or not (("texture_uvs" in mesh.triangle) if tensor else mesh.has_triangle_uvs()):
        return None
    images, material, factors = list[Any](), np.zeros(n, int), dict[str, Any]()
    if not tensor:
        corners, ids = np.asarray(mesh.triangle_uvs), np.asarray(mesh.triangle_material_ids)
        # Open3D turns the images of its legacy meshes upside down when it reads them
        images = [None if image.is_empty() else np.asarray(image)[::-1] for image in mesh.textures]
        material = ids if len(ids) == n and ids.min(initial=0) >= 0 else material
    else:
        corners, look = mesh.triangle["texture_uvs"].cpu().numpy().reshape(-1, 2), mesh.material
        if "albedo" in look.texture_maps:
            images = [look.texture_maps["albedo"].as_tensor().cpu().numpy()]
        factors = {key: look.scalar_properties[name] for key, name in FACTORS.items() if name in look.scalar_properties}
        if "base_color" in look.vector_properties:
            factors["baseColorFactor"] = np.clip(look.vector_properties["base_color"], 0, 1).tolist()
    if len(corners) != 3 * n:
        return None
    images += [None] * (material.max(initial=0) + 1 - len(images))
    images = [None if image is None or image.dtype != np.uint8 else image for image in images]
    return Texture(corners * [1, -1] + [0, 1], material, images, factors)


def png(image: np.ndarray) -> np.ndarray:
    """The content of a PNG file of an image, (b,) uint8 array."""
    o3d = import_open3d()
    with TemporaryDirectory() as folder:
        path = Path(folder, "texture.png")
        o3d.t.io.write_image(str(path), o3d.t.geometry.Image(o3d.core.Tensor(np.ascontiguousarray(image))))
        return np.frombuffer(path.read_bytes(), np.uint8)
