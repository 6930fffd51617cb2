"""Axes made by hand, and a benchmark that is small and quickly made."""

from types import SimpleNamespace

import numpy as np
import pytest

from glsk_o3d import Skeleton


def path(*places, radius=0.1):
    """An axis: a path through places."""
    n = len(places)
    edges = np.column_stack([np.arange(n - 1), np.arange(1, n)])
    return SimpleNamespace(nodes=np.array(places, float), edges=edges, radii=np.full(n, radius))


@pytest.fixture
def rod():
    """A straight axis from 0 to 1 along x, radius 0.1."""
    return path((0, 0, 0), (1, 0, 0))


@pytest.fixture
def star():
    """Four arms of length 1 around a junction, radius 0.1."""
    arms = [[0, 0, 0], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]]
    edges = np.array([[0, 1], [0, 2], [0, 3], [0, 4]])
    return SimpleNamespace(nodes=np.array(arms, float), edges=edges, radii=np.full(5, 0.1))


@pytest.fixture
def square():
    """A closed path of four sides of length 1, radius 0.1."""
    nodes = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    return SimpleNamespace(nodes=nodes, edges=np.array([[0, 1], [1, 2], [2, 3], [0, 3]]), radii=np.full(4, 0.1))


@pytest.fixture
def small(drawn, tmp_path):
    """A benchmark of four shapes and eight clouds, of which seven are scored."""
    from glsk_o3d.benchmark import make

    choice = dict(families=["tubes", "trees"], seeds=[100, 101], variants=["clean", "scan2"])
    return make(tmp_path / "bench", **choice, jobs=1)


def axis_of(made, cloud):
    truth = made.truth(cloud.shape)
    return Skeleton(truth.nodes, truth.edges, truth.radii, (), (), ())


@pytest.fixture
def perfect(small, tmp_path):
    """A folder with the true axes as answers."""
    place = tmp_path / "perfect"
    place.mkdir()
    for cloud in small.scored:
        axis_of(small, cloud).save(place / f"{cloud.name}.obj")
    return place
