"""The benchmark of scenes in tiles: its scene, and that what is wrong shows."""

import numpy as np
import pytest

from glsk_o3d import Skeleton

TOOL = "tiles"


@pytest.fixture(scope="module")
def scene(tool):
    return tool.make_scene(50_000)


def drawn(axes):
    first = np.cumsum([0, *(len(axis.vertices) for axis in axes)])
    places, radii = (np.concatenate([getattr(axis, name) for axis in axes]) for name in ("vertices", "radii"))
    edges = np.concatenate([axis.edges + at for axis, at in zip(axes, first, strict=False)])
    return Skeleton(places, edges, radii, np.empty(0), np.empty((0, 3)), np.empty((0, 3)))


def test_some_objects_stand_on_corners(scene):
    assert scene.points.shape == (50_000, 3)
    assert scene.grid.counts[2] == 1
    corners = 0
    for axis in scene.axes:
        share = (axis.vertices[:, :2] - scene.grid.low[:2]) / scene.grid.cell[:2]
        corners += len(set(map(tuple, np.floor(share).astype(int)))) == 4
    assert corners >= 3  # a row of nodes straight through a corner is in two tiles


def test_the_axes_themselves_are_right(tool, scene):
    told = tool.checked(drawn(scene.axes), scene)
    assert (told["right"], told["twice"], told["most at seams"] < 0.01) == (50, 0, True)


def test_what_is_missing_or_there_twice_shows(tool, scene):
    assert tool.checked(drawn(scene.axes[1:]), scene)["right"] == 49
    told = tool.checked(drawn([*scene.axes, scene.axes[8]]), scene)
    assert told["right"] == 49
    assert told["twice"] > 10
