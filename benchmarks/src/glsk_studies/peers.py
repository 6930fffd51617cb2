"""Other tools that make curve skeletons, each called as its documentation says; see docs/comparison.md.

None is needed by the package. What they need is in peers.txt, and is imported where it is used.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import open3d as o3d
import typer
from scipy.spatial import cKDTree

from glsk_o3d import Skeleton, samples
from glsk_o3d.analysis.curves import simple_edges
from glsk_o3d.recipes.catalogue import named_pipeline

Graph = tuple[np.ndarray, np.ndarray]  # vertices (M, 3) and edges (E, 2)
Mesh = tuple[np.ndarray, np.ndarray]  # vertices (V, 3) and triangles (F, 3)


def without_outliers(points: np.ndarray) -> o3d.geometry.PointCloud:
    """The cloud without outliers; all that follow start here, for none of them drops any.

    Open3D's tutorials take a ratio of 2, which takes away the sparse end of uneven clouds. Of none, 2, 3, 4 and 6,
    tried with CGAL on a wrap of seven random shapes as five kinds of clouds, 3 was best.
    """
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    return cloud.remove_statistical_outlier(nb_neighbors=20, std_ratio=3.0)[0]


def wrap(points: np.ndarray, fineness: float = 100.0) -> Mesh:
    """CGAL's alpha wrap: closed, manifold, and needs no normals.

    Its examples take a tenth or a twentieth of the bounding-box diagonal for alpha, with which what is thin gets few
    triangles, and little of it a skeleton. A thirtieth, with edges made a hundredth, was best of what was tried.
    """
    from CGAL.CGAL_Alpha_wrap_3 import Point_3_Vector, alpha_wrap_3
    from CGAL.CGAL_Kernel import Point_3
    from CGAL.CGAL_Polyhedron_3 import Polyhedron_3
    from compas_cgal.meshing import trimesh_remesh

    kept = np.asarray(without_outliers(points).points)
    diagonal = float(np.linalg.norm(np.ptp(kept, axis=0)))
    given, surface = Point_3_Vector(), Polyhedron_3()
    for point in kept.tolist():
        given.append(Point_3(*point))
    alpha_wrap_3(given, diagonal / 30, diagonal / 600, surface)
    with TemporaryDirectory() as folder:
        path = str(Path(folder, "wrap.off"))
        surface.write_to_file(path)
        mesh = o3d.io.read_triangle_mesh(path)
    vertices, triangles = trimesh_remesh((np.asarray(mesh.vertices), np.asarray(mesh.triangles)), diagonal / fineness)
    return np.asarray(vertices), np.asarray(triangles)


def poisson(points: np.ndarray) -> Mesh:
    """Open3D's Poisson reconstruction, its defaults, with normals as its tutorials make them; crumbs are dropped."""
    cloud = without_outliers(points)
    cloud.estimate_normals()
    cloud.orient_normals_consistent_tangent_plane(30)
    mesh, _ = o3d.geometry.TriangleMesh.create_from_point_cloud_poisson(cloud, depth=8, n_threads=1)
    cluster, sizes, _ = mesh.cluster_connected_triangles()
    mesh.remove_triangles_by_mask(np.asarray(sizes)[np.asarray(cluster)] < 100)
    mesh.remove_unreferenced_vertices()
    return np.asarray(mesh.vertices), np.asarray(mesh.triangles)


def ours(name: str, points: np.ndarray, options: Mapping[str, object] | None = None) -> Graph:
    """A pipeline of this package."""
    skeleton = named_pipeline(name).with_options(options or {})(points)
    return skeleton.vertices, skeleton.edges


def pc_skeletor(points: np.ndarray) -> Graph:
    """Laplacian contraction of the points; it drops outliers itself. Of its graphs the one with all vertices."""
    from pc_skeletor import LBC

    contraction = LBC(point_cloud=o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points)))
    contraction.extract_skeleton()
    contraction.extract_topology()
    graph = contraction.skeleton_graph
    return np.array([graph.nodes[i]["pos"] for i in range(len(graph))]), np.array(graph.edges)


