"""``glsk view``: look at a file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .options import Quiet, Verbose
from .reporting import holding_interrupts, reporting


def view(
    file: Annotated[
        Path, typer.Argument(metavar="SKELETON|SCAN", help="In any format that is read or written; see 'glsk info'.")
    ],
    preview: Annotated[
        Path | None, typer.Option("--preview", metavar="PNG", help="Open no window: draw a picture.")
    ] = None,
    report: Annotated[
        Path | None, typer.Option("--report", metavar="HTML", help="Open no window: write a page for the browser.")
    ] = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Look at a skeleton or a scan in a window.

    That needs a display; --preview and --report make files instead. In the window, C, S and T show and hide the cloud,
    the skeleton, and its tubes of true radius; H helps, Q closes.
    """
    with reporting(quiet=quiet, verbose=verbose):
        import numpy as np

        from ..io.scans import read_cloud
        from ..io.skeletons import holds_skeleton, read_skeleton
        from ..skeleton import Skeleton
        from ..viewing.window import show
        from .outputs import check_outputs, write
        from .running import tell_files

        elsewhere = preview is not None or report is not None
        if elsewhere:
            check_outputs([], preview, file, report)
        cloud = None
        with holding_interrupts():
            if holds_skeleton(file):
                skeleton = read_skeleton(file)
            else:
                cloud = read_cloud(file)
                points, none = np.asarray(cloud.points), np.empty(0)
                nowhere = np.full(len(points), -1)
                skeleton = Skeleton(none, none, none, nowhere, points, np.full_like(points, np.nan))
        if not elsewhere:
            show(skeleton, cloud, title=file.name)
            return
        written, problems = write(
            skeleton, [], preview, report, title=file.name, cut_loops=False, update=lambda text: None
        )
        tell_files(written, problems, quiet=quiet)
