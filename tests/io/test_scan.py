"""Conditions on the points of a scan mean what they mean in Python."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glsk_o3d.errors import InvalidParameterError
from glsk_o3d.io.scan import Scan

N = np.arange(20)
SCAN = Scan(N[:, None] * [1.0, 2, 3], attributes={"label": (N % 3).astype(np.uint16), "origin": N / 4, "class_": N})
COMPARISONS = ["label == 1", "label != 2", "x < 7", "y>=12", "x <= 9", "label in (0, 2)", "label in [1]", "z > -3.5"]


@given(st.lists(st.sampled_from([*COMPARISONS, "origin >= 2", "origin in (2.25, 4)"]), min_size=1))
def test_a_condition_means_what_it_means_in_python(comparisons):
    where = " and ".join(comparisons)
    rows = [dict(x=i, y=2 * i, z=3 * i, label=i % 3, origin=i / 4) for i in N.tolist()]
    assert SCAN.chosen(where).tolist() == [eval(where, {}, row) for row in rows]


@pytest.mark.parametrize(
    ("where", "why"),
    [
        ("lable == 1", "did you mean 'label'"),
        ("if == 1", "'if': there are x, y, z, label, origin"),
        *((where, "not understood") for where in (
            *("label = 1", "label", "label + 1 == 2", "x.__class__ == 1", "label == 'oak'", "", "label == 1 or x > 2"),
            *("0 < z < 2", "x > y", "label in (1, oak)", "not x > 1", "label in 1 and", "x > 1 and " * 100_000),
            "label in (1",
        )),
    ],
    ids=lambda text: text[:20],
)  # fmt: skip
def test_what_is_no_condition(where, why):
    with pytest.raises(InvalidParameterError, match=why):
        SCAN.chosen(where)


def test_colours_normals_and_attributes_are_selected():
    assert SCAN.chosen("class == 4").sum() == 1
    scan = Scan(SCAN.positions, SCAN.positions / 60, SCAN.positions, SCAN.attributes, np.array([[0, 1, 2]]))
    selected = scan[scan.chosen("label == 1")]
    assert len(selected) == len(selected.colors) == len(selected.normals) == len(selected.attributes["label"]) == 7
    assert len(selected.triangles) == 0
