"""``glsk view``: look at a file."""

from pathlib import Path
from typing import Annotated

from .options import argument, option
from .outputs import check_outputs, skeleton_files, skeleton_writers, tell, write_each
from .reporting import load_open3d


def view(
    file: Annotated[Path, argument("SKELETON|SCAN", "In any format that is read or written; see 'glsk info'.")],
    preview: Annotated[Path | None, option("PNG", "Open no window: draw a picture.")] = None,
    report: Annotated[Path | None, option("HTML", "Open no window: write a page for the browser.")] = None,
) -> None:
    """Look at a skeleton or a scan in a window.

    That needs a display; --preview and --report make files instead. In the window, C, S and T show and hide the cloud,
    the skeleton, and its tubes of true radius; H helps, Q closes.
    """
    import numpy as np

    from .. import Skeleton, read_cloud, read_skeleton
    from ..io.skeletons import holds_skeleton
    from ..viewing.window import show

    check_outputs(skeleton_files([], preview, report), file)
    load_open3d()
    cloud = None
    if holds_skeleton(file):
        skeleton = read_skeleton(file)
    else:
        cloud = read_cloud(file)
        points, none = np.asarray(cloud.points), np.empty(0)
        skeleton = Skeleton(none, none, none, np.full(len(points), -1), points, np.full_like(points, np.nan))
    if preview is None and report is None:
        show(skeleton, cloud, title=file.name)
    else:
        written, problems = write_each(skeleton_writers(skeleton, [], preview, report, title=file.name))
        tell(None, lambda: None, written, problems)
