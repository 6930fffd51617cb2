"""Files of every kind that is read, damaged at random, and what reads them."""

from __future__ import annotations

import tempfile
import warnings
from collections.abc import Callable
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import numpy as np

import glsk_o3d as glsk
from glsk_o3d import GlskError, samples
from glsk_o3d.apps.batch.inputs import find_inputs
from glsk_o3d.apps.batch.ledger import Ledger
from glsk_o3d.apps.meshlab.steps import read_steps
from glsk_o3d.interop.packages import import_open3d
from glsk_o3d.io.scans import read_scan
from glsk_o3d.recipes import load_recipe, save_recipe

READERS: dict[str, Callable[[Path], object]] = {
    "cloud": read_scan,
    "skeleton": glsk.read_skeleton,
    "recipe": load_recipe,
    "script": read_steps,
    "ledger": lambda path: Ledger(path.parent),
    "list": lambda path: find_inputs([path], path.parent / "out"),
}
"""What reads a kind of files."""
HEADER_BYTES = 400  # where most mistakes are made
EXTREMES = (-1, 0, 1, 2**31 - 1, 2**31, 2**32, 2**63, 10**18, 10**400, "1e308", "1e309", "-0", "nan", "inf", "0x1", "")
ENDINGS = (".ply", ".pcd", ".xyz", ".obj", ".stl", ".las", ".laz", ".e57", ".json", ".npz", ".swc")


def damaged_file(rng: np.random.Generator) -> tuple[str, str, str, bytes]:
    """The kind and ending of a file in words; its kind, its ending, perhaps a wrong one, and its bytes."""
    names = [*seeds()]
    name = names[rng.integers(len(names))]
    kind, ending = name.split()[:2]
    data = damaged(seeds()[name], rng)
    wrong = kind in ("cloud", "skeleton") and rng.random() < 0.05
    return f"{kind} {ending}", kind, str(rng.choice(ENDINGS)) if wrong else ending, data


def read(kind: str, ending: str, data: bytes) -> tuple[str, list[str]]:
    """Whether a file was ``"read"`` or ``"refused"``, and findings."""
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("error")
        path = Path(folder, "ledger.jsonl" if kind == "ledger" else f"f{ending}")
        path.write_bytes(data)
        try:
            READERS[kind](path)
            return "read", []
        except (GlskError, OSError) as error:
            message, findings = str(error), []
            if len(message) > 2000 or "\n" in message:
                findings.append(f"an error of {len(message)} characters and {message.count(chr(10)) + 1} lines")
            if isinstance(error.__cause__, MemoryError) or "bad_alloc" in message or "Unable to allocate" in message:
                findings.append("it asked for more memory than there is")
            return "refused", findings


def damaged(data: bytes, rng: np.random.Generator) -> bytes:
    """The content of a file with a few things wrong, more often in its header."""
    changed = bytearray(data)
    in_header = rng.random() < 0.5
    for _ in range(rng.choice([1, 1, 2, 5, 20])):
        if not changed:
            break
        at = int(rng.integers(min(len(changed), HEADER_BYTES) if in_header else len(changed)))
        DAMAGES[rng.integers(len(DAMAGES))](changed, at, rng)
    return bytes(changed) or b"\0"


def _flip(data: bytearray, at: int, rng: np.random.Generator) -> None:
    data[at] = rng.integers(256)


def _fill(data: bytearray, at: int, rng: np.random.Generator) -> None:
    data[at : at + int(rng.integers(1, 9))] = bytes(rng.choice([b"\xff", b"9", b"-", b" ", b"\n", b"nan", b"\x1b[31m"]))


def _repeat(data: bytearray, at: int, rng: np.random.Generator) -> None:
    start = int(rng.integers(len(data)))
    data[at:at] = data[start : start + int(rng.integers(1, 60))] * int(rng.choice([1, 1, 1, 200]))


def _remove(data: bytearray, at: int, rng: np.random.Generator) -> None:
    del data[at : at + int(rng.integers(1, 60)) if rng.random() < 0.5 else None]


def _number(data: bytearray, at: int, rng: np.random.Generator) -> None:
    """Another number in the place of one in words, or of four bytes."""
    other = EXTREMES[rng.integers(len(EXTREMES))]
    stop = at
    while at > 0 and chr(data[at - 1]) in "+-.0123456789e":
        at -= 1
    while stop < len(data) and chr(data[stop]) in "+-.0123456789e":
        stop += 1
    if stop > at:
        data[at:stop] = str(other).encode()
    else:
        data[at : at + 4] = (int(rng.choice([0, 1, 2**31 - 1, 2**32 - 1, 2**16]))).to_bytes(4, "little")


