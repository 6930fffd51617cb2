"""Group statistics against loops."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glsk_o3d.geometry.groups import Members, group_median, group_sum


@settings(max_examples=200)
@given(st.lists(st.tuples(st.integers(0, 6), st.floats(-1e3, 1e3)), max_size=40))
def test_group_medians_are_those_of_a_loop(rows):
    group, values = np.array([g for g, _ in rows], int), np.array([v for _, v in rows], float)
    expected = [np.median(values[group == g]) if (group == g).any() else 0 for g in range(8)]
    np.testing.assert_allclose(group_median(values, group, 8), expected, rtol=1e-15)


@pytest.mark.parametrize("shape", [(50,), (50, 3), (50, 3, 3), (50, 2, 1, 4)])
def test_group_sums_are_those_of_a_loop(shape):
    rng = np.random.default_rng(0)
    values, group = rng.normal(size=shape), rng.integers(0, 6, 50)
    total = group_sum(values, group, 9)
    assert total.shape == (9, *shape[1:])
    for g in range(9):
        np.testing.assert_allclose(total[g], values[group == g].sum(axis=0), atol=1e-13)


def test_members_of_groups_in_the_order_asked_for():
    members = Members(np.array([2, 0, -1, 2, 0, 2]), 4)
    np.testing.assert_array_equal(members.of(np.array([2, 1, 0])), [0, 3, 5, 1, 4])
    np.testing.assert_array_equal(members.of(np.array([0, 0])), [1, 4, 1, 4])
    assert members.of(np.array([3])).shape == members.of(np.array([], int)).shape == (0,)
