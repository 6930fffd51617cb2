"""A skeleton in matplotlib's axes, to draw more into."""

from typing import Any

import numpy as np

from ..data.skeleton import Skeleton
from ..errors import InvalidParameterError
from ..interop.clouds import cloud_points
from ..interop.packages import require
from ..io.colors import shades
from .preview import ROOT_MARK

_FAR_GREY, _NEAR_GREY = 0.93, 0.55  # of the farthest and of the nearest point
_TITLE_ROOM = 0.3  # inches
_MOST_POINTS = 10_000
_EYE_MARGIN = 0.09  # from the middle of what matplotlib's orthographic eye sees to its edge


def plot_skeleton(
    skeleton: Skeleton | None,
    axes: Any = None,
    *,
    cloud: Any = None,
    color: Any = (0.85, 0.1, 0.1),
    point_colors: np.ndarray | None = None,
    view: tuple[float, float] = (15.0, -65.0),
    line_width: float = 2.0,
) -> Any:
    """Draw a skeleton and its cloud into matplotlib's three-dimensional axes.

    All axes have one scale and no ticks, and the projection is orthographic. Of larger clouds 10 000 points are drawn.
    Farther points are lighter, and the skeleton is on top. A blue diamond is the root of a tree, which
    ``axes.legend()`` names. You can draw more into the returned axes; use ``clip_on=False``, because matplotlib clips
    to a square.

    Parameters
    ----------
    skeleton : Skeleton or None
        None draws the cloud alone.
    axes : mpl_toolkits.mplot3d.Axes3D, optional
        By default new ones in a new figure.
    cloud : cloud, optional
        Anything that carries points, instead of the skeleton's own.
    color : {"branch", "order", "radius", "confidence", "support"} or three floats in [0, 1]
        Of the edges, as for `glsk_o3d.to_line_set`.
    point_colors : (N, 3) float array, optional
        Red, green and blue of the cloud's points from 0 to 1, instead of greys.
    view : (float, float)
        Elevation and azimuth of the eye [degrees].
    line_width : float
        [points]

    Returns
    -------
    mpl_toolkits.mplot3d.Axes3D

    Raises
    ------
    InvalidCloudError, InvalidParameterError
        The cloud has no points, or the colour is unknown.
    MissingPackageError
        matplotlib is not installed.

    Examples
    --------
    >>> import glsk_o3d as glsk
    >>> from glsk_o3d.samples import torus
    >>> axes = glsk.plot_skeleton(glsk.skeletonize(torus(1000).points), view=(90, 0))
    >>> axes.figure.savefig("torus.png")  # doctest: +SKIP
    """
    require("matplotlib")
    import matplotlib.pyplot as plt
    from mpl_toolkits.mplot3d.art3d import Line3DCollection
    from mpl_toolkits.mplot3d.proj3d import proj_transform

    if axes is None:
        axes = plt.figure(figsize=(6, 4), layout="constrained").add_subplot(projection="3d")
    none = np.empty(0)
    skeleton = Skeleton(none, none, none, none, none, none) if skeleton is None else skeleton
    points, vertices = skeleton.points if cloud is None else cloud_points(cloud), skeleton.vertices
    if point_colors is not None and np.shape(point_colors) != points.shape:
        raise InvalidParameterError(f"{len(points)} points need as many colours, not {np.shape(point_colors)}")
    finite = np.flatnonzero(np.isfinite(points).all(axis=1))
    shown = np.concatenate([points[finite], vertices])
    low, high = (shown.min(axis=0), shown.max(axis=0)) if len(shown) else (np.zeros(3), np.ones(3))
    elevation, azimuth = np.deg2rad(view)
    eye = [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    drawn = finite[:: max(1, -(-len(finite) // _MOST_POINTS))]
    drawn = drawn[np.argsort((points[drawn] - low) @ eye, kind="stable")]
    grey = np.linspace(_FAR_GREY, _NEAR_GREY, len(drawn))[:, None].repeat(3, axis=1)
    paint = grey if point_colors is None else np.asarray(point_colors)[drawn]
    axes.computed_zorder = False
    axes.scatter(*points[drawn].T, s=1.5, c=paint, linewidths=0, depthshade=False, clip_on=False, zorder=1)
    if len(skeleton.edges):
        colors = shades(skeleton, color, skeleton.branch_of_edge, skeleton.edges)
        style = dict(colors=colors, linewidths=line_width, capstyle="round", clip_on=False, zorder=2)
        axes.add_collection(Line3DCollection(vertices[skeleton.edges], **style))
    if skeleton.report.root:
        axes.scatter(*skeleton.report.root, **ROOT_MARK, depthshade=False, clip_on=False, zorder=3)
    half = np.maximum(high - low, 0.05 * (high - low).max() or 1.0) / 2
    for name, middle, reach in zip("xyz", (low + high) / 2, half, strict=True):
        getattr(axes, f"set_{name}lim")(middle - reach, middle + reach)
    axes.set_proj_type("ortho")
    axes.view_init(*view)
    axes.set_box_aspect(half)
    if len(shown):  # matplotlib leaves room for the corners of the box, which is empty there
        across, up, _ = proj_transform(*shown.T, axes.get_proj())
        room = _EYE_MARGIN * _squares(axes)
        axes.set_box_aspect(half, zoom=min(room[0] / np.abs(across).max(), room[1] / np.abs(up).max()))
    axes.set_axis_off()
    return axes


def _squares(axes: Any) -> Any:
    """Width and height that are free for the drawing, over the side of the square that matplotlib gives it."""
    size, spec = axes.figure.get_size_inches(), axes.get_subplotspec()
    if spec is None:
        width, height = axes.get_position().size * size
    else:
        rows, columns, *_ = spec.get_geometry()
        width, height = size * [len(spec.colspan) / columns, len(spec.rowspan) / rows]
    return np.array([width, min(max(height - _TITLE_ROOM, height / 2), width)]) / min(width, height)
