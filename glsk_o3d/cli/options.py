"""Arguments and options that several commands have."""

from pathlib import Path
from typing import Annotated, Any

from typer import Argument, Option

SKELETON_ENDINGS = ["ply", "obj", "json", "npz", "swc", "vtp", "dxf", "graphml", "glb", "urdf"]
"""Endings of skeletons; written out, since the table of formats is slow to import."""
TREE_ENDINGS = ["swc", "glb", "urdf"]
"""Endings of formats that hold only trees."""


def argument(metavar: str, help: str, **more: Any) -> Any:
    """An argument, as `Annotated` takes it; that a file cannot be read is no mistake in the command line."""
    return Argument(metavar=metavar, help=help, readable=False, **more)


def option(metavar: str, help: str, *names: str, **more: Any) -> Any:
    """An option with a value, as `Annotated` takes it; it is called as its parameter, unless it has names."""
    return Option(*names, metavar=metavar, help=help, readable=False, **more)


def output_option(metavar: str, help: str) -> Any:
    """The option of a command for the files that it writes."""
    return option(metavar, help, "--output", "-o")


def root_option(help: str) -> Any:
    """The option for where a skeleton grows from: the number of a vertex, or words for `editing.reroot`."""
    words = "x to -z for the lowest along an axis, thickest, the number of a vertex, or a point near one, x,y,z"

    def place(text: str) -> int | str:
        return int(text) if text.isdecimal() and len(text) < 19 else text

    return option("ROOT", f"{help}: {words}.", parser=place)


SkeletonFile = Annotated[Path, argument("SKELETON", "A skeleton in a file: json, npz, ply, obj or swc.")]
ScanFile = Annotated[
    Path, argument("SCAN", "A cloud: ply, pcd, csv, txt, asc, xyz, las, laz, e57; or a mesh: ply, obj, stl, off, glb.")
]
Where = Annotated[
    str | None, option("CONDITION", "Take only points such as 'classification == 5'; 'glsk info' says what a file has.")
]
DropInvalid = Annotated[bool, Option("--drop-invalid", help="Drop points with NaN or infinite coordinates.")]
Sample = Annotated[
    int | None, option("N", "Sample a mesh with N points by area, even if its vertices lie close together.", min=8)
]

PipelineName = Annotated[
    str, option("NAME|FILE", "default, fast, tree, wen2024, cao2010, a plugin's, or a recipe or a result in json.")
]
Settings = Annotated[
    list[str] | None,
    option(
        "[FILTER.]PARAMETER=VALUE",
        "Change a parameter, such as Connector.radius=2%, or k=24 where only one filter has a k; see 'glsk filters'; "
        "may be repeated.",
        "--set",
    ),
]
Root = Annotated[Any, root_option("Where the skeleton grows from, by default from where its file says")]

SkeletonOutput = Annotated[
    list[Path] | None,
    output_option(
        "FILE", f"Where to write the skeleton: {', '.join(SKELETON_ENDINGS)}, by the ending; may be repeated."
    ),
]
Preview = Annotated[Path | None, option("PNG", "Also draw cloud and skeleton.")]
ReportPage = Annotated[Path | None, option("HTML", "Also write a page to look at: turn, zoom, read.", "--report")]
CutLoops = Annotated[
    bool, Option("--cut-loops", help=f"Cut loops open for formats that hold only trees ({', '.join(TREE_ENDINGS)}).")
]
Json = Annotated[bool, Option("--json", help="Print JSON on stdout instead of tables.")]
Quiet = Annotated[bool, Option("--quiet", "-q", help="Print nothing but errors (and JSON, if asked for).")]
Verbose = Annotated[bool, Option("--verbose", "-v", help="Also print each iteration, the log, and tracebacks.")]