DAMAGES = (_flip, _flip, _fill, _repeat, _remove, _remove, _number, _number)


@cache
def seeds() -> dict[str, bytes]:
    """Sound files, by kind, ending and what else tells them apart; those of packages that are missing are left out."""
    with tempfile.TemporaryDirectory() as folder:
        return {**_clouds(Path(folder)), **_skeletons(Path(folder)), **_others(Path(folder))}


def _clouds(folder: Path) -> dict[str, bytes]:
    o3d = import_open3d()
    points = samples.torus(60).points
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    cloud.normals = cloud.points
    cloud.colors = o3d.utility.Vector3dVector(np.abs(points) % 1)
    mesh = o3d.geometry.TriangleMesh.create_torus(1, 0.3, 6, 5)
    o3d.io.write_point_cloud(str(folder / "binary.pcd"), cloud)
    o3d.io.write_point_cloud(str(folder / "ascii.pcd"), cloud, write_ascii=True)
    o3d.io.write_point_cloud(str(folder / "compressed.pcd"), cloud, compressed=True)
    o3d.io.write_point_cloud(str(folder / "binary.ply"), cloud)
    o3d.io.write_point_cloud(str(folder / "ascii.ply"), cloud, write_ascii=True)
    o3d.io.write_point_cloud(str(folder / "points.xyz"), cloud)
    o3d.io.write_triangle_mesh(str(folder / "mesh.obj"), mesh, write_vertex_normals=False)
    o3d.io.write_triangle_mesh(str(folder / "mesh.stl"), mesh.compute_vertex_normals())
    o3d.io.write_triangle_mesh(str(folder / "mesh.ply"), mesh)
    rows = "\n".join(",".join(f"{value:.3f}" for value in row) + ",1" for row in points)
    (folder / "table.csv").write_text(f"x,y,z,label\n{rows}\n")
    (folder / "table.txt").write_text(rows.replace(",", " "))
    head = "ply\nformat ascii 1.0\nelement extra 2\nproperty list uchar int of\nelement vertex 60\n"
    head += "".join(f"property double {axis}\n" for axis in "xyz") + "property float label\nend_header\n2 0 1\n1 5\n"
    (folder / "list.ply").write_text(head + rows.replace(",", " ") + "\n")
    if find_spec("laspy") and find_spec("lazrs"):
        import laspy

        for number in (0, 3, 7):
            scan = laspy.LasData(laspy.LasHeader(point_format=number, version="1.4" if number == 7 else "1.2"))
            scan.x, scan.y, scan.z = points.T
            scan.write(str(folder / f"format{number}.las"))
            scan.write(str(folder / f"format{number}.laz"))
    if find_spec("pye57"):
        import pye57

        with pye57.E57(str(folder / "scan.e57"), mode="w") as file:
            file.write_scan_raw(dict(zip(("cartesianX", "cartesianY", "cartesianZ"), points.T.copy(), strict=True)))
    return {f"cloud {path.suffix} {path.stem}": path.read_bytes() for path in sorted(folder.iterdir())}


def _skeletons(folder: Path) -> dict[str, bytes]:
    skeleton, found = glsk.skeletonize(samples.torus(300).points), {}
    for ending in (".json", ".npz", ".swc", ".ply", ".obj"):
        glsk.save_skeleton(skeleton, folder / f"k{ending}", cut_loops=True)
        found[f"skeleton {ending}"] = (folder / f"k{ending}").read_bytes()
    return found


def _others(folder: Path) -> dict[str, bytes]:
    save_recipe(glsk.pipelines.default(), folder / "r.json")
    found = {"recipe .json": (folder / "r.json").read_bytes()}
    script = '<!DOCTYPE FilterScript>\n<FilterScript>\n <filter name="Generate Curve Skeleton (GLSkeleton)">\n'
    script += '  <Param type="RichAbsPerc" name="connector_radius" value="2%"/>\n </filter>\n</FilterScript>\n'
    found["script .mlx"] = script.encode()
    row = '{"name": "a", "input": "/a.xyz", "status": "done", "seconds": 1, "outputs": ["a.json"], "messages": ["m"]}\n'
    found["ledger .jsonl"] = (row + row.replace('"a', '"b')).encode()
    found["list .txt"] = f"# clouds\n{__file__}\n../s.ply\n".encode()
    return found
