"""Grasps: how many of the best put a finger through the object, and how many of the first ten would hold it.

The README of the benchmarks says what each command shows.
"""

from __future__ import annotations

import os
import time
import warnings
from collections.abc import Callable
from functools import cache
from itertools import product
from pathlib import Path
from typing import Annotated

import numpy as np
import open3d as o3d
import typer
from scipy.spatial import cKDTree

from glsk_o3d import samples, skeletonize
from glsk_o3d.analysis import GraspCandidates, grasp_candidates

from .runs import Jobs, Output, Page, application, publish, run
from .tables import Tables, good, pick

NOISE = 0.005  # standard deviation, as a share of the diagonal
FAR = 3.0  # of a camera from the middle of the mug, over its diagonal
HEIGHT, RADIUS, WALL, FLOOR = 0.095, 0.04, 0.004, 0.006  # of the mug [m]
HANDLE, ARC = 0.006, 0.03  # radius of the handle's tube, and of the half ring that it is [m]

NAMES = ("mug", "sauropod", "two_rings", "y_junction", "torus", "helix", "tree")
CONDITIONS = ("clean", "noise", "two cameras")


BEST = 20
OPENING = {"mug": 0.08}  # in metres; of the samples, which have no unit:
USUAL_OPENING = 0.25
STEPS = (9, 9, 25)  # of the grid in a box, at rest; on the way in, as close
COLUMNS = [(condition, key) for condition in CONDITIONS for key in ("alone", "checked")] + [(CONDITIONS[-1], "seen")]
WORDS = {"alone": "axis alone", "checked": "checked", "seen": "all sides seen"}

DIAGONALS = {  # of real things, whose meshes have the diagonal 1 [m]
    **dict(adjustable_wrench=0.25, binoculars=0.18, bleach_cleanser=0.27, cup=0.11, doorknob=0.12, femur=0.45),
    **dict(flashlight=0.2, flat_screwdriver=0.21, fryingpan=0.45, hammer=0.3, knife=0.3, large_clamp=0.24),
    **dict(medium_clamp=0.15, toothpaste=0.2, toy_airplane=0.25, waterbottle=0.25, bear=0.2, cat=0.2, dino=0.25),
    **dict(cow=0.2, elk=0.25, triceratops=0.25, turtle=0.18, cheburashka=0.2, mug=0.0, power_drill=0.0, banana=0.0),
}
FIRST = 10
ANY = "no curve skeleton"  # accepted: what is a sheet or a ball may have a handle
PIXELS, VIEW = (160, 120), 26.0  # of a depth image; its angle of view [degrees]
CONTACT = 0.002  # how far a soft jaw gives way: what it touches is that near to the first contact [m]
ANTIPODAL = np.cos(np.radians(20))
SURFACE = 300_000  # points that show a mesh to the boxes of a gripper
VIEWS = ("two cameras", "2 % outliers")

app = application(__doc__)


class Capsules:
    """A sample of the package: points, and what is inside by the distance to its capsules."""

    def __init__(self, name: str, seed: int) -> None:
        self.name = name
        drawn = samples.SAMPLES[name](16, seed=seed)  # each seed is another tree
        self.nodes, self.edges, self.radii = drawn.nodes, drawn.edges, drawn.radii
        lengths = np.linalg.norm(self.nodes[self.edges[:, 1]] - self.nodes[self.edges[:, 0]], axis=1)
        self.tree, self.most = cKDTree(self.nodes), self.radii.max() + lengths.max() / 2

    def cloud(self, n: int, condition: str, seed: int) -> np.ndarray:
        noise = NOISE if condition == "noise" else 0.0
        if condition != "two cameras":
            return samples.SAMPLES[self.name](n, noise=noise, seed=seed).points
        whole = samples.SAMPLES[self.name](3 * n, seed=seed).points
        seen = np.zeros(len(whole), bool)
        for camera in cameras(whole):
            seen |= samples.capsules.visible(whole, camera, self.nodes, self.edges, self.radii)
        return whole[seen][:n]

    def inside(self, places: np.ndarray) -> np.ndarray:
        near = self.tree.query(places)[0] < self.most
        near[near] = samples.signed_distance(places[near], self.nodes, self.edges, self.radii) < 0
        return near


