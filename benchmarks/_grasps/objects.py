"""Objects to grasp, of which it is known what is inside: unions of capsules by formula, a mug by rays."""

from __future__ import annotations

from functools import cache

import numpy as np
import open3d as o3d
from scipy.spatial import cKDTree

from glsk_o3d import samples

NOISE = 0.005  # standard deviation, as a share of the diagonal
FAR = 3.0  # of a camera from the middle of the mug, over its diagonal
HEIGHT, RADIUS, WALL, FLOOR = 0.095, 0.04, 0.004, 0.006  # of the mug [m]
HANDLE, ARC = 0.006, 0.03  # radius of the handle's tube, and of the half ring that it is [m]

NAMES = ("mug", "sauropod", "two_rings", "y_junction", "torus", "helix", "tree")
CONDITIONS = ("clean", "noise", "two cameras")


class Capsules:
    """A sample of the package: points, and what is inside by the distance to its capsules."""

    def __init__(self, name: str, seed: int) -> None:
        self.name = name
        drawn = samples.SAMPLES[name](16, seed=seed)  # each seed is another tree
        self.nodes, self.edges, self.radii = drawn.nodes, drawn.edges, drawn.radii
        lengths = np.linalg.norm(self.nodes[self.edges[:, 1]] - self.nodes[self.edges[:, 0]], axis=1)
        self.tree, self.most = cKDTree(self.nodes), self.radii.max() + lengths.max() / 2

    def cloud(self, n: int, condition: str, seed: int) -> np.ndarray:
        """So many points."""
        noise = NOISE if condition == "noise" else 0.0
        if condition != "two cameras":
            return samples.SAMPLES[self.name](n, noise=noise, seed=seed).points
        whole = samples.SAMPLES[self.name](3 * n, seed=seed).points
        seen = np.zeros(len(whole), bool)
        for camera in cameras(whole):
            seen |= samples.capsules.visible(whole, camera, self.nodes, self.edges, self.radii)
        return whole[seen][:n]

    def inside(self, places: np.ndarray) -> np.ndarray:
        """Which places are, (n,) bool array."""
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
        """So many points."""
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
        """Which places are, (n,) bool array."""
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
