"""Curves without a cloud, and shapes with a known axis."""

from dataclasses import replace

import numpy as np
import pytest

from glsk_o3d.data.skeleton import Skeleton
from glsk_o3d.samples import torus, tube


@pytest.fixture(scope="session")
def curve():
    """A skeleton without a cloud; a path through the vertices if no edges are given."""

    def make(vertices, edges=None, radii=np.nan):
        vertices = np.asarray(vertices, float)
        n = len(vertices)
        if edges is None:
            edges = np.column_stack([np.arange(n - 1), np.arange(1, n)])
        return Skeleton(vertices, edges, np.broadcast_to(radii, n), (), (), ())

    return make


@pytest.fixture(scope="session")
def axis_of(curve):
    """The axis of a sample as a skeleton."""

    def make(sample, scale=1.0, shift=0.0):
        return curve(sample.nodes * scale + np.asarray(shift), sample.edges, sample.radii)

    return make


@pytest.fixture(scope="session")
def pipe():
    """An open tube along x, radius 0.1, length 1: 100 rings of 40 points, each turned against the one before."""
    ring, place = np.divmod(np.arange(4000), 40)
    angle = 2 * np.pi * (place / 40 + 0.618034 * ring)
    points = np.column_stack([(ring + 0.5) / 100 - 0.5, 0.1 * np.cos(angle), 0.1 * np.sin(angle)])
    return replace(tube(8, capped=False), points=points)


@pytest.fixture(scope="session")
def ring():
    """A torus around z: radii 0.4 and 0.1."""
    return torus(16000)