class Mug:
    """A hollow mug with a handle, in metres, standing on z = 0: two closed meshes."""

    name = "mug"

    def __init__(self) -> None:
        self.meshes = mug_meshes()
        self.scenes = [scene_of([mesh]) for mesh in self.meshes]

    def cloud(self, n: int, condition: str, seed: int) -> np.ndarray:
        o3d.utility.random.seed(seed)
        both = self.meshes[0] + self.meshes[1]
        whole = np.asarray(both.sample_points_uniformly(4 * n).points)
        inner = [scene.compute_signed_distance(whole.astype(np.float32)).numpy() < -1e-5 for scene in self.scenes]
        whole = whole[~np.any(inner, axis=0)]
        if condition == "two cameras":
            scene, seen = scene_of(self.meshes), np.zeros(len(whole), bool)
            for camera in cameras(whole):
                rays = np.hstack([np.broadcast_to(camera, whole.shape), whole - camera]).astype(np.float32)
                seen |= scene.cast_rays(rays)["t_hit"].numpy() > 1 - 1e-3
            whole = whole[seen]
        points = whole[:n]
        noise = NOISE * np.linalg.norm(np.ptp(points, axis=0)) if condition == "noise" else 0.0
        return points + np.random.default_rng(seed).normal(scale=noise, size=points.shape)

    def inside(self, places: np.ndarray) -> np.ndarray:
        return np.any([scene.compute_occupancy(places.astype(np.float32)).numpy() > 0 for scene in self.scenes], axis=0)


@cache
def built(name: str, seed: int) -> Capsules | Mug:
    """An object by its name, and the seed of its cloud."""
    return Mug() if name == "mug" else Capsules(name, seed)


def cameras(points: np.ndarray) -> np.ndarray:
    """Two places from which an object is seen, a quarter of a turn apart, from above."""
    middle, size = points.mean(axis=0), np.linalg.norm(np.ptp(points, axis=0))
    return middle + FAR * size * np.array([[0.8, 0.2, 0.55], [-0.2, 0.8, 0.55]])


def scene_of(meshes: list) -> o3d.t.geometry.RaycastingScene:
    """What rays can be cast on."""
    scene = o3d.t.geometry.RaycastingScene(nthreads=1)
    for mesh in meshes:
        scene.add_triangles(o3d.t.geometry.TriangleMesh.from_legacy(mesh))
    return scene


def mug_meshes() -> list:
    """Body and handle."""
    turn = np.linspace(0, 2 * np.pi, 129)
    inner = RADIUS - WALL
    r, z = np.array([[0, 0], [RADIUS, 0], [RADIUS, HEIGHT], [inner, HEIGHT], [inner, FLOOR], [0, FLOOR]]).T
    body = np.stack([r * np.cos(turn)[:, None], r * np.sin(turn)[:, None], np.broadcast_to(z, (len(turn), 6))], axis=2)
    bend, around = np.linspace(-np.pi / 2, np.pi / 2, 49)[:, None], turn[None, ::4]
    tube = np.concatenate([np.zeros_like(around), np.full_like(around, HANDLE), np.zeros_like(around)])
    bend = np.concatenate([bend[:1], bend, bend[-1:]])
    tube = np.concatenate([tube[:1], np.repeat(tube[1:2], 49, axis=0), tube[-1:]])
    out = ARC + tube * np.cos(around)
    start = RADIUS - WALL / 2
    handle = np.stack([start + out * np.cos(bend), tube * np.sin(around), HEIGHT / 2 + out * np.sin(bend)], axis=2)
    return [surface(body), surface(handle)]


def surface(grid: np.ndarray) -> o3d.geometry.TriangleMesh:
    """The mesh of a grid of places, (n, m, 3)."""
    n, m, _ = grid.shape
    corner = (m * np.arange(n - 1)[:, None] + np.arange(m - 1)).ravel()
    faces = np.concatenate([corner[:, None] + [0, m, m + 1], corner[:, None] + [0, m + 1, 1]])
    mesh = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(grid.reshape(-1, 3)), o3d.utility.Vector3iVector(faces.astype(np.int32))
    )
    mesh.merge_close_vertices(1e-7)
    mesh.remove_degenerate_triangles()
    mesh.orient_triangles()
    return mesh


def pierces(grasps: GraspCandidates, inside: Callable[[np.ndarray], np.ndarray], way: float) -> np.ndarray:
    """Which grasps have a finger or the palm in the object, at rest and on the way in: (G, 2) bool array."""
    found = np.zeros((len(grasps), 2), bool)
    corners = grasps.gripper.boxes(grasps.opening, grasps.depth)
    for row, (pose, *boxes) in enumerate(zip(grasps.poses, *corners, strict=True)):
        for low, high in zip(*boxes, strict=True):
            back = np.arange(0, way, (high - low)[2] / STEPS[2])
            axes = [np.linspace(*ends, n) for *ends, n in zip(low, high, STEPS, strict=True)]
            for column, z in enumerate((axes[2], low[2] - back)):
                grid = np.stack(np.meshgrid(*axes[:2], z, indexing="ij"), axis=-1).reshape(-1, 3)
                found[row, column] |= inside(grid @ pose[:3, :3].T + pose[:3, 3]).any()
    found[:, 1] |= found[:, 0]
    return found


