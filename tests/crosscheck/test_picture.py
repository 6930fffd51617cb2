"""The picture of a cross-check shows where it disagrees."""

from dataclasses import replace

import numpy as np
import pytest

from glsk_o3d import Skeleton
from glsk_o3d.crosscheck import save_crosscheck_picture
from glsk_o3d.crosscheck.check import _drawn

matplotlib = pytest.importorskip("matplotlib")
from matplotlib.collections import LineCollection  # noqa: E402
from matplotlib.image import imread  # noqa: E402


def share_of(image, colour):
    return (np.abs(image[..., :3] - colour).max(axis=-1) < 0.02).mean()


def test_the_picture_shows_where_it_disagrees(check, tmp_path):
    views = slice(100, 350)  # without the words and the bar
    shares = []
    for angle in (0, 90, np.nan):
        changed = replace(check, angle=np.full_like(check.angle, angle))
        save_crosscheck_picture(changed, tmp_path / "p.png", title="a 50 $ ring", size=(900, 430))
        image = imread(tmp_path / "p.png")
        assert image.shape[:2] == (430, 900)
        colours = [(1, 1, 0.8), (0.502, 0, 0.149), (0.788, 0.788, 0.788)]  # pale yellow, dark red, grey
        shares.append([share_of(image[views], colour) for colour in colours])
        assert share_of(image[views], (0.067, 0.067, 0.067)) > 1e-3  # the skeleton of the cloud
    shares = np.array(shares)
    assert (np.diag(shares) > 0.01).all()
    assert (shares - np.diag(np.diag(shares)) < 1e-3).all()


def test_the_picture_has_room_for_both_skeletons(check):
    below = check.mesh_skeleton.vertices - [0, 0, 3]  # its vertices lie far out of the cloud
    reasons = tuple(f"reason {i}" for i in range(5))
    moved = replace(check, mesh_skeleton=replace(check.mesh_skeleton, vertices=below), reasons=reasons)
    figure = _drawn(moved, (1800, 855), None)
    words = [text.get_text() for text in figure.texts]
    assert "reason 2; and 2 more" in words
    for axes in figure.axes[:3]:
        low, high = np.sort([axes.get_xlim(), axes.get_ylim()], axis=1).T
        for lines in axes.collections[1:]:
            if isinstance(lines, LineCollection):
                places = np.concatenate(lines.get_segments())
                assert (places >= low - 1e-9).all()
                assert (places <= high + 1e-9).all()


def test_a_skeleton_of_one_vertex_and_points_that_are_not_finite(check, tmp_path):
    dot = Skeleton(check.skeleton.vertices[:1], (), [1], (), (), ())
    spoilt = check.points.copy()
    spoilt[3] = np.nan
    save_crosscheck_picture(replace(check, mesh_skeleton=dot, points=spoilt), tmp_path / "p.png", size=(900, 430))
    assert share_of(imread(tmp_path / "p.png"), (0.039, 0.435, 0.761)) > 0  # blue
