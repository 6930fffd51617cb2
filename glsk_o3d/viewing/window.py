"""A window on the screen, where there is one."""

import ctypes
import os
import sys
from collections.abc import Callable
from typing import Any

import numpy as np

from ..data.skeleton import Skeleton
from ..errors import DisplayError
from ..interop.clouds import to_point_cloud
from ..interop.packages import import_open3d
from ..io.geometry import to_line_set, to_tubes

WINDOW_KEYS = {"C": "cloud", "S": "skeleton", "T": "radius tubes"}
CLOUD_GREY = (0.62, 0.64, 0.66)  # of points without a colour
LINE_RADIUS = 0.002  # of the skeleton's lines per diagonal


def show(skeleton: Skeleton, cloud: Any = None, *, title: str = "Curve skeleton") -> None:
    """Open a window with a skeleton and its cloud, or with one of them, and wait until it is closed.

    The keys C, S and T show and hide the cloud, the skeleton, and its tubes of true radius, which are hidden at first;
    H lists Open3D's own, Q closes the window. Branches have colours in turn. A point cloud of Open3D takes the place of
    the skeleton's points. Without a display Open3D itself would render unseen, and wait for ever: that is an error.
    """
    elsewhere = "save_report and save_preview (--report, --preview) make files to look at instead"
    if not has_display():
        raise DisplayError(f"there is no display to open a window on: {elsewhere}")
    o3d = import_open3d()
    window = o3d.visualization.VisualizerWithKeyCallback()
    if not window.create_window(title, 1280, 800):
        raise DisplayError(f"Open3D cannot open a window here: {elsewhere}")
    options = window.get_render_option()
    options.point_size, options.mesh_shade_option = 3.0, o3d.visualization.MeshShadeOption.Color
    shapes = layers(skeleton, cloud)
    for key, name in WINDOW_KEYS.items():
        shown = name != "radius tubes"
        for shape in shapes[name] if shown else ():
            window.add_geometry(shape)
        window.register_key_callback(ord(key), _switch(shapes[name], shown))
    window.run()
    window.destroy_window()


def layers(skeleton: Skeleton, cloud: Any = None) -> dict[str, list[Any]]:
    """What the window can show, by name: Open3D geometries."""
    if cloud is None:
        cloud = to_point_cloud(skeleton.points[np.isfinite(skeleton.points).all(axis=1)])
    else:
        cloud = import_open3d().geometry.PointCloud(cloud).remove_non_finite_points()
    if not cloud.has_colors():
        cloud.paint_uniform_color(CLOUD_GREY)
    shapes: dict[str, list[Any]] = {"cloud": [cloud] if cloud.has_points() else [], "skeleton": [], "radius tubes": []}
    if len(skeleton.vertices):
        box = np.concatenate([np.asarray(cloud.points), skeleton.vertices])
        line = LINE_RADIUS * float(np.linalg.norm(np.ptp(box, axis=0))) or 1.0
        # lines of Open3D are a pixel wide: tubes show better
        shapes["skeleton"] = [to_line_set(skeleton, "branch"), to_tubes(skeleton, "branch", radius=line, sides=8)]
        if np.isfinite(skeleton.radii).all():
            shapes["radius tubes"] = [to_tubes(skeleton, "branch")]
    return shapes


def _switch(shapes: list[Any], shown: bool) -> Callable[[Any], bool]:
    def switch(window: Any) -> bool:
        nonlocal shown
        shown = not shown
        for shape in shapes:
            change = window.add_geometry if shown else window.remove_geometry
            change(shape, reset_bounding_box=False)
        return True

    return switch


def has_display() -> bool:
    """Whether a window can be seen: on Linux and the like, in a session of Wayland or if an X server answers."""
    if sys.platform in ("win32", "darwin") or os.environ.get("WAYLAND_DISPLAY"):
        return True
    if not os.environ.get("DISPLAY"):
        return False
    try:
        x11 = ctypes.CDLL("libX11.so.6")  # which Open3D needs, too
    except OSError:
        return False
    x11.XOpenDisplay.restype = ctypes.c_void_p
    x11.XCloseDisplay.argtypes = [ctypes.c_void_p]
    display = x11.XOpenDisplay(None)
    if display:
        x11.XCloseDisplay(display)
    return bool(display)
