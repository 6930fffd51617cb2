"""One object in time: does it keep its graph, its place and its branches, frame by frame and tracked?"""

from __future__ import annotations

import os
import time
from itertools import pairwise, product
from pathlib import Path

import numpy as np
import open3d as o3d
from scipy.spatial.transform import Rotation

from glsk_o3d import Tracker, samples, skeletonize
from glsk_o3d.editing import transform

from .grasps import cameras, mug_meshes
from .runs import Jobs, Output, application, publish, run
from .tables import Tables, fixed, grouped, table

MESHES = Path(os.environ.get("GLSK_SHARED", "shared")) / "meshes"
SHAPES = {"sauropod": dict(cameras=None), "y_junction": {}, "tree": dict(forks=2), "two_rings": {}}
NAMES = (*SHAPES, "mug", *(name for name in ("hammer", "cup", "cow", "dino", "human") if MESHES.is_dir()))
CONDITIONS = ("static", "static, two cameras", "moving", "moving, two cameras")
SIZE, NOISE, POINTS, FIRST = 0.3, 0.001, 4096, 5  # diagonal and noise [m], points of a frame, frames that do not count
STEP, TURN, HIDING = 0.02, np.deg2rad(5), 100.0  # by frame [m, radians]; sizes that Open3D's sphere of views is large
COLUMNS = {"graphs": 0, "most frequent": 2, "move [mm]": 2, "95 % [mm]": 2, "identity": 2, "CPU [ms]": 0}

app = application(__doc__)


def surface(name: str, n: int, seed: int) -> np.ndarray:
    """Points of an object 0.3 m large, around the origin."""
    if name in SHAPES:
        whole = samples.SAMPLES[name](16, **SHAPES[name])
        axis, corners = (whole.nodes, whole.edges, whole.radii), whole.nodes
        points = samples.capsules.union_sample(name, *axis, n, 0.0, seed).points
    else:
        o3d.utility.random.seed(seed)
        mesh = o3d.io.read_triangle_mesh(f"{MESHES / name}.ply") if name != "mug" else mug_meshes()[0] + mug_meshes()[1]
        points, corners = np.asarray(mesh.sample_points_uniformly(n).points), mesh.vertices
    middle = (np.min(corners, axis=0) + np.max(corners, axis=0)) / 2
    return (points - middle) * SIZE / np.linalg.norm(np.ptp(corners, axis=0))


def frame(name: str, condition: str, seed: int, pose: np.ndarray) -> np.ndarray:
    """The points of a frame: another sample with other noise."""
    two_cameras, rng = condition.endswith("cameras"), np.random.default_rng(seed)
    points = surface(name, (3 if two_cameras else 1) * POINTS, seed) @ pose[:3, :3].T + pose[:3, 3]
    if two_cameras:
        cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
        views = [cloud.hidden_point_removal(eye, HIDING * SIZE)[1] for eye in cameras(surface(name, POINTS, 0))]
        points = points[rng.permutation(np.unique(np.concatenate(views)))[:POINTS]]
    return points + rng.normal(scale=NOISE, size=points.shape)


def moved(pose: np.ndarray, seed: int) -> np.ndarray:
    """The pose after a turn about the middle of the object and a step."""
    axis, way = (row / np.linalg.norm(row) for row in np.random.default_rng([seed, 7]).normal(size=(2, 3)))
    after = pose.copy()
    after[:3, :3] = Rotation.from_rotvec(TURN * axis).as_matrix() @ pose[:3, :3]
    after[:3, 3] += STEP * way
    return after


def measure(name: str, condition: str, method: str, frames: int) -> dict:
    """What becomes of one object, skeletonised frame by frame or tracked; places are compared in its own frame."""
    tracker, pose, resting, names, seconds = Tracker(), np.eye(4), [], [], 0.0
    for seed in range(frames):
        pose = moved(pose, seed) if condition.startswith("moving") else pose
        points, start = frame(name, condition, seed, pose), time.process_time()
        result = tracker(points) if method == "tracked" else skeletonize(points)
        seconds += time.process_time() - start
        skeleton = result.skeleton if method == "tracked" else result
        names.append(result.identity if method == "tracked" else np.arange(len(skeleton.branches)))
        resting.append(transform(skeleton, np.linalg.inv(pose)))
    resting, names = resting[FIRST:], names[FIRST:]
    graphs = [(it.n_components, it.n_loops, len(it.leaves)) for it in resting]
    steps = 1e3 * np.concatenate([after.nearest(before.vertices).distance for before, after in pairwise(resting)])
    known = [names[0][resting[0].nearest(it.vertices[it.edges].mean(axis=1)).branch] for it in resting]
    same = [np.mean(a == b[it.branch_of_edge]) for a, b, it in zip(known, names, resting, strict=True)]
    numbers = len({*graphs}), max(map(graphs.count, graphs)) / len(graphs), *np.quantile(steps, (0.5, 0.95)), min(same)
    return dict(zip(COLUMNS, (*map(float, numbers), 1e3 * seconds / frames), strict=True))


def tables(rows: list[dict]) -> Tables:
    """A table for each condition."""
    columns = {"shape": "shape", "method": "method"}
    columns |= {name: fixed(name, digits) for name, digits in COLUMNS.items()}
    return [table(condition, here, columns) for condition, here in grouped(rows, "condition").items()]


@app.command()
def tracked(shapes: str = ",".join(NAMES), frames: int = 30, jobs: Jobs = 2, output: Output = None) -> None:
    """Graphs, movement and identities of objects of 0.3 m in frames of 4096 points with 1 mm of noise."""
    cases = product(shapes.split(","), CONDITIONS, ("each frame", "tracked"))
    work = [(dict(shape=a, condition=b, method=c), (a, b, c, frames)) for a, b, c in cases]
    publish(run(measure, work, jobs), tables, output)
