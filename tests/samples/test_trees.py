"""The sample tree: what forks, how thick, and that limbs keep apart."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from glsk_o3d.errors import InvalidParameterError
from glsk_o3d.samples import signed_distance, tree


@pytest.mark.parametrize("forks", [0, 1, 3, 5])
@pytest.mark.parametrize("seed", range(3))
def test_forks_in_two_so_often(forks, seed):
    drawn = tree(64, forks=forks, seed=seed)
    ends = np.bincount(drawn.edges.ravel())
    assert np.count_nonzero(ends == 1) == 2**forks + 1
    assert np.count_nonzero(ends == 3) == 2**forks - 1
    assert ends.max() == (3 if forks else 2)


def test_limbs_taper_to_half_their_cross_section():
    drawn = tree(64, forks=4, radius=0.2, seed=1)
    tips = np.flatnonzero(np.bincount(drawn.edges.ravel()) == 1)[1:]
    np.testing.assert_allclose(drawn.radii[tips], 0.2 / 2**2.5, rtol=1e-12)
    assert (np.diff(drawn.radii[drawn.edges], axis=1) < 0).all()


def test_grows_from_the_foot_which_stands_upright():
    drawn = tree(64, forks=4, length=2.0, seed=2)
    np.testing.assert_array_equal(drawn.nodes[0], 0)
    assert (drawn.edges[:, 0] < drawn.edges[:, 1]).all()
    assert drawn.nodes[1, 2] > 0.9 * 2.0 / 6


@pytest.mark.parametrize("seed", range(6))
def test_most_tips_keep_away_from_other_limbs(seed):
    """Of limbs drawn at random the clearest grows: no tip is inside another limb."""
    drawn = tree(64, forks=5, seed=seed)
    tips = np.flatnonzero(np.bincount(drawn.edges.ravel()) == 1)[1:]
    apart = cKDTree(drawn.nodes[tips]).query(drawn.nodes[tips], 2)[0][:, 1]
    assert (apart > 2 * drawn.radii[tips]).all()
    assert (signed_distance(drawn.points, drawn.nodes, drawn.edges, drawn.radii) > -1e-9).all()


def test_a_scan_misses_what_no_camera_sees():
    whole, scanned = tree(4000, forks=2), tree(4000, forks=2, cameras=[[0, -30, 2]])
    trunk = [points[points[:, 2] < 1] for points in (whole.points, scanned.points)]
    assert (trunk[0][:, 1] > 0.03).any()
    assert not (trunk[1][:, 1] > 0.03).any()


@pytest.mark.parametrize("wrong", [dict(forks=-1), dict(forks=9), dict(forks=2.0), dict(forks=True), dict(radius=0)])
def test_refuses(wrong):
    with pytest.raises(InvalidParameterError):
        tree(10, **wrong)