def measure(name: str, condition: str, n: int, seed: int) -> dict:
    """The best grasps of one cloud, found without and with a look at its points."""
    thing = built(name, seed)
    points = thing.cloud(n, condition, seed)
    way = float(np.linalg.norm(np.ptp(points, axis=0)))
    opening = OPENING.get(name, USUAL_OPENING)
    row: dict = {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # no grasp at all shows as such
        skeleton = skeletonize(points)
        for key, cloud in (("alone", ()), ("checked", None)):
            start = time.process_time()
            found = grasp_candidates(skeleton, opening, cloud=cloud, accept=ANY)
            row[f"{key} cpu"] = time.process_time() - start
            row[key] = judged(found, thing.inside, way)
        row["seen"] = judged(found[found.seen == 3], thing.inside, way)
    return row


def judged(found: GraspCandidates, inside: Callable[[np.ndarray], np.ndarray], way: float) -> dict:
    """How many there are, and how many of the best are bad, at rest and on the way in."""
    best = found[:BEST]
    rest, coming = pierces(best, inside, way).sum(axis=0).tolist()
    return dict(found=len(found), best=len(best), rest=rest, coming=coming)


def tables(rows: list[dict]) -> Tables:
    """A line for each object; without and with the check in each condition."""
    lines = []
    for shape in dict.fromkeys(row["shape"] for row in rows):
        cells = []
        for condition, key in COLUMNS:
            here = good(pick(rows, shape=shape, condition=condition))
            bad, best, found = (sum(row[key][name] for row in here) for name in ("coming", "best", "found"))
            cells.append(f"{bad} of {best}" + ("" if key == "alone" else f" ({found})"))
        lines.append([shape, *cells])
    header = ["object", *(f"{condition}, {WORDS[key]}" for condition, key in COLUMNS)]
    return [(f"Of the best {BEST}, with a finger or the palm in the object (of all found)", header, lines)]


@app.command()
def pierced(
    shapes: Annotated[str, typer.Option("--shapes", metavar="NAMES", help="With commas; else all.")] = ",".join(NAMES),
    points: Annotated[int, typer.Option("--points", min=100)] = 8192,
    draws: Annotated[int, typer.Option("--draws", min=1, help="Clouds of each object and condition.")] = 1,
    jobs: Jobs = 2,
    output: Output = None,
    page: Page = None,
) -> None:
    """The best grasps against what is inside the object: without and with a look at its points."""
    cases = product(shapes.split(","), CONDITIONS, range(draws))
    work = [(dict(shape=it, condition=how, seed=seed), (it, how, points, seed)) for it, how, seed in cases]
    publish(run(measure, work, jobs), tables, output, page, "pierced")


@cache
def mesh_of(name: str, folder: str) -> o3d.geometry.TriangleMesh:
    """A thing of real size: a mesh of the folder, that around a scan, or the mug."""
    if name == "mug":
        return mug_meshes()[0] + mug_meshes()[1]
    file = Path(folder) / "meshes" / f"{name}.ply"
    if file.exists():
        mesh = o3d.io.read_triangle_mesh(os.fspath(file))
        return mesh.scale(DIAGONALS[name], np.zeros(3))
    scan = o3d.io.read_point_cloud(os.fspath(Path(folder) / "data" / f"ycb_{name}.ply"))
    scan.estimate_normals()
    scan.orient_normals_consistent_tangent_plane(20)
    return o3d.geometry.TriangleMesh.create_from_point_cloud_poisson(scan, depth=8)[0]


def depth_cloud(mesh: o3d.geometry.TriangleMesh, n: int, condition: str, seed: int) -> np.ndarray:
    """Points of two depth images."""
    scene, places = scene_of([mesh]), []
    middle = mesh.get_axis_aligned_bounding_box().get_center()
    for eye in cameras(np.asarray(mesh.vertices)):
        rays = scene.create_rays_pinhole(VIEW, middle, eye, np.array([0.0, 0, 1]), *PIXELS)
        depth = scene.cast_rays(rays)["t_hit"].numpy()[..., None]
        rays = rays.numpy()
        places.append((rays[..., :3] + depth * rays[..., 3:])[np.isfinite(depth[..., 0])])
    rng, points = np.random.default_rng(seed), np.concatenate(places).astype(float)
    points = rng.permutation(points)[:n]
    if condition == VIEWS[1]:
        low, size = points.min(axis=0), np.ptp(points, axis=0)
        points = np.concatenate([points, low + size * (1.2 * rng.random((len(points) // 50, 3)) - 0.1)])
    return points


def holds(grasps: GraspCandidates, mesh: o3d.geometry.TriangleMesh) -> np.ndarray:
    """Whether grasps are free at rest, free on the way in, and antipodal: (G, 3) bool array."""
    scene, rows = scene_of([mesh]), np.zeros((len(grasps), 3), bool)
    o3d.utility.random.seed(0)
    places = np.asarray(mesh.sample_points_uniformly(SURFACE).points)
    distance = np.linalg.norm(np.ptp(places, axis=0))
    corners = grasps.gripper.boxes(grasps.opening, grasps.depth)
    for row, (pose, low, high) in enumerate(zip(grasps.poses, *corners, strict=True)):
        local = ((places - pose[:3, 3]) @ pose[:3, :3])[:, None]
        beside = ((local > low) & (local < high))[..., :2].all(axis=2)
        rows[row, 0] = not (beside & (local[..., 2] > low[:, 2]) & (local[..., 2] < high[:, 2])).any()
        rows[row, 1] = not (beside & (local[..., 2] > low[:, 2] - distance) & (local[..., 2] < high[:, 2])).any()
        jaw, low, high = (
            grasps.opening[row] / 2,
            low[0],
            high[0],
        )  # the inner face of a finger, of the same size on both
        pad = np.stack(np.meshgrid(0, *(np.linspace(low[i], high[i], n) for i, n in ((1, 9), (2, 33)))), axis=-1)
        cosines = []
        for side in (-1.0, 1.0):
            start = (pad.reshape(-1, 3) + [side * jaw, 0, 0]) @ pose[:3, :3].T + pose[:3, 3]
            inwards = np.broadcast_to(-side * pose[:3, 0], start.shape)
            hit = scene.cast_rays(np.hstack([start, inwards]).astype(np.float32))
            way, normal = hit["t_hit"].numpy(), hit["primitive_normals"].numpy()
            touched = way < min(way.min() + CONTACT, 2 * jaw)
            mean = (normal[touched] * np.sign(normal[touched] @ pose[:3, 0])[:, None]).sum(axis=0)
            cosines.append(mean @ pose[:3, 0] / max(np.linalg.norm(mean), 1e-12))
        rows[row, 2] = min(cosines) >= ANTIPODAL
    return rows


def measure_held(name: str, condition: str, n: int, folder: str) -> dict:
    """The first grasps of a thing seen by two cameras, and how many of them would hold the mesh."""
    mesh = mesh_of(name, folder)
    points = depth_cloud(mesh, n, condition, 0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        skeleton = skeletonize(points)
        start = time.process_time()
        found = grasp_candidates(skeleton, OPENING["mug"], accept=ANY)
        seconds = time.process_time() - start
    rest, coming, antipodal = holds(found[:FIRST], mesh).T
    numbers = dict(free=rest, way=rest & coming, good=rest & antipodal, whole=rest & coming & antipodal)
    counts = {key: int(value.sum()) for key, value in numbers.items()}
    return dict(found=len(found), first=len(rest), seconds=seconds, verdict=skeleton.verdict.value, **counts)


def tables_held(rows: list[dict]) -> Tables:
    """A line for each thing: of the first grasps those that are free and antipodal, in each condition."""
    lines = []
    for name in dict.fromkeys(row["thing"] for row in rows):
        cells = []
        for condition in VIEWS:
            for row in good(pick(rows, thing=name, condition=condition)):
                cells += [f"{row['good']} of {row['first']}", str(row["whole"]), str(row["found"])]
        lines.append([name, *cells])
    sums = [
        [f"{sum(r['good'] for r in each)} of {sum(r['first'] for r in each)}", str(sum(r["whole"] for r in each)), ""]
        for each in (good(pick(rows, condition=condition)) for condition in VIEWS)
    ]
    lines.append(["all", *(cell for cells in sums for cell in cells)])
    header = ["object", *(f"{view}{word}" for view in VIEWS for word in ("", ", free on the way", ", all grasps"))]
    return [(f"Of the first {FIRST} grasps, free and antipodal", header, lines)]


@app.command()
def held(
    folder: Annotated[str, typer.Option("--folder", metavar="FOLDER", help="With meshes/ and data/.")],
    things: Annotated[str, typer.Option("--things", metavar="NAMES", help="With commas; else all.")] = ",".join(
        DIAGONALS
    ),
    points: Annotated[int, typer.Option("--points", min=100)] = 8192,
    jobs: Jobs = 2,
    output: Output = None,
    page: Page = None,
) -> None:
    """The first grasps of things seen by two depth cameras: free, and antipodal, on their meshes."""
    cases = product(things.split(","), VIEWS)
    work = [(dict(thing=it, condition=how), (it, how, points, folder)) for it, how in cases]
    publish(run(measure_held, work, jobs), tables_held, output, page, "held")
