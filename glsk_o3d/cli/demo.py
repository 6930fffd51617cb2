"""``glsk demo``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from .console import progress, say
from .options import PipelineName, Quiet, Verbose, option, output_option
from .outputs import check_outputs, skeleton_files, skeleton_writers, write_each
from .reporting import load_open3d
from .running import print_results, run


def demo(
    folder: Annotated[Path, output_option("FOLDER", "Made if it is not there.")] = Path("demo"),
    points: Annotated[int, option("N", "How many points the scan has.", "--points", "-n", min=8, max=10**9)] = 8192,
    pipeline: PipelineName = "default",
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Skeletonise the built-in sample object.

    It is a toy dinosaur with a carrying handle on its back, scanned from two sides. Writes cloud.ply (the scan),
    skeleton.ply, skeleton.json and skeleton.png (the picture to look at).
    """
    from .. import MissingPackageError, samples, save_tensor_cloud
    from ..interop.packages import import_open3d, require_for
    from .overrides import choose

    chosen = choose(pipeline)
    if folder.exists() and not folder.is_dir():
        raise NotADirectoryError(f"{folder}: is a file, not a folder")
    folder.mkdir(parents=True, exist_ok=True)
    cloud, picture = folder / "cloud.ply", folder / "skeleton.png"
    outputs, preview, missing = [folder / "skeleton.ply", folder / "skeleton.json"], picture, ""
    try:
        require_for(picture.suffix)
    except MissingPackageError as error:  # all else can be shown
        preview, missing = None, str(error)
    check_outputs([*skeleton_files([*outputs, cloud], preview)])
    with progress(not quiet and not verbose) as update:
        update("making the sample")
        load_open3d()
        o3d, sample = import_open3d(), samples.sample_object(points)
        save_tensor_cloud(o3d.t.geometry.PointCloud(o3d.core.Tensor(sample.points)), cloud)
        skeleton, seconds = run(chosen, sample.points, update)
        title = f"{sample.name}: a scan and its curve skeleton"
        written, problems = write_each(skeleton_writers(skeleton, outputs, preview, title=title), update)
    print_results(skeleton, seconds, [cloud, *written], problems, quiet=quiet, verbose=verbose)
    if missing and not quiet:
        say("warning", f"no {picture.name}: {missing}")
