"""``glsk view``: look at a file."""

from pathlib import Path
from typing import Annotated

from .options import argument, option
from .outputs import check_outputs, skeleton_outputs, tell, write_each


def view(
    file: Annotated[Path, argument("SKELETON|SCAN", "In any format that is read.")],
    preview: Annotated[Path | None, option("PNG", "Open no window: draw a picture.")] = None,
    report: Annotated[Path | None, option("HTML", "Open no window: write a page for the browser.")] = None,
) -> None:
    """Look at a skeleton or a scan in a window.

    That needs a display; --preview and --report make files instead. In the window, C, S and T show and hide the cloud,
    the skeleton, and its tubes of true radius; H helps, Q closes. A scan has its colours there, and is grey in
    files.
    """
    import numpy as np

    from .. import Skeleton, read_skeleton
    from ..io.scans import read_scan
    from ..io.skeletons import holds_skeleton
    from ..viewing.window import show

    outputs = skeleton_outputs([], preview, report, title=file.name)
    check_outputs(outputs, file)
    cloud = None
    if holds_skeleton(file):
        skeleton = read_skeleton(file)
    else:
        scan = read_scan(file)
        cloud, none, n = scan.to_legacy(), np.empty(0), len(scan.positions)
        skeleton = Skeleton(none, none, none, np.full(n, -1), scan.positions, np.full((n, 3), np.nan))
    if preview is None and report is None:
        show(skeleton, cloud, title=file.name)
    else:
        tell({}, lambda: None, write_each(outputs, skeleton))
