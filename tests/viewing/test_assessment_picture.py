"""Pictures of skeletons, their edges coloured by a measure."""

import numpy as np
import pytest

from glsk_o3d import save_assessment
from glsk_o3d.errors import FileFormatError, InvalidParameterError
from glsk_o3d.samples import torus
from glsk_o3d.skeleton import Skeleton

matplotlib = pytest.importorskip("matplotlib")
from matplotlib.image import imread  # noqa: E402


@pytest.fixture(scope="module")
def ring():
    return torus(1000)


@pytest.fixture(scope="module")
def moved(ring):
    """The axis of the ring, half a radius too high."""
    return Skeleton(ring.nodes + [0, 0, 0.05], np.sort(ring.edges), 1.1 * ring.radii, (), (), ())


def colours(path):
    """Whether a picture has dark blue and orange lines, left of the colour bar and below it."""
    image = imread(path)[110:, :, :3]
    blue = (image[..., 2] > 0.5) & (image[..., 0] < 0.2) & (image[..., 1] < 0.1)
    orange = (image[..., 0] > 0.9) & (image[..., 1] > 0.5) & (image[..., 2] < 0.35)
    return blue.sum(), orange.sum()


def test_the_picture_tells_good_from_bad(ring, moved, tmp_path):
    flags = np.zeros(len(moved.edges))
    counts = {}
    for value, best in ((0, 0), (1, 0), (7, 0), (0, 1), (1, 1), (np.nan, 1)):
        save_assessment(
            moved, ring.points, flags + value, tmp_path / "p.png", label="measure", best=best, title="a title"
        )
        blue, orange = colours(tmp_path / "p.png")
        counts[value, best] = (blue > 500, orange > 500)
    good, bad = (True, False), (False, True)
    assert list(counts.values()) == [good, bad, bad, bad, good, (False, False)]


def test_the_legend_tells_what_black_is(ring, moved, tmp_path):
    legends = []
    for value in (0.5, np.nan):
        save_assessment(moved, ring.points, np.full(len(moved.edges), value), tmp_path / "p.png", label="measure")
        legends.append((imread(tmp_path / "p.png")[85:110, 1400:, :3] < 0.5).sum())
    assert legends[0] == 0 < legends[1]


def test_the_picture_needs_a_value_per_edge(ring, moved, tmp_path):
    with pytest.raises(InvalidParameterError, match="128 edges"):
        save_assessment(moved, ring.points, np.zeros(3), tmp_path / "p.png", label="measure")
    with pytest.raises(FileFormatError, match=r"p\.jpg: .*PNG"):
        save_assessment(moved, ring.points, np.zeros(128), tmp_path / "p.jpg", label="measure")
    assert list(tmp_path.iterdir()) == []
