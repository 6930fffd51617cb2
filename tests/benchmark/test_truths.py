"""The true axes of things: what is written comes back, and what does not fit is refused."""

import numpy as np
import pytest
from glsk_bench.folders import write_axis
from glsk_bench.truths import THING_ARRAYS, ThingTruth, read_axis

from glsk_o3d.analysis.comparison import Truth
from glsk_o3d.errors import FileFormatError, InvalidParameterError

NODES, EDGES = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0.0]]), np.array([[0, 1], [1, 2]])
RADII = np.array([0.1, 0.2, 0.3])
MORE = dict(
    half_width=2 * RADII, flat=np.array([2]), judged=np.array([True, False]), mirror=np.array([[0, 0, 0], [0, 1, 0.0]])
)


@pytest.mark.parametrize("mirror", [MORE["mirror"], np.empty((0, 3))])
def test_what_is_written_comes_back(mirror, tmp_path):
    truth = ThingTruth(NODES, EDGES, RADII, **{**MORE, "mirror": mirror})
    write_axis(tmp_path / "thing.npz", truth)
    found = read_axis(tmp_path / "thing.npz")
    assert isinstance(found, ThingTruth)
    for name in ("nodes", "edges", "radii", *THING_ARRAYS):
        one, other = getattr(found, name), getattr(truth, name)
        np.testing.assert_array_equal(one, other)
        assert (one.dtype, one.shape) == (other.dtype, other.shape)


def test_other_axes_are_written_and_read_as_before(tmp_path):
    write_axis(tmp_path / "axis.npz", Truth(NODES, EDGES, RADII))
    with np.load(tmp_path / "axis.npz") as found:
        assert found.files == ["nodes", "edges", "radii"]
    assert type(read_axis(tmp_path / "axis.npz")) is Truth


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (dict(half_width=RADII[:2]), "half_width at each"),
        (dict(half_width=0 * RADII), "half_width at each"),
        (dict(half_width=["wide"] * 3), "invalid half_width or mirror"),
        (dict(flat=np.array([3])), "some of its nodes"),
        (dict(flat=np.array([0.5])), "some of its nodes"),
        (dict(judged=np.array([True])), "each edge"),
        (dict(judged=np.array([1, 0])), "each edge"),
        (dict(mirror=np.zeros((1, 3))), "a point and a normal"),
        (dict(mirror=[[0, 0, 0], [0, 2, 0.0]]), "must have length 1"),
    ],
)
def test_what_does_not_fit_is_refused(wrong, said, tmp_path):
    with pytest.raises(InvalidParameterError, match=said):
        ThingTruth(NODES, EDGES, RADII, **MORE | wrong)
    np.savez(tmp_path / "thing.npz", nodes=NODES, edges=EDGES, radii=RADII, **MORE | wrong)
    with pytest.raises(FileFormatError, match=f"not a valid truth.*{said}"):
        read_axis(tmp_path / "thing.npz")


def test_a_file_that_lacks_some_is_refused(tmp_path):
    np.savez(tmp_path / "thing.npz", nodes=NODES, edges=EDGES, radii=RADII, flat=MORE["flat"])
    with pytest.raises(FileFormatError, match="it lacks half_width, judged, mirror"):
        read_axis(tmp_path / "thing.npz")
