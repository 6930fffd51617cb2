"""A skeleton in matplotlib's axes."""

import dataclasses

import numpy as np
import pytest

from glsk_o3d import InvalidCloudError, InvalidParameterError, plot_skeleton, samples
from glsk_o3d.io.colors import COLOR_NAMES

plt = pytest.importorskip("matplotlib.pyplot")


@pytest.fixture(autouse=True)
def agg():
    plt.switch_backend("Agg")
    yield
    plt.close("all")


def pixels(axes):
    axes.figure.canvas.draw()
    return np.asarray(axes.figure.canvas.buffer_rgba())[..., :3] / 255


def is_red(image):
    return (image[..., 0] > 0.7) & (image[..., 1] < 0.4) & (image[..., 2] < 0.4)


@pytest.mark.parametrize(("width", "height"), [(3, 1), (1, 4), (1e6, 7e5)])
def test_one_scale_and_all_of_it(make, width, height):
    corners = np.array([[0, 0, 0], [width, 0, 0], [width, 0, height], [0, 0, height]], float)
    rectangle = make(corners, [[0, 1], [1, 2], [2, 3], [0, 3]])
    rectangle = dataclasses.replace(rectangle, points=(), vertex_of_point=(), normals=())
    red = is_red(pixels(plot_skeleton(rectangle, view=(0, -90))))
    rows, columns = np.nonzero(red)
    across, up = np.ptp(columns) + 1, np.ptp(rows) + 1
    assert (across - 3) / (up - 3) == pytest.approx(width / height, rel=0.06)
    assert red.sum() == red[1:-1, 1:-1].sum()  # nothing is cut off
    assert max(across / red.shape[1], up / red.shape[0]) > 0.85


def test_a_cloud_alone_in_colours():
    points = samples.torus(500).points
    points[3] = np.nan
    axes = plot_skeleton(None, cloud=points, point_colors=np.tile([0.9, 0.1, 0.1], (500, 1)))
    assert is_red(pixels(axes)).sum() > 100
    assert len(axes.collections) == 1
    assert len(axes.collections[0].get_facecolor()) in (1, 499)
    few = plot_skeleton(None, cloud=np.tile(points, (50, 1)))
    assert 5000 < len(few.collections[0].get_facecolor()) <= 10_000


@pytest.mark.parametrize("color", [*COLOR_NAMES, (0, 0, 1)])
def test_colours_of_edges(tree, color):
    axes = plot_skeleton(tree, color=color)
    pixels(axes)
    assert len(axes.collections[1].get_edgecolor()) == len(tree.edges)


def test_the_root_has_a_name_for_the_legend(tree):
    rooted = dataclasses.replace(tree, report=dataclasses.replace(tree.report, root=tuple(tree.vertices[0].tolist())))
    assert plot_skeleton(rooted).get_legend_handles_labels()[1] == ["root"]
    assert plot_skeleton(tree).get_legend_handles_labels()[1] == []


def test_what_is_wrong(tree):
    with pytest.raises(InvalidParameterError, match="color"):
        plot_skeleton(tree, color="size")
    with pytest.raises(InvalidParameterError, match="7 points"):
        plot_skeleton(tree, point_colors=np.zeros((3, 3)))
    with pytest.raises(InvalidCloudError):
        plot_skeleton(tree, cloud="scan.ply")
