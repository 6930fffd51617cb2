"""How far apart two curves are."""

import numpy as np
import pytest

from glsk_o3d.analysis.curves import distances
from glsk_o3d.skeleton import Skeleton


def line(start, end, radii, edges=((0, 1),)):
    return Skeleton([start, end], list(edges), radii, (), (), ())


def test_parallel_lines():
    distance, radius = distances(line([0, 0, 0], [1, 0, 0], [1, 3]), line([0, 2, 0], [1, 2, 0], [5, 5]), 0.01)
    np.testing.assert_allclose(distance, 2)
    np.testing.assert_allclose(radius, (5 + np.linspace(1.01, 2.99, 100)) / 2)


def test_half_of_a_line_is_on_it_and_not_the_other_way_round():
    half, whole = line([0, 0, 0], [1, 0, 0], [1, 1]), line([0, 0, 0], [2, 0, 0], [1, 1])
    assert distances(half, whole, 0.001)[0].max() < 0.001
    assert distances(whole, half, 0.001)[0].mean() == pytest.approx(0.25, abs=0.001)


def test_vertices_without_edges_and_radii_of_nothing():
    dots, other = line([0, 0, 0], [4, 0, 0], [0, 0], edges=()), line([0, 3, 0], [4, 3, 0], [0, 0])
    distance, radius = distances(dots, other, 0.1)
    np.testing.assert_allclose(distance, 3, rtol=1e-3)
    assert radius.tolist() == [0.1, 0.1]
