"""``glsk demo``."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from .console import progress, say
from .options import PipelineName, Quiet, Verbose
from .reporting import holding_interrupts, reporting


def demo(
    folder: Annotated[Path, typer.Option("--output", "-o", metavar="FOLDER", help="Made if it is not there.")] = Path(
        "demo"
    ),
    points: Annotated[
        int, typer.Option("--points", "-n", metavar="N", min=8, max=10**9, help="How many points the scan has.")
    ] = 8192,
    pipeline: PipelineName = "default",
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Skeletonise the built-in sample object.

    It is a toy dinosaur with a carrying handle on its back, scanned from two sides. Writes cloud.ply (the scan),
    skeleton.ply, skeleton.json and skeleton.png (the picture to look at).
    """
    with reporting(quiet=quiet, verbose=verbose):
        from ..errors import MissingPackageError
        from ..interop.atomic import write_atomically
        from ..interop.packages import require_for
        from ..recipes.catalogue import named_pipeline
        from ..samples import sample_object
        from .outputs import check_writable, write
        from .running import print_results, run

        chosen = named_pipeline(pipeline)
        chosen.check_complete()
        names = ("skeleton.ply", "skeleton.json", "skeleton.png", "cloud.ply")
        if folder.exists() and not folder.is_dir():
            raise NotADirectoryError(f"{folder}: is a file, not a folder")
        folder.mkdir(parents=True, exist_ok=True)
        *outputs, picture, scan = (folder / name for name in names)
        try:
            require_for(picture.suffix)
            preview, missing = picture, ""
        except MissingPackageError as error:  # all else can be shown
            preview, missing = None, str(error)
        for path in (*outputs, *([preview] if preview else []), scan):
            check_writable(path)
        with progress(not quiet and not verbose) as update:
            update("making the sample")
            sample = sample_object(points)
            with holding_interrupts():
                write_atomically(scan, lambda temporary: _write_cloud(temporary, sample.points))
            skeleton, seconds = run(chosen, sample.points, update)
            title = f"{sample.name}: a scan and its curve skeleton"
            written, problems = write(skeleton, outputs, preview, title=title, cut_loops=False, update=update)
        print_results(skeleton, seconds, [scan, *written], problems, quiet=quiet, verbose=verbose)
        if missing and not quiet:
            say("warning", f"no {picture.name}: {missing}")


def _write_cloud(path: Path, points) -> None:
    from ..interop.clouds import to_point_cloud
    from ..interop.packages import import_open3d

    if not import_open3d().io.write_point_cloud(os.fspath(path), to_point_cloud(points)):
        raise OSError(f"{path.parent}: Open3D cannot write a cloud there")
