"""Conditions on the points of a scan mean what they mean in Python."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glsk_o3d.errors import InvalidParameterError
from glsk_o3d.io.scan import Scan

N = np.arange(20)
SCAN = Scan(N[:, None] * [1.0, 2, 3], attributes={"label": (N % 3).astype(np.uint16), "intensity": N / 4})
ATOMS = st.sampled_from(
    ["label == 1", "label != 2", "x < 7", "y >= 12", "2 < x <= 9", "label in (0, 2)", "label not in [1]", "z > -3.5"]
    + ["-label < -1", "x > intensity"]
)


@given(st.recursive(ATOMS, lambda some: st.one_of(
    st.tuples(some, st.sampled_from(["and", "or"]), some).map(lambda parts: "({} {} {})".format(*parts)),
    some.map("not ({})".format),
)))  # fmt: skip
def test_it_means_what_python_means(where):
    rows = [dict(x=i, y=2 * i, z=3 * i, label=i % 3, intensity=i / 4) for i in N.tolist()]
    assert SCAN.chosen(where).tolist() == [eval(where, {}, row) for row in rows]


@pytest.mark.parametrize(
    ("where", "why"),
    [
        ("lable == 1", r"did you mean 'label'\? \(there are x, y, z, label, intensity\)"),
        ("intens > 1", "did you mean 'intensity'"),
        ("class == 1", "no attribute of the points is called 'class': there are x, y, z, label, intensity"),
        ("label = 1", "write such as"),
        ("label in 1, 2", r"write such as 'label in \(1, 2\)'"),
        ("label", "is no condition"),
        ("1 == 1", "is no condition"),
        ("label + 1 == 2", "'label . 1' is not understood"),
        ("__import__('os').system('true') == 0", "is not understood"),
        ("x.__class__ == 1", "is not understood"),
        ("label == 'oak'", "is not understood"),
        ("", "write such as"),
        pytest.param("not " * 100_000 + "label == 1", "write such as", id="deep"),
    ],
)
def test_what_is_no_condition(where, why):
    with pytest.raises(InvalidParameterError, match=why):
        SCAN.chosen(where)


def test_all_that_is_known_is_selected():
    scan = Scan(SCAN.positions, SCAN.positions / 60, SCAN.positions, SCAN.attributes, np.array([[0, 1, 2]]))
    some = scan[scan.chosen("label == 1")]
    assert len(some) == len(some.colors) == len(some.normals) == len(some.attributes["intensity"]) == 7
    assert len(some.triangles) == 0
