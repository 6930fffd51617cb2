"""Surfaces with known meshes, and the checks of a torus and of a shape with limbs."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from glsk_o3d import Denoiser, OutlierRemover, RingBuilder, Sampler, Thinner, samples
from glsk_o3d.analysis.agreement import compare_skeletons
from glsk_o3d.apps.crosscheck import cross_check
from glsk_o3d.apps.crosscheck.agreement import judge
from glsk_o3d.apps.crosscheck.operators import compare_operators, mesh_operator
from glsk_o3d.apps.crosscheck.solid import Solid
from glsk_o3d.geometry.cotangent import ring_operator


@pytest.fixture(scope="session")
def even_ball():
    """Points on a sphere of radius 1/2, almost a regular lattice (Fibonacci), and their Delaunay triangles."""

    def make(n):
        i = np.arange(n) + 0.5
        z, turn = 1 - 2 * i / n, np.pi * (1 + np.sqrt(5)) * i
        points = np.column_stack([np.sqrt(1 - z**2) * np.cos(turn), np.sqrt(1 - z**2) * np.sin(turn), z]) / 2
        faces = ConvexHull(points).simplices.astype(np.int64)
        a, b, c = points[faces].transpose(1, 0, 2)
        inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), a) < 0
        faces[inward] = faces[inward][:, ::-1]
        return points, faces

    return make


@pytest.fixture(scope="session")
def ring():
    ring = samples.torus(2000)
    ring.points.flags.writeable = False  # the input is not changed
    return ring


@pytest.fixture(scope="session")
def check(ring):
    return cross_check(ring.points)


@pytest.fixture(scope="session")
def limbs():
    """Points of a body with a neck, a tail, legs and a loop."""
    return samples.sauropod(4096).points


@pytest.fixture(scope="session")
def bench(limbs):
    """A clean shape on the bench: everything that is compared, any of which can be broken by name before `judged`."""
    check = cross_check(limbs)
    points = (Sampler() | OutlierRemover() | Denoiser() | Thinner())(limbs)
    state = RingBuilder()(points)
    body = Solid(state.frame.into(check.solid.vertices), check.solid.faces, "given")
    parts = SimpleNamespace(
        check=check,
        rings=state.rings,
        ours=ring_operator(state.positions, state.rings),
        theirs=mesh_operator(body),
        skeleton=check.skeleton,
    )

    def judged(**broken):
        current = SimpleNamespace(**(vars(parts) | broken))
        _, rows = compare_operators(current.ours, current.rings, points.ring_normals, current.theirs, body)
        skeletons = compare_skeletons(
            current.skeleton, check.mesh_skeleton, 0.002 * state.frame.diagonal * state.frame.scale
        )
        return judge(rows, skeletons, check.solid, check.mesh)

    parts.judged = judged
    return parts
