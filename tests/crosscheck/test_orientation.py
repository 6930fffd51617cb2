"""Normals that agree on which side is out."""

import numpy as np
import pytest

from glsk_o3d.crosscheck.mesh import orient_normals
from glsk_o3d.numerics.neighbourhoods import nearest_neighbours
from glsk_o3d.samples import sphere, torus, two_rings


def edges_of(points, k=8):
    _, neighbours = nearest_neighbours(points, k)
    return np.column_stack([np.repeat(np.arange(len(points)), k - 1), neighbours[:, 1:].ravel()])


def outward_of(sample):
    """Exact outward normals of a tube around circles, or of a ball."""
    nearest = np.argmin(np.linalg.norm(sample.points[:, None] - sample.nodes, axis=2), axis=1)
    away = sample.points - sample.nodes[nearest]
    return away / np.linalg.norm(away, axis=1, keepdims=True)


@pytest.mark.parametrize("shape", [sphere, torus, two_rings])
@pytest.mark.parametrize("seed", [0, 1])
def test_normals_of_closed_surfaces_point_outward(shape, seed):
    sample = shape(3000, seed=seed)
    outward = outward_of(sample)
    signs = np.random.default_rng(seed).choice([-1, 1], (len(outward), 1))
    turned = orient_normals(sample.points, outward * signs, edges_of(sample.points))
    np.testing.assert_allclose(np.abs(np.einsum("ij,ij->i", turned, outward)), 1)
    right = np.einsum("ij,ij->i", turned, outward) > 0
    assert right.all()