def separators_of_points(points: np.ndarray, neighbours: int = 30) -> Graph:
    """PyGEL3D's multi-scale local separators, of a graph that joins each point to its nearest."""
    from pygel3d import graph

    kept = np.asarray(without_outliers(points).points)
    joined = graph.Graph()
    for point in kept:
        joined.add_node(point)
    for first, *others in cKDTree(kept).query(kept, neighbours + 1)[1].tolist():
        for other in others:
            joined.connect_nodes(first, other)
    return _separators(joined)


def separators(mesh: Mesh) -> Graph:
    """The same of the edges of a mesh."""
    from pygel3d import graph, hmesh

    return _separators(graph.from_mesh(hmesh.Manifold.from_triangles(*mesh)))


def _separators(joined):
    from pygel3d import graph

    found = graph.MSLS_skeleton(joined)
    graph.prune(found)
    found.cleanup()
    edges = [(a, b) for a in found.nodes() for b in found.neighbors(a) if a < b]
    return np.array(found.positions()), np.array(edges, int).reshape(-1, 2)


def mean_curvature_flow(mesh: Mesh) -> Graph:
    """CGAL's mean curvature skeleton."""
    from compas_cgal.skeletonization import mesh_skeleton

    ends = np.array(mesh_skeleton(mesh)).reshape(-1, 3)
    vertices, index = np.unique(ends, axis=0, return_inverse=True)
    return vertices, index.reshape(-1, 2)


def skeletor(method: str, mesh: Mesh) -> Graph:
    """One of skeletor's methods, after the repairs that its documentation begins with."""
    import skeletor
    import trimesh

    fixed = skeletor.pre.fix_mesh(trimesh.Trimesh(*mesh), remove_disconnected=5, inplace=False)
    if method == "wavefront":
        found = skeletor.skeletonize.by_wavefront(fixed, waves=1, step_size=1, progress=False)
    elif method == "contraction":
        step = float(np.linalg.norm(np.ptp(mesh[0], axis=0))) / 50
        contracted = skeletor.pre.contract(fixed, progress=False)
        found = skeletor.skeletonize.by_vertex_clusters(contracted, sampling_dist=step, progress=False)
    else:
        found = skeletor.skeletonize.by_mean_curvature(fixed, progress=False)
    return np.asarray(found.vertices), np.asarray(found.edges)


def thinning(mesh: Mesh) -> Graph:
    """scikit-image's thinning (Lee 1994) of the voxels inside, 128 along the longest side, made a graph by skan."""
    import skan
    from skimage.morphology import skeletonize

    vertices, triangles = mesh
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    side = (high - low).max() / 128
    centres = [np.arange(a - 1.5 * side, b + 2 * side, side) for a, b in zip(low, high, strict=True)]
    scene = o3d.t.geometry.RaycastingScene(nthreads=1)
    scene.add_triangles(vertices.astype(np.float32), triangles.astype(np.uint32))
    grid = np.stack(np.meshgrid(*centres, indexing="ij"), axis=-1).astype(np.float32)
    inside = scene.compute_occupancy(o3d.core.Tensor(grid), nthreads=1).numpy() > 0
    graph, places = skan.csr.skeleton_to_csgraph(skeletonize(inside, method="lee") > 0)
    first, second = graph.nonzero()
    edges = np.column_stack([first, second])[first < second]
    return [axis[0] for axis in centres] + side * np.column_stack(places), edges


SURFACES: dict[str, Callable] = {
    "points": np.asarray,
    "wrap": wrap,
    "coarser wrap": partial(wrap, fineness=60.0),
    "coarsest wrap": partial(wrap, fineness=40.0),
    "Poisson": poisson,
}


