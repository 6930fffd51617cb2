"""``glsk view``: look at a file."""

from pathlib import Path
from typing import Annotated

from ..errors import did_you_mean
from .options import argument, option
from .outputs import check_outputs, skeleton_files, skeleton_writers, tell, write_each
from .reporting import WrongUsage, load_open3d

LABELS = ("branch", "label", "classification")
"""Attributes that are shown where a cloud has no colours: of several the first."""


def view(
    file: Annotated[Path, argument("SKELETON|SCAN", "In any format that is read or written; see 'glsk info'.")],
    preview: Annotated[Path | None, option("PNG", "Open no window: draw a picture.")] = None,
    report: Annotated[Path | None, option("HTML", "Open no window: write a page for the browser.")] = None,
    color: Annotated[str | None, option("ATTRIBUTE", "Of a scan: colour its points by it.")] = None,
) -> None:
    """Look at a skeleton or a scan in a window.

    That needs a display; --preview and --report make files instead. In the window, C, S and T show and hide the cloud,
    the skeleton, and its tubes of true radius; H helps, Q closes. A scan has its colours, or else those of its labels,
    but on a page it is grey. Labels have colours in turn, as branches do; measures go from dark blue to yellow.
    """
    from dataclasses import replace

    import numpy as np

    from .. import Skeleton, read_skeleton
    from ..io.colors import attribute_shades
    from ..io.scans import read_scan
    from ..io.skeletons import holds_skeleton
    from ..viewing import figures
    from ..viewing.preview import draw
    from ..viewing.window import show

    check_outputs(skeleton_files([], preview, report), file)
    if color is not None and report is not None:
        raise WrongUsage("--color is for the window and --preview: a page draws the points of a scan in grey")
    load_open3d()
    cloud = colors = None
    if holds_skeleton(file):
        if color is not None:
            raise WrongUsage(f"{file}: is a skeleton: --color is for scans")
        skeleton = read_skeleton(file)
    else:
        scan = read_scan(file)
        if color is not None and color not in scan.given:
            raise WrongUsage(f"{file}: {did_you_mean(color, scan.given, 'attribute of its points')}")
        shown = color or next((name for name in LABELS if name in scan.given and scan.colors is None), None)
        if shown is not None:
            scan = replace(scan, colors=attribute_shades(scan.given[shown]))
        cloud, points, colors, none = scan.to_legacy(), scan.positions, scan.colors, np.empty(0)
        skeleton = Skeleton(none, none, none, np.full(len(points), -1), points, np.full_like(points, np.nan))
    if preview is None and report is None:
        show(skeleton, cloud, title=file.name)
    else:
        writers = skeleton_writers(skeleton, [], preview, report, title=file.name)
        if preview is not None:
            warnings = skeleton.report.warnings
            picture = draw(skeleton, None, file.name, warnings=warnings, point_colors=colors)
            writers[preview] = lambda path: figures.save_figure(picture, path)
        written, problems = write_each(writers)
        tell(None, lambda: None, written, problems)