@dataclass(frozen=True)
class Peer:
    """A tool: what tables call it, its packages on PyPI, what it takes (of `SURFACES`), and the call."""

    label: str
    packages: tuple[str, ...]
    takes: str
    make: Callable[..., Graph]

    def __call__(self, points: np.ndarray) -> Graph:
        """The skeleton of a cloud, by way of a surface if one is needed."""
        return self.make(SURFACES[self.takes](points))

    def warm_up(self) -> None:
        """Import and compile what is needed, so that it is not timed."""
        few = samples.tree(1024, forks=1).points
        self.make(wrap(few, 10.0) if "wrap" in self.takes else SURFACES[self.takes](few))

    def timed(self, points: np.ndarray) -> tuple[Skeleton, float]:
        """The skeleton of a cloud and its CPU seconds, after a first call that is not timed; nothing is printed."""
        with silence():
            with suppress(Exception):
                self.warm_up()
            start = time.process_time()
            vertices, edges = self(points)
            cpu = time.process_time() - start
        return skeleton_of(vertices, edges), cpu

    def versions(self) -> dict[str, str | None]:
        """Of its packages; None for one that is not installed."""
        found: dict[str, str | None] = dict.fromkeys(self.packages)
        for name in self.packages:
            with suppress(PackageNotFoundError):
                found[name] = version(name)
        return found


def skeleton_of(vertices: np.ndarray, edges: np.ndarray) -> Skeleton:
    """A graph as a skeleton without points and radii."""
    return Skeleton(vertices, simple_edges(edges), np.full(len(vertices), np.nan), (), (), ())


CGAL, WRAP = ("compas-cgal",), ("cgal", "compas-cgal")
PEERS = {  # of tubes
    **{name: Peer(f"`{name}`", (), "points", partial(ours, name)) for name in ("default", "cao2010", "wen2024")},
    "pc-skeletor": Peer("pc-skeletor", ("pc-skeletor", "mistree", "robust-laplacian"), "points", pc_skeletor),
    "pygel-points": Peer("PyGEL3D", ("PyGEL3D",), "points", separators_of_points),
    "pygel": Peer("PyGEL3D", ("PyGEL3D", *WRAP), "coarser wrap", separators),
    "cgal": Peer("CGAL", WRAP, "wrap", mean_curvature_flow),
    "cgal-poisson": Peer("CGAL", CGAL, "Poisson", mean_curvature_flow),
    **{
        f"skeletor-{name}": Peer(f"skeletor, {name}", ("skeletor", *WRAP), "coarser wrap", partial(skeletor, name))
        for name in ("contraction", "curvature", "wavefront")
    },
    "thinning": Peer("scikit-image, voxels", ("scikit-image", "skan", *WRAP), "wrap", thinning),
    "thinning-poisson": Peer("scikit-image, voxels", ("scikit-image", "skan"), "Poisson", thinning),
}
THINGS = PEERS | {  # stout bodies have many more triangles than tubes of the same size
    "pygel": replace(PEERS["pygel"], takes="coarsest wrap"),
    "cgal": replace(PEERS["cgal"], takes="coarser wrap"),
}


def peers_of(version: str) -> dict[str, Peer]:
    """The tools with the settings that were chosen for the shapes of a version: for tubes, or for things."""
    return PEERS if version == "v1" else THINGS


def installed(known: Mapping[str, Peer], names: str) -> dict[str, Peer]:
    """The tools of these names, with commas; for no names all that are installed, and what is left out is said."""
    wanted = names.split(",") if names else list(known)
    if unknown := [name for name in wanted if name not in known]:
        raise typer.BadParameter(f"no tool {', '.join(unknown)}: there are {', '.join(known)}")
    there = {name: known[name] for name in wanted if None not in known[name].versions().values()}
    if absent := [name for name in wanted if name not in there]:
        said = f"not installed: {', '.join(absent)}; 'make peers' installs and runs all"
        if names:
            raise typer.BadParameter(said)
        typer.echo(said, err=True)
    return there


def one_thread() -> None:
    """For what does not read what `run` sets."""
    os.environ.update(NUMBA_NUM_THREADS="1", RAYON_NUM_THREADS="1")


@contextmanager
def silence() -> Iterator[None]:
    """Let nothing be printed, not even by what is written in C++."""
    sys.stdout.flush()
    sys.stderr.flush()
    kept = {stream: os.dup(stream) for stream in (1, 2)}
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        for stream in kept:
            os.dup2(nowhere, stream)
        yield
    finally:
        for stream, copy in kept.items():
            os.dup2(copy, stream)
            os.close(copy)
        os.close(nowhere)
